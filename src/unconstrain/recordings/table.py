"""A file as columns: what every format is read as before the columns get their roles."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from unconstrain.errors import DataError
from unconstrain.recordings.columns import Key, Keys
from unconstrain.recordings.units import unit_in

Array = NDArray[np.float64]

MOST_LISTED = 20

NUMBER = r"^[+-]?(?:(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[nN][aA][nN]|[iI][nN][fF](?:inity)?)$"

STRAY = 0.1
"""The largest share of text in a column of numbers."""

# Squares of larger numbers overflow; no recording holds them but by mistake.
LARGEST = 1e150


class Field(NamedTuple):
    """A column of a file, or one of the numbers of a column of lists.

    Parameters
    ----------
    column : str
        The column's name, "" where the file has no header.
    nth : int
        Which of the columns of that name, from 0: names repeat in real recordings.
    component : int or None
        Which number of the lists; None for a column by itself.
    width : int
        How many numbers each list holds; 0 for a column by itself.
    called : str
        How a sentence speaks of it: by its name where that is enough.
    kind : str
        "number", "text" or the Arrow type, by the file that was looked at first.
    unit : str
        What the file says its unit is; "" where it says nothing.
    """

    column: str
    nth: int
    component: int | None
    width: int
    called: str
    kind: str
    unit: str = ""

    @property
    def key(self) -> tuple[str, int]:
        """The column it is read from."""
        return self.column, self.nth


@dataclass(frozen=True)
class Column:
    """One column as a user may choose it.

    An array (N, k) in the file stands for k columns, named `array[0]`, `array[1]`, ...; each is then `part_of` that
    array, whose name selects them all.
    """

    name: str
    kind: pa.DataType
    length: int | None
    """Number of rows; None where they are not counted yet."""
    nth: int = 0
    part_of: str = ""
    component: int | None = None
    width: int = 0
    unit: str = ""
    """What the file says its unit is, as `plain_unit` writes it; "" where it says nothing."""


@dataclass(frozen=True)
class Header:
    """The columns of a file in their order; names may repeat, as they do in real recordings.

    Parameters
    ----------
    path : str
        The file as the user wrote it.
    columns : sequence of Column
    lists : mapping of str to (pyarrow.DataType, int or None)
        Type and number of rows of the columns whose rows are lists or matrices.
    unusable : mapping of str to str
        Of what cannot stand for columns, what it is instead.
    """

    path: str
    columns: Sequence[Column]
    lists: Mapping[str, tuple[pa.DataType, int | None]] = field(default_factory=dict)
    unusable: Mapping[str, str] = field(default_factory=dict)

    def find(self, role: str, keys: Keys) -> tuple[Field, ...]:
        """Find the columns that play a role.

        Parameters
        ----------
        role : str
            What they are for, as the user calls it.
        keys : column, or list of columns
            Names or positions.

        Returns
        -------
        tuple of Field
            Several for a key that names an array (N, k).

        Raises
        ------
        DataError
            There is no such column, or several carry the name.
        """
        each = [keys] if isinstance(keys, str | int) or not isinstance(keys, Sequence) else keys
        positions = [position for key in each for position in self._positions(role, key)]
        if not positions:
            raise DataError(f"no {role} columns were given for {self.path}; {self.listing()}")
        return tuple(self._field(position) for position in positions)

    def find_one(self, role: str, key: Key) -> Field:
        """Find the one column that plays a role; see `find`."""
        found = self.find(role, key)
        if len(found) > 1:
            raise DataError(f"{self.path}: {role} takes one column, but {key!r} stands for {len(found)}")
        return found[0]

    def length(self, field: Field) -> int | None:
        """Return the number of rows of a field's column, or None where they are not counted yet."""
        return next(c.length for c in self.columns if (c.part_of or c.name, c.nth) == field.key)

    def listing(self) -> str:
        """List the columns there are, as half a sentence."""
        if all(not column.name for column in self.columns):
            return f"it has no header but {len(self.columns)} columns, so choose by position, counted from 0"
        shown = [f"{i} {column.name!r}" for i, column in enumerate(self.columns[:MOST_LISTED])]
        more = len(self.columns) - MOST_LISTED
        return f"its columns are {', '.join(shown)}" + (f" and {more} more" if more > 0 else "")

    def _positions(self, role: str, key: Key) -> list[int]:
        if isinstance(key, str):
            return self._named(role, key)
        if isinstance(key, bool) or not isinstance(key, int | np.integer):
            raise DataError(f"{role} takes column names or positions (integers counted from 0), got {key!r}")
        called = [i for i, column in enumerate(self.columns) if column.name == str(key)]
        if len(called) == 1:  # years, and the numbers that pandas calls columns by
            return called
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
                f"(counted from 0); choose for {role}= by position instead, such as {positions[0]}"
            )
        positions = positions or [i for i, column in enumerate(self.columns) if column.part_of == name]
        positions = positions or [
            i for i, column in enumerate(self.columns) if column.name.startswith(f"{name}.")
        ]
        if positions:
            return positions
        if name in self.unusable:
            raise DataError(f"{self.path}: {name!r} {self.unusable[name]}, so it cannot be used as {role}")
        close = get_close_matches(name, [column.name for column in self.columns if column.name], n=1)
        hint = f" (did you mean {close[0]!r}?)" if close else ""
        raise DataError(f"{self.path} has no column {name!r} for {role}{hint}; {self.listing()}")

    def _field(self, position: int) -> Field:
        column = self.columns[position]
        if not column.name:
            called = f"column {position} (counted from 0)"
        elif sum(other.name == column.name for other in self.columns) > 1:
            called = f"column {position} ({column.name!r}, counted from 0)"
        else:
            called = f"column {column.name!r}"
        return Field(
            column.part_of or column.name,
            column.nth,
            column.component,
            column.width,
            called,
            describe_kind(column.kind),
            column.unit or unit_in(column.name),
        )


@dataclass(frozen=True)
class Cells:
    """The values of one column, and how to speak of it.

    Parameters
    ----------
    values : pyarrow.Array
    path : str
        The file as the user wrote it.
    called : str
        The column, as in "column 'x'".
    place : function
        Where in the file the i-th value is, such as "line 14".
    """

    values: Any
    path: str
    called: str
    place: Callable[[int], str]

    def numbers(self) -> Array:
        """Return the values as finite numbers (N,).

        Raises
        ------
        DataError
            Text, an empty cell, NaN or infinity.
        """
        values = self.filled()
        kind = values.type
        if is_text(kind):
            try:
                values = values.cast(pa.float64())
            except pa.ArrowInvalid as error:
                raise self._text(values) from error
        elif not (pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_decimal(kind)):
            raise DataError(f"{self.path}: {self.called} holds {kind} values where numbers are needed")
        array = values.cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False)
        bad = np.flatnonzero(~(np.abs(array) <= LARGEST))
        if len(bad):
            raise DataError(
                f"{self.path}: {self.called} holds {array[bad[0]]} at {self.place(int(bad[0]))}"
                f'{_others(len(bad))}; fill it in, or leave such samples out with drop="missing"'
            )
        return array

    def numbers_or_nan(self, *, beside_text: bool = False) -> Array:
        """Return the values as numbers (N,), NaN where they are missing.

        Parameters
        ----------
        beside_text : bool
            Whether text is missing too, in a column of which nine in ten values are numbers.

        Returns
        -------
        ndarray of shape (N,)

        Raises
        ------
        DataError
            Text that is no number, or values of another type.
        """
        values, kind = self.values, self.values.type
        if is_text(kind):
            values = pc.utf8_trim_whitespace(values)
            values = pc.if_else(pc.equal(values, ""), pa.scalar(None, kind), values)
            if beside_text:
                values = pc.if_else(self.stray_text(), pa.scalar(None, kind), values)
            try:
                values = values.cast(pa.float64())
            except pa.ArrowInvalid as error:
                raise self._text(values) from error
        elif not (pa.types.is_floating(kind) or pa.types.is_integer(kind) or pa.types.is_null(kind)):
            raise DataError(
                f"{self.path}: {self.called} holds {kind} values where numbers are needed; choose other columns"
            )
        return values.cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False)

    def stray_text(self) -> Any:
        """Tell which values are text in a column of which nine in ten are numbers; none in another one."""
        values = pc.utf8_trim_whitespace(self.values)
        stray = pc.invert(pc.match_substring_regex(values, NUMBER))
        stray = pc.and_(pc.fill_null(stray, False), pc.fill_null(pc.not_equal(values, ""), False))
        count, there = pc.sum(stray).as_py() or 0, len(values) - values.null_count
        return stray if count <= STRAY * there else pa.array([False] * len(values))

    def flags(self) -> Array:
        """Return flags (N,), 1 or 0; true and false count as these, in letters too.

        Raises
        ------
        DataError
            Anything else.
        """
        values = self.filled()
        if is_text(values.type):
            try:
                values = values.cast(pa.bool_())
            except pa.ArrowInvalid:  # numbers, or what the sentence about numbers is for
                values = None
        if values is not None and pa.types.is_boolean(values.type):
            return values.cast(pa.float64()).to_numpy(zero_copy_only=False)
        flags = self.numbers()
        odd = np.flatnonzero((flags != 0) & (flags != 1))
        if len(odd):
            raise DataError(
                f"{self.path}: {self.called} holds {flags[odd[0]]:g} at {self.place(int(odd[0]))}, but free is 1 "
                "(nothing constrains the motion) or 0"
            )
        return flags

    def labels(self) -> NDArray[Any]:
        """Return the values (N,) of a column that tells episodes apart: integers, or text.

        Raises
        ------
        DataError
            An empty cell or NaN, or values that cannot tell episodes apart.
        """
        own = self._repeated_labels()
        if own is not None:
            return own
        values = self.filled()
        if pa.types.is_nested(values.type):
            raise DataError(
                f"{self.path}: {self.called} holds {values.type} values, which do not tell episodes apart; choose "
                "another column"
            )
        if pa.types.is_floating(values.type):
            self.numbers()  # NaN is not an episode
        elif not (pa.types.is_integer(values.type) or is_text(values.type)):
            values = values.cast(pa.string())
        return values.to_numpy(zero_copy_only=False)

    def _repeated_labels(self) -> NDArray[Any] | None:
        """Return the values of a column of text, each made but once; None for another column, or with empty cells."""
        values, kind = self.values, self.values.type
        if isinstance(values, pa.ChunkedArray) or values.null_count:
            return None
        if is_text(kind):
            values = values.dictionary_encode()
        elif not (pa.types.is_dictionary(kind) and is_text(kind.value_type)):
            return None
        distinct = pc.utf8_trim_whitespace(values.dictionary)
        if distinct.null_count or pc.any(pc.equal(distinct, "")).as_py():
            return None
        return distinct.to_numpy(zero_copy_only=False)[values.indices.to_numpy()]

    def filled(self) -> Any:
        """Return the values as an Arrow array without missing ones; text is stripped of spaces around it.

        Raises
        ------
        DataError
            An empty cell.
        """
        values = self.values
        if isinstance(values, pa.ChunkedArray):
            values = values.combine_chunks()
        if pa.types.is_dictionary(values.type):
            values = values.dictionary_decode()
        missing = values.is_null()
        if is_text(values.type):
            values = pc.utf8_trim_whitespace(values)
            missing = pc.or_(missing, pc.equal(pc.fill_null(values, ""), ""))
        count = pc.sum(missing).as_py() or 0
        if count:
            first = pc.index(missing, True).as_py()
            raise DataError(
                f"{self.path}: {self.called} is empty at {self.place(first)}"
                f'{_others(count)}; fill it in, or leave such samples out with drop="missing"'
            )
        return values

    def component(self, i: int, width: int, role: str, name: str) -> "Cells":
        """Return the i-th number of each of the lists, which must hold `width` numbers.

        Raises
        ------
        DataError
            A list is missing or holds another number of them.
        """
        values = self.values
        lengths = pc.list_value_length(values) if pa.types.is_nested(values.type) else None
        if lengths is None:
            raise DataError(
                f"{self.path}: {name!r} holds {values.type} values where lists of {width} numbers are needed"
            )
        uneven = pc.or_(values.is_null(), pc.fill_null(pc.not_equal(lengths, width), True))
        if pc.any(uneven).as_py():
            at = self.place(pc.index(uneven, True).as_py())
            raise DataError(
                f"{self.path}: {name!r} holds lists that are missing or differ in length, first at {at}, so it cannot "
                f"be used as {role}"
            )
        flat = values.flatten()
        return Cells(
            flat.take(pa.array(range(i, len(flat), width), pa.int64())), self.path, self.called, self.place
        )

    def _text(self, values: Any) -> DataError:
        for index, value in enumerate(values.to_pylist()):
            try:
                pa.scalar(value).cast(pa.float64())
            except pa.ArrowInvalid:
                return DataError(
                    f"{self.path}: {self.called} holds {value!r} at {self.place(index)} "
                    "where a number is needed; correct it, or choose other columns"
                )
        return DataError(f"{self.path}: {self.called} holds text where numbers are needed")


def row(index: int) -> str:
    """Say where a sample is, in a format that has no lines."""
    return f"row {index} (counted from 0)"


def is_text(kind: pa.DataType) -> bool:
    """Whether an Arrow type is text."""
    return pa.types.is_string(kind) or pa.types.is_large_string(kind)


def is_list(kind: pa.DataType) -> bool:
    """Whether an Arrow type is a list of values."""
    return pa.types.is_list(kind) or pa.types.is_large_list(kind) or pa.types.is_fixed_size_list(kind)


def describe_kind(kind: pa.DataType) -> str:
    """Say of which kind the values of an Arrow type are: those of one kind may be read together."""
    if pa.types.is_dictionary(kind) or is_list(kind):
        return describe_kind(kind.value_type)
    if pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_decimal(kind):
        return "number"
    return "text" if is_text(kind) else str(kind)


def _others(count: int) -> str:
    return f" and {count - 1} more" if count > 1 else ""
