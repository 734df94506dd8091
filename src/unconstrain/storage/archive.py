"""The file itself: a zip of `unconstrain.json` and one `.npy` for each array, none of them compressed.

`unconstrain.json` comes first and holds `{"kind", "layout", "release", "tree"}`. Since nothing is compressed, whatever
is read takes as much memory as it takes in the file, and a small file cannot unpack to a large one. Sizes, names and
headers are checked before anything is allocated. `numpy.load` opens the file too.
"""

import json
import math
import os
import re
import stat
import struct
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from enum import StrEnum
from io import BufferedIOBase
from typing import IO, TYPE_CHECKING, Any, cast

from unconstrain import atomic
from unconstrain.errors import ArchiveError, DataError, UnconstrainError
from unconstrain.memory import check_memory
from unconstrain.version import __version__

if TYPE_CHECKING:
    import numpy as np

LAYOUT = 1
NOTE = "unconstrain.json"

LARGEST_NOTE = 8 * 2**20
"""Bytes of `unconstrain.json`, at most: as Python's objects JSON takes up to thirty times its size."""
LARGEST_DIRECTORY = 2 * 2**20
"""Bytes of the zip's own table of contents, at most; that is room for some ten thousand arrays."""
CHUNK = 2**23

_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,199}")
# Only what `numpy.save` writes of plain numbers and text: no objects, no structures, nothing to evaluate.
_DTYPE = re.compile(rb"[<>|](?:b1|[iu][1248]|f[248]|[US]\d{1,9})")
_HEADER = re.compile(
    rb"\{'descr': '(" + _DTYPE.pattern + rb")', 'fortran_order': (True|False), "
    rb"'shape': \((|\d{1,19},|\d{1,19}(?:, \d{1,19}){1,31})\), \} *\n"
)

FilePath = str | os.PathLike[str]


class Kind(StrEnum):
    """What a file can hold."""

    POLICY = "policy"
    COMPILED_POLICY = "compiled policy"
    CONSTRAINT = "constraint"
    MOMENTS = "moments"
    DEMONSTRATIONS = "demonstrations"
    CHECKPOINT = "checkpoint"

    @property
    def described(self) -> str:
        """The kind with its article."""
        return str(self) if self in (Kind.MOMENTS, Kind.DEMONSTRATIONS) else f"a {self}"

    @property
    def use(self) -> str:
        """What to do with a file of this kind."""
        return {
            Kind.POLICY: "load it with load_policy",
            Kind.COMPILED_POLICY: "load it with load_compiled",
            Kind.CONSTRAINT: "load it with load_constraint",
            Kind.MOMENTS: "load them with moments.load",
            Kind.DEMONSTRATIONS: "read them as a recording",
            Kind.CHECKPOINT: "it belongs to a fit that was interrupted, which goes on from it",
        }[self]

    @property
    def remedy(self) -> str:
        """What to do about a damaged file of this kind."""
        if self is Kind.CHECKPOINT:
            return "delete it to start anew"
        return f"save the {self} again"


def damaged(path: FilePath, kind: Kind, reason: str) -> ArchiveError:
    """Build the error that says a file is damaged.

    Parameters
    ----------
    path : path
        The file.
    kind : Kind
        What the file should hold.
    reason : str
        What is wrong with it, as a short phrase.

    Returns
    -------
    ArchiveError
    """
    return ArchiveError(f"{os.fspath(path)} is damaged ({reason:.200}): {kind.remedy}")


def write(path: FilePath, kind: Kind, tree: Any, arrays: Mapping[str, "np.ndarray"]) -> None:
    """Write a file, whole or not at all. The same contents give the same bytes.

    Parameters
    ----------
    path : path
        An existing file is replaced.
    kind : Kind
        What the file holds.
    tree : JSON value
        None, bool, int, float, str, and lists and dictionaries of them.
    arrays : mapping of str to ndarray
        Numbers, booleans and text. Names consist of letters, digits, ``_``, ``-`` and ``.``.

    Raises
    ------
    UnconstrainError
        The place cannot be written to, or the tree is larger than `LARGEST_NOTE`.
    """
    import numpy as np

    about = {
        "kind": str(kind), "layout": LAYOUT, "release": __version__, "arrays": list(arrays), "tree": tree,
    }  # fmt: skip
    note = json.dumps(about, allow_nan=False).encode()
    if len(note) > LARGEST_NOTE:
        raise UnconstrainError(
            f"cannot write {path}: besides its arrays the {kind} takes {len(note) / 2**20:.0f} MB of text, and "
            f"{LARGEST_NOTE / 2**20:.0f} MB are the most a file may have"
        )
    with atomic.replacing(path) as temporary, zipfile.ZipFile(temporary, "w") as archive:
        archive.writestr(zipfile.ZipInfo(NOTE), note)
        for name, array in arrays.items():
            if not (_NAME.fullmatch(name) and is_storable(array.dtype)):
                raise ValueError(
                    f"{name!r} is no name for an array, or its type {array.dtype} cannot be stored"
                )
            large = array.nbytes > 2**30
            with archive.open(zipfile.ZipInfo(f"{name}.npy"), "w", force_zip64=large) as file:
                np.lib.format.write_array(file, np.asanyarray(array), allow_pickle=False)


def is_storable(dtype: "np.dtype[Any]") -> bool:
    """Whether arrays of a type can be written: numbers of at most 8 bytes, booleans and text.

    Parameters
    ----------
    dtype : dtype

    Returns
    -------
    bool
    """
    return dtype.names is None and _DTYPE.fullmatch(dtype.str.encode()) is not None


def read(path: FilePath, kind: Kind) -> tuple[Any, dict[str, "np.ndarray"]]:
    """Read a file of a certain kind.

    Parameters
    ----------
    path : path
        The file.
    kind : Kind
        What the file has to hold.

    Returns
    -------
    tree : JSON value
    arrays : dict of str to ndarray
        Writable, in the machine's byte order.

    Raises
    ------
    ArchiveError
        The file is missing, foreign, damaged, of another kind, or was written by a newer release.
    DataError
        It does not fit into memory.
    """
    with _opened(path, kind) as file, _archive(file, path, kind) as archive:
        members = _members(archive, file)
        about = _about(archive, members, path)
        found = Kind(about["kind"])
        if found is not kind:
            raise ArchiveError(
                f"{os.fspath(path)} holds {found.described}, not {kind.described}: {found.use}"
            )
        listed = {NOTE, *(f"{name}.npy" for name in about["arrays"])}
        if listed != set(members):
            raise _Damage("it does not hold the arrays that it lists")
        size = sum(member.file_size for member in members.values())
        check_memory(size, f"reading {os.fspath(path)}", "read it on a machine that has more")
        arrays = {
            name.removesuffix(".npy"): _array(archive, member)
            for name, member in members.items()
            if name != NOTE
        }
        return about["tree"], arrays


def kind_of(path: FilePath) -> Kind | None:
    """Tell what a file holds by its content, cheaply.

    Parameters
    ----------
    path : path
        The file.

    Returns
    -------
    Kind or None
        None for anything that unconstrain has not written, and where there is no file.

    Raises
    ------
    ArchiveError
        The file is one of unconstrain's, and is damaged or was written by a newer release.
    """
    path = atomic.as_path(path)
    if not path.is_file():
        return None
    with path.open("rb") as file:
        if not _is_ours(file):
            return None
        with _archive(file, path, None) as archive:
            return Kind(_about(archive, _members(archive, file), path)["kind"])


@contextmanager
def _opened(path: FilePath, kind: Kind) -> Iterator[IO[bytes]]:
    path, shown = atomic.as_path(path), os.fspath(path)
    try:
        mode = path.stat().st_mode  # before opening: opening a pipe would wait for someone to write
        if not stat.S_ISREG(mode):
            what = "a folder" if stat.S_ISDIR(mode) else "not a file"
            raise ArchiveError(f"{shown} is {what}, so it holds no {kind}: check the path")
        file = path.open("rb")
    except (FileNotFoundError, NotADirectoryError):
        raise ArchiveError(f"{shown}: there is no such {kind} file") from None
    except (OSError, ValueError) as error:  # ValueError: a null byte in the path
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise ArchiveError(f"{shown} cannot be read: {reason.lower()}") from None
    with file:
        if not _is_ours(file):
            raise ArchiveError(f"{shown} holds no {kind} saved by unconstrain")
        yield file


def _is_ours(file: IO[bytes]) -> bool:
    """Whether a file begins as `write` makes it begin: with the note's header and name."""
    head = file.read(30 + len(NOTE))
    return head[:4] == b"PK\x03\x04" and head[30:] == NOTE.encode()


@contextmanager
def _archive(file: IO[bytes], path: FilePath, kind: Kind | None) -> Iterator[zipfile.ZipFile]:
    """Open the zip in a file that begins as ours; whatever else is wrong with it is damage."""
    try:
        _check_directory(file)
        with zipfile.ZipFile(file) as archive:
            yield archive
    except DataError:
        raise
    # Bytes that only begin as ours can make the standard library's readers raise nearly anything.
    except Exception as error:
        reason = str(error) if isinstance(error, _Damage) else f"{type(error).__name__}: {error}"
        if kind is None:
            raise ArchiveError(f"{os.fspath(path)} is damaged ({reason}): write it again") from None
        raise damaged(path, kind, " ".join(reason.split())) from None


class _Damage(Exception):
    """What is wrong with a file, as a short phrase."""


def _check_directory(file: IO[bytes]) -> None:
    """Check how long the zip's table of contents says it is, before `zipfile` makes objects of it."""
    tail = 22 + 20 + 56  # the last record, and before it the two that large files have
    size = file.seek(0, os.SEEK_END)
    file.seek(max(size - tail, 0))
    end = file.read()
    if end[-22:-18] != b"PK\x05\x06":
        raise _Damage("its end is missing")
    length = struct.unpack("<L", end[-10:-6])[0]
    if end[-42:-38] == b"PK\x06\x07" and end[:4] == b"PK\x06\x06":
        length = struct.unpack("<Q", end[40:48])[0]
    if length > LARGEST_DIRECTORY:
        raise _Damage("its table of contents is too long")
    file.seek(0)


def _members(archive: zipfile.ZipFile, file: IO[bytes]) -> dict[str, zipfile.ZipInfo]:
    size = os.fstat(file.fileno()).st_size
    members: dict[str, zipfile.ZipInfo] = {}
    for info in archive.infolist():
        name = info.filename
        if name in members:
            raise _Damage(f"it holds {name} twice")
        if name != NOTE and not (name.endswith(".npy") and _NAME.fullmatch(name.removesuffix(".npy"))):
            raise _Damage(f"it holds a part called {name!r:.60}")
        if info.compress_type != zipfile.ZIP_STORED or info.compress_size != info.file_size:
            raise _Damage(f"its part {name} is compressed")
        members[name] = info
    if sum(info.file_size for info in members.values()) > size:
        raise _Damage("its parts are longer than the file")
    if NOTE not in members or members[NOTE].file_size > LARGEST_NOTE:
        raise _Damage(f"its {NOTE} is missing or too long")
    return members


def _about(
    archive: zipfile.ZipFile, members: Mapping[str, zipfile.ZipInfo], path: FilePath
) -> dict[str, Any]:
    about = json.loads(archive.read(members[NOTE]), parse_constant=_refuse_constant)
    if not isinstance(about, dict) or type(about.get("layout")) is not int or "tree" not in about:
        raise _Damage(f"its {NOTE} does not say what it holds")
    if about["layout"] > LAYOUT:
        raise ArchiveError(
            f"{os.fspath(path)} was written by unconstrain {about.get('release')!s:.40}, in a newer layout than this "
            f"release ({__version__}) reads: upgrade unconstrain"
        )
    names = about.get("arrays")
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise _Damage(f"its {NOTE} does not list its arrays")
    if about.get("kind") not in list(Kind):
        raise _Damage(f"it is of no known kind, {about.get('kind')!r:.40}")
    return about


def _refuse_constant(text: str) -> None:
    raise _Damage(f"{text} is not JSON")


def _array(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> "np.ndarray":
    import numpy as np

    with archive.open(member) as opened:
        file = cast(BufferedIOBase, opened)
        start = file.read(10)
        if start[:8] != b"\x93NUMPY\x01\x00":
            raise _Damage(f"{member.filename} is not an array")
        (length,) = struct.unpack("<H", start[8:])
        found = _HEADER.fullmatch(file.read(length))
        if found is None:
            raise _Damage(f"{member.filename} is not an array of numbers or text")
        dtype = np.dtype(found[1].decode())
        shape = tuple(int(n) for n in found[3].decode().split(",") if n.strip())
        if math.prod(shape) * dtype.itemsize != member.file_size - 10 - length:
            raise _Damage(f"{member.filename} is not as long as it says")
        array = np.empty(shape, dtype, order="F" if found[2] == b"True" else "C")
        if array.nbytes:
            room = memoryview(array.reshape(-1, order="A").view(np.uint8))
            for first in range(0, len(room), CHUNK):
                part = room[first : first + CHUNK]
                if file.readinto(part) != len(part):
                    raise _Damage(f"{member.filename} is cut off")
        if dtype.kind == "U" and array.nbytes:
            _check_text(array, member.filename)
    return array.astype(dtype.newbyteorder("="), copy=False)


def _check_text(array: "np.ndarray", name: str) -> None:
    """Refuse what is no character: it would break whoever prints it."""
    import numpy as np

    codes = np.ascontiguousarray(array).reshape(-1).view(array.dtype.byteorder.replace("|", "=") + "u4")
    if codes.size and (codes.max() > 0x10FFFF or ((codes >= 0xD800) & (codes <= 0xDFFF)).any()):
        raise _Damage(f"{name} holds what is no text")
