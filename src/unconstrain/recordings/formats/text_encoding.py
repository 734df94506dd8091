"""Text as it lies on disk: compressed, and in whatever encoding."""

import re

import pyarrow as pa

from unconstrain.errors import DataError
from unconstrain.memory import check_memory
from unconstrain.recordings.files import PROBED, File
from unconstrain.recordings.formats.base import damage_named

BOM = b"\xef\xbb\xbf"
CODECS = {b"\x1f\x8b": "gzip", b"BZh": "bz2", b"\x28\xb5\x2f\xfd": "zstd"}
"""How files begin that are compressed."""

BZIP_BLOCKS = (b"1AY&SY", b"\x17\x72\x45\x38\x50\x90")
"""How what follows in a bz2 file begins: with a block, or with the end."""

PIECE = 1 << 24
"""Bytes decompressed at a time, between which the memory is checked."""

CONTROL = re.compile("[\x00-\x08\x0e-\x1a\x1c-\x1f\x7f\ufffe]")
"""Characters that no text holds; the escape character, with which terminals are coloured, is in some."""

LATIN = "it is not UTF-8, so it is read as Latin-1; save it as UTF-8 if letters look wrong"
WIDE = "it is read as UTF-16; save it as UTF-8 if letters look wrong"

INSTEAD = "write it as Parquet, which is read in pieces"


def read_text(file: File) -> tuple[bytes, tuple[str, ...]]:
    """Return the whole text as UTF-8, and what was guessed of its encoding.

    Parameters
    ----------
    file : File

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
    codec = _codec(file)
    return decode(file.read() if codec is None else _decompress(file, codec), file.shown)


def begin_text(file: File) -> tuple[bytes, bool, tuple[str, ...]]:
    """Return the first lines of the text as UTF-8, whether they are all of it, and what was guessed.

    Parameters
    ----------
    file : File

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
    codec = _codec(file)
    if codec is None:
        data = file.begin()
        is_all = len(data) == file.info.size
    else:
        data = _decompress(file, codec, PROBED)
        is_all = len(data) < PROBED
    if not is_all:
        end = max(data.rfind(b"\n"), data.rfind(b"\r"))
        # In UTF-16 a line ends with two bytes, of which the newline is the first or the second.
        data = data[: end + 1 + (end + 1) % 2] if _is_wide(data) else data[: end + 1]
    text, guesses = decode(data, file.shown)
    return text, is_all, guesses


def is_text(file: File) -> bool:
    """Whether a file begins as text does."""
    try:
        text, _, _ = begin_text(file)
    except DataError:
        return False
    return bool(text.strip()) and CONTROL.search(text.decode()) is None


def is_compressed(file: File) -> bool:
    """Whether a file begins as compressed ones do."""
    return _codec(file) is not None


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
    if b"\0" in data[:PROBED]:
        raise no_text
    try:
        data.decode()
    except UnicodeDecodeError:
        text = data.decode("latin-1")
        if CONTROL.search(text[:PROBED]) is not None:
            raise no_text from None
        return text.encode(), (LATIN,)
    return data, ()


def _is_wide(data: bytes) -> bool:
    """Whether text is UTF-16: it says so, or every other byte of much of it is zero, and no other."""
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return True
    even, odd = (data[i:PROBED:2].count(0) for i in (0, 1))
    return min(even, odd) == 0 and max(even, odd) > min(len(data), PROBED) / 4


def _codec(file: File) -> str | None:
    codec = next((codec for magic, codec in CODECS.items() if file.magic.startswith(magic)), None)
    # Three letters may begin a text, too.
    return None if codec == "bz2" and file.magic[4:10] not in BZIP_BLOCKS else codec


def _decompress(file: File, codec: str, size: int | None = None) -> bytes:
    """Return all that is compressed, or its first `size` bytes."""
    pieces: list[bytes] = []
    length = 0
    with (
        damage_named(file.shown, f"compressed with {codec}"),
        file.open() as opened,
        pa.CompressedInputStream(opened, codec) as stream,
    ):
        while size is None or length < size:
            piece = stream.read(PIECE if size is None else size - length)
            if not piece:
                break
            pieces.append(piece)
            length += len(piece)
            # A small file may hold far more than the memory does.
            check_memory(3.0 * length, f"reading {file.shown}", INSTEAD)
    return b"".join(pieces)
