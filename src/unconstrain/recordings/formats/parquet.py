"""Parquet files: flat columns, and lists of one length, as LeRobot's `observation.state`."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from unconstrain.errors import DataError
from unconstrain.recordings.table import Column, Table, row


def whole(path: Path, shown: str) -> pa.Table:
    """The file as an Arrow table.

    Raises
    ------
    DataError
        The file is damaged or not Parquet.
    """
    try:
        with pq.ParquetFile(path, page_checksum_verification=True) as file:
            table = file.read()
        table.schema.names  # noqa: B018 - damaged names are found only when they are looked at
        return table
    except (pa.ArrowException, OSError, UnicodeDecodeError) as error:
        if isinstance(error, PermissionError):
            raise
        raise DataError(f"{shown} is damaged or not a Parquet file; write it again") from error


def read(path: Path, shown: str) -> Table:
    """Flat columns as they are; a column of lists, all of length k, as its k columns.

    Raises
    ------
    DataError
        The file is damaged, not Parquet, or has no rows.
    """
    return columns_of(whole(path, shown), shown)


def columns_of(table: pa.Table, shown: str, place: Callable[[int], str] = row) -> Table:
    """An Arrow table's columns; `place` says where in the file `shown` a row is. Raises as `read` does."""
    if not table.num_rows:
        raise DataError(f"{shown} has no samples")
    columns: list[Column] = []
    unusable: dict[str, str] = {}
    for name, values in zip(table.column_names, table.columns, strict=True):
        if not _is_list(values.type):
            if pa.types.is_nested(values.type):
                unusable[name] = f"holds {values.type} values"
            else:
                columns.append(Column(name, values))
            continue
        lengths = pc.list_value_length(values)
        uneven = pc.or_(values.is_null(), pc.fill_null(pc.not_equal(lengths, lengths[0]), True))
        if not lengths[0].is_valid or pc.any(uneven).as_py():
            at = place(pc.index(uneven, True).as_py())
            unusable[name] = f"holds lists that are missing or differ in length, first at {at}"
        elif pa.types.is_nested(values.type.value_type):
            unusable[name] = f"holds {values.type} values"
        else:
            k, flat = lengths[0].as_py(), pc.list_flatten(values.combine_chunks())
            columns += [Column(f"{name}[{i}]", _every(flat, k, i), part_of=name) for i in range(k)]
    return Table(shown, columns, place, unusable)


def _is_list(kind: Any) -> bool:
    return pa.types.is_list(kind) or pa.types.is_large_list(kind) or pa.types.is_fixed_size_list(kind)


def _every(flat: Any, k: int, i: int) -> Any:
    return flat.take(pa.array(range(i, len(flat), k), pa.int64()))
