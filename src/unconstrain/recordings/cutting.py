"""Where blocks of rows end: after so many rows, or where an episode does."""

from collections.abc import Callable, Generator, Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.errors import DataError
from unconstrain.recordings.blocks import Block, Loaded
from unconstrain.recordings.pieces import Piece

Load = Callable[[Sequence[Piece], int, Piece | None], Loaded]
"""Makes samples of pieces, given the number of their first row, and the last row before it, if there is one."""

Labels = Callable[[Piece, int], NDArray[Any]]
"""Returns what must not be torn apart, (N,), of a piece that begins at a row."""


def cut_by_rows(
    pieces: Iterator[Piece], start: int, batch_rows: int, load: Load
) -> Generator[Block, None, None]:
    """Cut blocks of at most `batch_rows` rows, each of as many pieces as go into it.

    Parameters
    ----------
    pieces : iterator of Piece
    start : int
        The number of the first row.
    batch_rows : int
    load : function

    Yields
    ------
    Block
    """
    waiting: list[Piece] = []
    count = 0
    before: Piece | None = None
    for piece in pieces:
        if waiting and count + len(piece.rows) > batch_rows:
            yield Block(start, start + count, partial(load, waiting, start, before))
            before = _last_row(waiting)
            waiting, count, start = [], 0, start + count
        while len(piece.rows) > batch_rows:
            stop = start + batch_rows
            block = [piece.slice(0, batch_rows)]
            yield Block(start, stop, partial(load, block, start, before))
            before = _last_row(block)
            piece, start = piece.slice(batch_rows, len(piece.rows) - batch_rows), stop
        if len(piece.rows):
            waiting.append(piece)
            count += len(piece.rows)
    if waiting:
        yield Block(start, start + count, partial(load, waiting, start, before))


def cut_by_episodes(
    pieces: Iterator[Piece], start: int, batch_rows: int, why: str | None, labels: Labels, load: Load
) -> Generator[Block, None, None]:
    """Cut blocks of whole episodes, of `batch_rows` rows or more.

    Parameters
    ----------
    pieces : iterator of Piece
    start : int
        The number of the first row.
    batch_rows : int
    why : str or None
        What is done to episodes, so that they have to be whole. Without a reason an episode that comes back after
        others is taken for another.
    labels : function
    load : function

    Yields
    ------
    Block

    Raises
    ------
    DataError
        An episode that has to be whole goes on after the block in which it began.
    """
    waiting: list[Piece] = []
    count = 0  # rows waiting
    current: Any = None
    here: set[Any] = set()  # episodes that wait
    gone: set[Any] = set()  # episodes of earlier blocks
    before: Piece | None = None
    for piece in pieces:
        values = labels(piece, start + count)
        changes = (np.flatnonzero(values[1:] != values[:-1]) + 1).tolist()
        used = 0  # of the piece
        for at in changes if values[0] == current else [0, *changes]:
            complete = count + at - used  # rows of episodes that have ended
            if complete >= batch_rows and (why is None or values[at] not in here):
                block = [*waiting, piece.slice(used, at - used)] if at > used else waiting
                yield Block(start, start + complete, partial(load, block, start, before))
                before = _last_row(block)
                waiting, count, start, used = [], 0, start + complete, at
                gone |= here
                here = set()
            current = values[at]
            if why is None:
                continue
            if current in gone:
                place = piece.format.place(piece.first + at)
                why = "time the samples of" if why == "time" else why
                raise DataError(
                    f"{piece.format.file.shown}: episode {current} goes on at {place} after others were read; to "
                    f"{why} a stream, sort it by episode"
                )
            here.add(current)
        waiting.append(piece.slice(used, len(piece.rows) - used))
        count += len(piece.rows) - used
    if waiting:
        yield Block(start, start + count, partial(load, waiting, start, before))


def _last_row(pieces: Sequence[Piece]) -> Piece | None:
    last = next((piece for piece in reversed(pieces) if len(piece.rows)), None)
    return None if last is None else last.slice(len(last.rows) - 1, 1)
