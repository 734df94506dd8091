"""Columns that a text does not hold as they are, and what they are made of."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from unconstrain.recordings.table import Cells

BILLION = 1_000_000_000


@dataclass(frozen=True)
class FrameTime:
    """Time (s) of rows that are numbered, zero at the first frame there could be.

    Parameters
    ----------
    frame : int
        Which cell holds the number of the frame, from 1.
    sub : int or None
        Which cell holds the number within the frame, from 0.
    rate : float
        Frames a second (Hz) where there is no `sub`, else rows a second.
    """

    frame: int
    sub: int | None
    rate: float
    kind: ClassVar[pa.DataType] = pa.float64()

    @property
    def needs(self) -> tuple[int, ...]:
        """The cells of a line that it is made of."""
        return (self.frame,) if self.sub is None else (self.frame, self.sub)

    def make(self, columns: Sequence[Cells], n_rows: int, begins: Sequence[int]) -> pa.Array:
        """Return the column, (N,)."""
        numbers = columns[0].numbers() - 1
        if self.sub is not None:
            sub = columns[1].numbers()
            numbers = numbers * (np.max(sub) + 1) + sub
        return pa.array(numbers / self.rate)


@dataclass(frozen=True)
class RowTime:
    """Time (s) of rows that follow each other at a known rate, from 0.

    Parameters
    ----------
    rate : float
        Rows a second (Hz).
    """

    rate: float
    kind: ClassVar[pa.DataType] = pa.float64()
    needs: ClassVar[tuple[int, ...]] = ()

    def make(self, columns: Sequence[Cells], n_rows: int, begins: Sequence[int]) -> pa.Array:
        """Return the column, (N,)."""
        first = np.array([0, *begins])[_count_begins(n_rows, begins)]
        return pa.array((np.arange(n_rows) - first) / self.rate)


@dataclass(frozen=True)
class JoinedTime:
    """Time of which the seconds stand in one cell, and what is left of a second in another.

    Parameters
    ----------
    seconds, rest : int
        Which cells.
    ticks : int
        How many of `rest` make a second.
    """

    seconds: int
    rest: int
    ticks: int = BILLION
    kind: ClassVar[pa.DataType] = pa.duration("ns")

    @property
    def needs(self) -> tuple[int, ...]:
        """The cells of a line that it is made of."""
        return self.seconds, self.rest

    def make(self, columns: Sequence[Cells], n_rows: int, begins: Sequence[int]) -> pa.Array:
        """Return the column, (N,)."""
        seconds, rest = (cells.numbers().astype(np.int64) for cells in columns)
        return pa.array(seconds * BILLION + rest * (BILLION // self.ticks), pa.int64()).cast(
            pa.duration("ns")
        )


@dataclass(frozen=True)
class Part:
    """The number of the part that a row belongs to, from 1, where the header comes again."""

    kind: ClassVar[pa.DataType] = pa.int64()
    needs: ClassVar[tuple[int, ...]] = ()

    def make(self, columns: Sequence[Cells], n_rows: int, begins: Sequence[int]) -> pa.Array:
        """Return the column, (N,)."""
        return pa.array(_count_begins(n_rows, begins) + 1)


Made = FrameTime | RowTime | JoinedTime | Part


def _count_begins(n_rows: int, begins: Sequence[int]) -> NDArray[np.int64]:
    """Return for each row how many parts began before its own."""
    marks = np.zeros(n_rows, np.int64)
    marks[[begin for begin in begins if 0 < begin < n_rows]] = 1
    return np.cumsum(marks)


def cells_of(
    made: Made, read: dict[int, Any], names: dict[int, str], shown: str, place: Callable
) -> list[Cells]:
    """Return the cells that a column is made of, as it asks for them.

    Parameters
    ----------
    made : Made
    read : dict of int to pyarrow.Array
        Columns by cell.
    names : dict of int to str
        What each is called.
    shown : str
        The file, as the user calls it.
    place : function
        Where in the file the i-th row is.

    Returns
    -------
    list of Cells
    """
    return [Cells(read[cell], shown, f"column {names.get(cell) or cell!r}", place) for cell in made.needs]
