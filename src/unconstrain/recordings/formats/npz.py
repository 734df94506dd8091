"""NumPy archives: the names of the arrays are the columns, and an array (N, k) stands for its k columns."""

import zipfile
import zlib
from pathlib import Path

import numpy as np
import pyarrow as pa

from unconstrain.errors import DataError
from unconstrain.recordings.table import Column, Table


def arrays(path: Path, shown: str) -> tuple[dict[str, np.ndarray], list[str]]:
    """The arrays of an archive, and the names of those that hold pickled objects, which are never loaded.

    Raises
    ------
    DataError
        The file is damaged or not an archive of arrays.
    """
    found: dict[str, np.ndarray] = {}
    pickled = []
    try:
        with path.open("rb") as file:
            if file.read(4) not in (b"PK\x03\x04", b"PK\x05\x06"):
                raise DataError(
                    f"{shown} is not an NPZ archive: write it with numpy.savez, or correct its suffix"
                )
        with np.load(path, allow_pickle=False) as archive:
            for name in archive.files:
                try:
                    found[name] = archive[name]
                except ValueError as error:
                    if "allow_pickle" not in str(error):
                        raise
                    pickled.append(name)
    except (zipfile.BadZipFile, zlib.error, EOFError, ValueError, KeyError, NotImplementedError) as error:
        if isinstance(error, DataError):
            raise
        raise DataError(f"{shown} is damaged and cannot be read as NPZ; write it again") from error
    return found, pickled


def read(path: Path, shown: str) -> Table:
    """The arrays (N,) and (N, k) as columns.

    Raises
    ------
    DataError
        The file is damaged or not an archive of arrays, or has none.
    """
    found, pickled = arrays(path, shown)
    columns: list[Column] = []
    unusable = dict.fromkeys(pickled, "holds pickled Python objects")
    for name, array in found.items():
        if array.ndim not in (1, 2):
            unusable[name] = f"has shape {array.shape} where (N,) or (N, k) is needed"
            continue
        native = array.astype(array.dtype.newbyteorder("="), copy=False)
        try:
            if array.ndim == 1:
                columns.append(Column(name, _arrow(native)))
            else:
                columns += [
                    Column(f"{name}[{i}]", _arrow(column), part_of=name) for i, column in enumerate(native.T)
                ]
        except (pa.ArrowInvalid, pa.ArrowNotImplementedError, UnicodeDecodeError):
            unusable[name] = f"holds values of type {array.dtype}"
    if not columns and not unusable:
        raise DataError(f"{shown} is empty: there are no arrays in it")
    return Table(shown, columns, unusable=unusable)


def _arrow(array: np.ndarray) -> pa.Array:
    if array.dtype.kind == "S":
        array = np.char.decode(array, "utf-8")
    return pa.array(np.ascontiguousarray(array))
