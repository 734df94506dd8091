"""How many directions are constrained: read off how the motion is shared out among directions."""

import numpy as np

from unconstrain.errors import DataError

LEAST_GAP = 4.0
"""Across a constraint there is at most this many times less motion (in squares) than along the least free direction:
half the speed. A hand on a surface moves across it by noise and give; without noise the gap is many orders larger."""


def count(shares: np.ndarray) -> tuple[int, str]:
    """Number of constrained directions, and why, from shares of motion (d,), ascending, which sum to one.

    It is where the shares jump most, if that jump is at least `LEAST_GAP`. Shares below rounding count alike. Raises
    `DataError` where there is no such jump: the actions span everything.
    """
    floor = len(shares) * np.finfo(np.float64).eps
    floored = np.maximum(shares, floor)
    jumps = floored[1:] / floored[:-1]
    k = int(np.argmax(jumps)) + 1
    if jumps[k - 1] < LEAST_GAP:
        raise DataError(
            f"the actions span all {len(shares)} directions (shares of motion {listed(shares)}), so there is no "
            f"constraint to be found: no direction has {LEAST_GAP:g} times less motion than the next; give "
            "n_constraints if you know better"
        )
    return k, (
        f"{k} of {len(shares)} directions: shares of motion {listed(shares)} jump by {jumps[k - 1]:.3g} after the "
        f"{'first' if k == 1 else f'first {k}'}"
    )


def listed(shares: np.ndarray) -> str:
    """Shares as text, with the zeros that rounding leaves shown as such."""
    return ", ".join("0" if share < 1e-15 else f"{share:.2g}" for share in shares)
