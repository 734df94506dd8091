"""A recording as columns: what every file format is turned into before the columns get their roles."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from unconstrain.errors import DataError

Key = str | int  # a column's name, or its position counted from 0
MOST_LISTED = 20

# Squares of larger numbers overflow; no recording holds them but by mistake.
LARGEST = 1e150


def row(index: int) -> str:
    """Where a sample is, in a format that has no lines."""
    return f"row {index} (counted from 0)"


@dataclass(frozen=True)
class Column:
    """One column: a flat Arrow array.

    `name` is "" where the file has no header. An array (N, k) in the file stands for k columns, named
    `array[0]`, `array[1]`, ...; each is then `part_of` that array, whose name selects them all.
    """

    name: str
    values: Any
    part_of: str = ""

    @property
    def component(self) -> int | None:
        """Which number of its array it is, or None for a column by itself."""
        return int(self.name[len(self.part_of) + 1 : -1]) if self.part_of else None


@dataclass(frozen=True)
class Table:
    """The columns of one file in their order; names may repeat, as they do in real recordings.

    `path` is the file as the user wrote it; `place` tells where in it a sample is ("line 14");
    `unusable` says of what cannot stand for columns what it is instead.
    """

    path: str
    columns: Sequence[Column]
    place: Callable[[int], str] = row
    unusable: Mapping[str, str] = field(default_factory=dict)

    def find(self, role: str, key: Key) -> list[int]:
        """The positions of the columns that `key` names; several where it names an array (N, k).

        Raises
        ------
        DataError
            There is no such column, or several carry the name.
        """
        if isinstance(key, str):
            return self._named(role, key)
        if isinstance(key, bool) or not isinstance(key, int | np.integer):
            raise DataError(f"{role} takes column names or positions (integers counted from 0), got {key!r}")
        if not 0 <= key < len(self.columns):
            raise DataError(
                f"{self.path} has no column at position {key} for {role}: "
                f"they are counted from 0 to {len(self.columns) - 1}; {self.listing()}"
            )
        return [int(key)]

    def _named(self, role: str, name: str) -> list[int]:
        positions = [i for i, column in enumerate(self.columns) if column.name == name]
        if len(positions) > 1:
            shown = ", ".join(map(str, positions))
            raise DataError(
                f"{self.path} has {len(positions)} columns called {name!r}, at positions {shown} "
                f"(counted from 0); choose for {role} by position instead, as in {role}=[{positions[0]}]"
            )
        positions = positions or [i for i, column in enumerate(self.columns) if column.part_of == name]
        if positions:
            return positions
        if name in self.unusable:
            raise DataError(f"{self.path}: {name!r} {self.unusable[name]}, so it cannot be used as {role}")
        close = get_close_matches(name, [column.name for column in self.columns if column.name], n=1)
        hint = f" (did you mean {close[0]!r}?)" if close else ""
        raise DataError(f"{self.path} has no column {name!r} for {role}{hint}; {self.listing()}")

    def listing(self) -> str:
        """The columns there are, as half a sentence."""
        if all(not column.name for column in self.columns):
            return f"it has no header but {len(self.columns)} columns, so choose by position, counted from 0"
        shown = [f"{i} {column.name!r}" for i, column in enumerate(self.columns[:MOST_LISTED])]
        more = len(self.columns) - MOST_LISTED
        return f"its columns are {', '.join(shown)}" + (f" and {more} more" if more > 0 else "")

    def called(self, position: int) -> str:
        """How to speak of a column: by its name where that is enough."""
        name = self.columns[position].name
        if not name:
            return f"column {position} (counted from 0)"
        if sum(column.name == name for column in self.columns) > 1:
            return f"column {position} ({name!r}, counted from 0)"
        return f"column {name!r}"

    def matrix(self, role: str, positions: Sequence[int]) -> NDArray[np.float64]:
        """These columns as numbers: an array (N, k) of float64.

        Raises
        ------
        DataError
            Text, an empty cell, NaN or infinity, or columns of different lengths.
        """
        columns = [self.numbers(position) for position in positions]
        for position, column in zip(positions, columns, strict=True):
            if len(column) != len(columns[0]):
                raise DataError(
                    f"{self.path}: {self.called(position)} has {len(column)} values for {role} "
                    f"but {self.called(positions[0])} has {len(columns[0])}; they must be equally long"
                )
        return np.ascontiguousarray(np.column_stack(columns))

    def numbers(self, position: int) -> NDArray[np.float64]:
        """One column as finite float64; see `matrix`."""
        values = self.filled(position)
        kind = values.type
        if pa.types.is_string(kind) or pa.types.is_large_string(kind):
            try:
                values = values.cast(pa.float64())
            except pa.ArrowInvalid as error:
                raise self._text(position, values) from error
        elif not (pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_decimal(kind)):
            raise DataError(
                f"{self.path}: {self.called(position)} holds {kind} values where numbers are needed"
            )
        array = values.cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False)
        bad = np.flatnonzero(~(np.abs(array) <= LARGEST))
        if len(bad):
            raise DataError(
                f"{self.path}: {self.called(position)} holds {array[bad[0]]} at {self.place(int(bad[0]))}"
                f"{_others(len(bad))}; fill it in or take the sample out"
            )
        return array

    def flags(self, position: int) -> NDArray[np.float64]:
        """One column as `numbers`, of which true and false are 1 and 0, in letters too; see `matrix`."""
        values = self.filled(position)
        if pa.types.is_string(values.type) or pa.types.is_large_string(values.type):
            try:
                values = values.cast(pa.bool_())
            except pa.ArrowInvalid:  # numbers, or what the sentence about numbers is for
                return self.numbers(position)
        if pa.types.is_boolean(values.type):
            return values.cast(pa.float64()).to_numpy(zero_copy_only=False)
        return self.numbers(position)

    def filled(self, position: int) -> Any:
        """One column without missing values, as an Arrow array; text is stripped of spaces around it.

        Raises
        ------
        DataError
            An empty cell.
        """
        values = self.columns[position].values
        if isinstance(values, pa.ChunkedArray):
            values = values.combine_chunks()
        if pa.types.is_dictionary(values.type):
            values = values.dictionary_decode()
        missing = values.is_null()
        if pa.types.is_string(values.type) or pa.types.is_large_string(values.type):
            values = pc.utf8_trim_whitespace(values)
            missing = pc.or_(missing, pc.equal(pc.fill_null(values, ""), ""))
        count = pc.sum(missing).as_py() or 0
        if count:
            first = pc.index(missing, True).as_py()
            raise DataError(
                f"{self.path}: {self.called(position)} is empty at {self.place(first)}"
                f"{_others(count)}; fill it in or take the sample out"
            )
        return values

    def labels(self, position: int) -> tuple[NDArray[np.int64], tuple[str, ...]]:
        """One column of any type as codes (N,) and their labels, in order of first appearance.

        Raises
        ------
        DataError
            An empty cell or NaN.
        """
        values = self.filled(position)
        if pa.types.is_floating(values.type):
            self.numbers(position)  # NaN is not an episode
        encoded = values.dictionary_encode()
        codes = encoded.indices.to_numpy().astype(np.int64)
        distinct = encoded.dictionary.to_pylist()
        return codes, tuple(
            str(int(value)) if isinstance(value, float) and value.is_integer() else str(value)
            for value in distinct
        )

    def _text(self, position: int, values: Any) -> DataError:
        for index, value in enumerate(values.to_pylist()):
            try:
                pa.scalar(value).cast(pa.float64())
            except pa.ArrowInvalid:
                return DataError(
                    f"{self.path}: {self.called(position)} holds {value!r} at {self.place(index)} "
                    "where a number is needed; correct it, or choose other columns"
                )
        return DataError(f"{self.path}: {self.called(position)} holds text where numbers are needed")


def _others(count: int) -> str:
    return f" and {count - 1} more" if count > 1 else ""
