"""Text as it lies on disk: compressed, and in whatever encoding."""

import lzma
import re
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import PurePosixPath
from typing import Any

import pyarrow as pa

from unconstrain.errors import DataError
from unconstrain.memory import check_memory
from unconstrain.recordings.files import PROBED, File
from unconstrain.recordings.formats.base import damage_named, find_part, note_part

BOM = b"\xef\xbb\xbf"
ZIP = "zip"
CODECS = {
    b"\x1f\x8b": "gzip", b"BZh": "bz2", b"\x28\xb5\x2f\xfd": "zstd", b"\xfd7zXZ\0": "xz", b"PK\x03\x04": ZIP,
}  # fmt: skip
"""How files begin that are compressed."""

BZIP_BLOCKS = (b"1AY&SY", b"\x17\x72\x45\x38\x50\x90")
"""How what follows in a bz2 file begins: with a block, or with the end."""

PIECE = 1 << 24
"""Bytes decompressed at a time, between which the memory is checked."""

CONTROL = re.compile("[\x00-\x08\x0e-\x1a\x1c-\x1f\x7f\ufffe]")
"""Characters that no text holds; the escape character, with which terminals are coloured, is in some."""

PRINTED = re.compile(b"[\x80-\x9f]")
"""Bytes that are letters and dashes on Windows, and nothing in Latin-1."""

NO_LETTERS = (
    ".parquet",
    ".pq",
    ".mat",
    ".h5",
    ".hdf5",
    ".xlsx",
    ".npz",
    ".npy",
    ".bag",
    ".mcap",
    ".db3",
    ".c3d",
)
"""Files of an archive that have to be taken out of it to be read."""

LATIN = "it is not UTF-8, so it is read as {}; save it as UTF-8 if letters look wrong"
WIDE = "it is read as UTF-16; save it as UTF-8 if letters look wrong"

INSTEAD = "write it as Parquet, which is read in pieces"


def read_text(file: File, part: str | None = None) -> tuple[bytes, tuple[str, ...]]:
    """Return the whole text as UTF-8, and what was guessed of its encoding.

    Parameters
    ----------
    file : File
    part : str, optional
        Which file of an archive.

    Returns
    -------
    text : bytes
    guesses : tuple of str

    Raises
    ------
    DataError
        The content is no text, or damaged, or does not fit into memory.
    """
    check_memory(3.0 * file.info.size, f"reading {file.shown}", INSTEAD)
    codec = find_codec(file)
    said: tuple[str, ...] = ()
    if codec == ZIP:
        every = members(file)
        chosen = _member(file, part)
        said = (note_part(chosen, every),) if len(every) > 1 and part is None else ()
    text, guesses = decode(file.read() if codec is None else _decompress(file, codec, part), file.shown)
    return text, (*said, *guesses)


def begin_text(file: File, part: str | None = None) -> tuple[bytes, bool, tuple[str, ...]]:
    """Return the first lines of the text as UTF-8, whether they are all of it, and what was guessed.

    Parameters
    ----------
    file : File
    part : str, optional
        Which file of an archive.

    Returns
    -------
    text : bytes
        Whole lines.
    is_all : bool
    guesses : tuple of str

    Raises
    ------
    DataError
        The content is no text, or damaged.
    """
    codec = find_codec(file)
    if codec is None:
        data = file.begin()
        is_all = len(data) == file.info.size
    else:
        data = _decompress(file, codec, part, PROBED)
        is_all = len(data) < PROBED
    if not is_all:
        end = max(data.rfind(b"\n"), data.rfind(b"\r"))
        # In UTF-16 a line ends with two bytes, of which the newline is the first or the second.
        data = data[: end + 1 + (end + 1) % 2] if _is_wide(data) else data[: end + 1]
    text, guesses = decode(data, file.shown)
    return text, is_all, guesses


def members(file: File) -> tuple[str, ...]:
    """Return the names of the files in an archive, the largest first; none where it is no archive.

    What a computer adds for itself is left out.
    """
    if find_codec(file) != ZIP:
        return ()
    with damage_named(file.shown, "a ZIP archive"), file.open() as opened, zipfile.ZipFile(opened) as archive:
        return tuple(
            each.filename
            for each in sorted(archive.infolist(), key=lambda each: -each.file_size)
            if each.file_size
            and not any(part[:1] in ("_", ".") for part in PurePosixPath(each.filename).parts)
        )


def is_text(file: File) -> bool:
    """Whether a file begins as text does."""
    try:
        text, _, _ = begin_text(file)
    except DataError:
        return False
    return bool(text.strip()) and CONTROL.search(text.decode()) is None


def is_compressed(file: File) -> bool:
    """Whether a file begins as compressed ones do."""
    codec = find_codec(file)
    # Workbooks and archives of arrays are ZIP archives too.
    return codec is not None and (codec != ZIP or file.suffix == ".zip")


def decode(data: bytes, shown: str) -> tuple[bytes, tuple[str, ...]]:
    """Return text as UTF-8, and what was guessed of its encoding.

    Parameters
    ----------
    data : bytes
    shown : str
        The file, as the user calls it.

    Returns
    -------
    text : bytes
    guesses : tuple of str

    Raises
    ------
    DataError
        It is no text.
    """
    no_text = DataError(f"{shown} is not a text table: save it as UTF-8 text, or correct its suffix")
    if data[257:262] == b"ustar":
        raise DataError(f"{shown} is an archive of several files: unpack it, and give the files in it")
    if _is_wide(data):
        marked = data[:2] in (b"\xff\xfe", b"\xfe\xff")
        little = data[1::2][:PROBED].count(0) > data[::2][:PROBED].count(0)
        try:
            text = data.decode("utf-16" if marked else "utf-16-le" if little else "utf-16-be")
            encoded = text.encode()
        except UnicodeError as error:
            raise no_text from error
        if CONTROL.search(text[:PROBED]) is not None:
            raise no_text
        return encoded, (WIDE,)
    data = data.rstrip(b"\0")
    crashed = b"\0" in data
    try:
        text = data.decode()
    except UnicodeDecodeError:
        windows = PRINTED.search(data) is not None
        text = data.decode("cp1252" if windows else "latin-1", errors="replace")
        if CONTROL.search(text[:PROBED].replace("\0", "")) is not None:
            raise no_text from None
        return text.encode(), (LATIN.format("Windows-1252" if windows else "Latin-1"),)
    if crashed and CONTROL.search(text[:PROBED].replace("\0", "")) is not None:
        raise no_text
    return data, ()


def _is_wide(data: bytes) -> bool:
    """Whether text is UTF-16: it says so, or every other byte of much of it is zero, and no other."""
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return True
    even, odd = (data[i:PROBED:2].count(0) for i in (0, 1))
    return min(even, odd) == 0 and max(even, odd) > min(len(data), PROBED) / 4


def find_codec(file: File) -> str | None:
    """Return what a file is compressed with; None for plain text.

    Parameters
    ----------
    file : File

    Returns
    -------
    str or None
    """
    codec = next((codec for magic, codec in CODECS.items() if file.magic.startswith(magic)), None)
    # Three letters may begin a text, too.
    return None if codec == "bz2" and file.magic[4:10] not in BZIP_BLOCKS else codec


def _decompress(file: File, codec: str, part: str | None = None, size: int | None = None) -> bytes:
    """Return all that is compressed, or its first `size` bytes."""
    pieces: list[bytes] = []
    length = 0
    with damage_named(file.shown, f"compressed with {codec}"), _opened(file, codec, part) as stream:
        while size is None or length < size:
            piece = stream.read(PIECE if size is None else size - length)
            if not piece:
                break
            pieces.append(piece)
            length += len(piece)
            # A small file may hold far more than the memory does.
            check_memory(3.0 * length, f"reading {file.shown}", INSTEAD)
    return b"".join(pieces)


@contextmanager
def _opened(file: File, codec: str, part: str | None) -> Iterator[Any]:
    """Open what is compressed for reading."""
    with file.open() as opened:
        if codec == ZIP:
            with zipfile.ZipFile(opened) as archive, archive.open(_member(file, part)) as stream:
                yield stream
        elif codec == "xz":
            with lzma.open(opened) as stream:
                yield stream
        else:
            with pa.CompressedInputStream(opened, codec) as stream:
                yield stream


def _member(file: File, part: str | None) -> str:
    """Return the file of an archive that is read: the one that the user names, or the largest."""
    every = members(file)
    chosen = find_part(part, every, file.shown) or next(iter(every), "")
    if not chosen:
        raise DataError(f"{file.shown} is empty: there are no files in it")
    if chosen.lower().endswith(NO_LETTERS):
        raise DataError(f"{file.shown} holds {chosen}, which is no text: unpack it, and give that file")
    return chosen
