"""NumPy arrays as columns of Arrow."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from unconstrain.errors import DataError
from unconstrain.recordings.table import Column, Header

Shape = tuple[int, ...]


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
