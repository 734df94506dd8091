"""NumPy archives: the names of the arrays are the columns, and an array (N, k) stands for its k columns."""

import zipfile
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from unconstrain.errors import DataError
from unconstrain.memory import check_memory
from unconstrain.recordings.files import File
from unconstrain.recordings.formats.base import ColumnKey, Declared, damage_named
from unconstrain.recordings.table import Column, Header, row

Shape = tuple[int, ...]


class Npz:
    """An archive of arrays, of which only those asked for are read.

    Parameters
    ----------
    file : File
    """

    suffixes: ClassVar[tuple[str, ...]] = (".npz",)
    at_once: ClassVar[bool] = True

    def __init__(self, file: File) -> None:
        self.file = file

    @classmethod
    def matches(cls, file: File) -> bool:
        """Whether the content is of this format, as its first bytes tell."""
        if file.magic[:4] not in (b"PK\x03\x04", b"PK\x05\x06"):
            return False
        try:
            with file.open() as opened, zipfile.ZipFile(opened) as archive:
                return any(name.endswith(".npy") for name in archive.namelist())
        except Exception:  # a damaged archive; which one its suffix tells
            return False

    def columns(self) -> Header:
        """Return the arrays (N,) and (N, k) as columns."""
        return self._header

    def declared(self) -> Declared | None:
        """Return nothing: an archive says nothing of its arrays but their names."""
        return None

    @property
    def row_groups(self) -> tuple[int, ...]:
        """The number of rows of the longest array."""
        return (max((shape[0] for _, shape in self._arrays.values() if shape), default=0),)

    def read(
        self, columns: Sequence[ColumnKey], start: int = 0, stop: int | None = None
    ) -> Iterator[tuple[int, pa.RecordBatch]]:
        """Read rows of these columns as one piece, with its first row."""
        arrays = self._load([name for name, _ in columns])
        with damage_named(self.file.shown, "an NPZ archive"):
            values = [to_arrow(array[start:stop]) for array in arrays]
            rows = pa.RecordBatch.from_arrays(values, names=[name for name, _ in columns])
        yield start, rows

    def place(self, index: int) -> str:
        """Say where in the file a row is."""
        return row(index)

    def in_one_thread(self) -> "Npz":
        """Return the same file, decoded by one thread."""
        return self

    def identity(self) -> str:
        """Say what tells the file from others."""
        return repr(self.file.identity())

    @cached_property
    def _arrays(self) -> dict[str, tuple[np.dtype, Shape]]:
        """Type and shape of each array."""
        if self.file.magic[:4] not in (b"PK\x03\x04", b"PK\x05\x06"):
            raise DataError(
                f"{self.file.shown} is not an NPZ archive: write it with numpy.savez, or correct its suffix"
            )
        found: dict[str, tuple[np.dtype, Shape]] = {}
        with (
            damage_named(self.file.shown, "an NPZ archive"),
            self.file.open() as opened,
            zipfile.ZipFile(opened) as archive,
        ):
            for member in archive.infolist():
                if member.filename.endswith(".npy"):
                    with archive.open(member) as content:
                        kind, shape = _read_shape(content)
                        size = member.file_size - content.tell()
                    if not kind.hasobject and size != kind.itemsize * int(np.prod(shape, dtype=object)):
                        raise DataError(
                            f"{self.file.shown} is damaged: {member.filename} does not hold what it promises; "
                            "write it again"
                        )
                    found[member.filename.removesuffix(".npy")] = kind, shape
        return found

    @cached_property
    def _header(self) -> Header:
        return header_of(self._arrays, self.file.shown)

    def _load(self, names: Sequence[str]) -> list[NDArray[Any]]:
        about = [self._arrays[name] for name in names]
        needed = sum(kind.itemsize * int(np.prod(shape, dtype=object)) for kind, shape in about)
        check_memory(needed, f"reading {self.file.shown}", "leave arrays out")
        with (
            damage_named(self.file.shown, "an NPZ archive"),
            self.file.open() as opened,
            zipfile.ZipFile(opened) as archive,
        ):
            return [_load_member(archive, f"{name}.npy") for name in names]


def header_of(arrays: Mapping[str, tuple[np.dtype, Shape]], shown: str) -> Header:
    """Describe arrays (N,) and (N, k) as columns.

    Parameters
    ----------
    arrays : mapping of str to (dtype, shape)
    shown : str
        Where they are from, as the user calls it.

    Returns
    -------
    Header

    Raises
    ------
    DataError
        There are none.
    """
    columns: list[Column] = []
    lists: dict[str, tuple[pa.DataType, int | None]] = {}
    unusable: dict[str, str] = {}
    for name, (kind, shape) in arrays.items():
        if kind.hasobject:
            unusable[name] = "holds pickled Python objects"
            continue
        try:
            values = pa.string() if kind.kind in "SU" else pa.from_numpy_dtype(kind.newbyteorder("="))
        except (pa.ArrowException, NotImplementedError, TypeError):
            unusable[name] = f"holds values of type {kind}"
            continue
        if len(shape) == 1:
            columns.append(Column(name, values, shape[0]))
            continue
        if len(shape) in (2, 3):
            lists[name] = pa.list_(values, int(np.prod(shape[1:]))), shape[0]
        if len(shape) != 2 or not shape[1]:
            unusable[name] = f"has shape {shape} where (N,) or (N, k) is needed"
            continue
        columns += [Column(f"{name}[{i}]", values, shape[0], 0, name, i, shape[1]) for i in range(shape[1])]
    if not columns and not unusable:
        raise DataError(f"{shown} is empty: there are no arrays in it")
    return Header(shown, columns, lists, unusable)


def to_arrow(array: NDArray[Any]) -> pa.Array:
    """Give an array (N, ...) as an Arrow array, with a list a row where it has several dimensions."""
    native = np.ascontiguousarray(array, dtype=array.dtype.newbyteorder("="))
    if native.dtype.kind == "S":
        native = np.char.decode(native, "utf-8")
    if native.ndim == 1:
        return pa.array(native)
    width = int(np.prod(native.shape[1:]))
    return pa.FixedSizeListArray.from_arrays(pa.array(native.reshape(-1)), width)


def _read_shape(content: Any) -> tuple[np.dtype, Shape]:
    version = np.lib.format.read_magic(content)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, kind = read(content)
    return kind, shape


def _load_member(archive: zipfile.ZipFile, name: str) -> NDArray[Any]:
    with archive.open(name) as content:
        return np.lib.format.read_array(content, allow_pickle=False)
