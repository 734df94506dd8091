"""Sums over samples, in blocks that stay in the processor's cache and are shared out over threads."""

import itertools
import math
import threading
from collections.abc import Callable, Sequence

import numpy as np

from unconstrain.memory import check_memory
from unconstrain.parallel import cut_blocks, map_shares
from unconstrain.waiting import stage

SAMPLES_IN_PIECE = 384
"""Block lengths are multiples of this; narrow products are taken in pieces of it (see `parametric`)."""

Totals = list[np.ndarray]

LARGE = 2**28
"""Bytes of totals from which on it is asked whether there is memory for them."""

WORK = 4
"""How many times the size of its totals a fit takes: H is assembled from them, and decomposed."""

_spaces = threading.local()


def sum_over_blocks(
    n_samples: int, rows: int, shapes: Sequence[tuple[int, ...]], add: Callable[[slice, Totals], None]
) -> Totals:
    """Add up all blocks of samples.

    Parameters
    ----------
    n_samples : int
        N.
    rows : int
        Samples in a block.
    shapes : sequence of shapes
        Of the totals.
    add : callable
        Adds the block, a slice of samples, to the totals in place.

    Returns
    -------
    list of ndarray
        The totals.

    Raises
    ------
    DataError
        The totals, and what is computed from them, do not fit into memory.
    """
    n_bytes = 8.0 * WORK * sum(math.prod(shape) for shape in shapes)
    if n_bytes > LARGE:
        check_memory(n_bytes, "a model with so many parameters", "choose fewer centres, knots or features")

    blocks = cut_blocks(n_samples, rows)
    counter = itertools.count(1)
    with stage("adding up samples", unit="blocks") as report:

        def share(of_blocks: Sequence[slice]) -> Totals:
            totals = [np.zeros(shape) for shape in shapes]
            for block in of_blocks:
                add(block, totals)
                report(next(counter), len(blocks))
            return totals

        first, *others = map_shares(share, blocks)
    return [np.asarray(sum(parts[1:], start=parts[0])) for parts in zip(first, *others, strict=True)]


def rows_in_block(numbers: int, width: int) -> int:
    """Choose how many samples a block holds: few enough for the cache, enough to be worth a call.

    Parameters
    ----------
    numbers : int
        Numbers in the block.
    width : int
        Numbers a sample takes in it.

    Returns
    -------
    int
        Samples in a block.
    """
    size = max(256, min(numbers // width, 11 * SAMPLES_IN_PIECE))
    return size - size % SAMPLES_IN_PIECE if size > SAMPLES_IN_PIECE else size


def working_space(name: str, *shape: int) -> np.ndarray:
    """Get the working space of this thread, which still holds the block before.

    Memory new for every block would have to be mapped and cleared each time, which costs a fifth of the whole.

    Parameters
    ----------
    name : str
        What it is used for.
    *shape : int
        Its shape.

    Returns
    -------
    ndarray
        Of that shape.
    """
    held: np.ndarray | None = getattr(_spaces, name, None)
    if held is None or held.shape != shape:
        held = np.empty(shape)
        setattr(_spaces, name, held)
    return held
