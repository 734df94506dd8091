"""How many directions are constrained: read off how the motion is shared out among directions."""

import numpy as np

from unconstrain.errors import DataError

LEAST_GAP = 4.0
"""Across a constraint there is at most this many times less motion (in squares) than along the least free direction:
half the speed. A hand on a surface moves across it by noise and give; without noise the gap is many orders larger."""


def count_constrained(shares: np.ndarray) -> tuple[int, str]:
    """Count the constrained directions: those before the largest jump of the shares of motion.

    Parameters
    ----------
    shares : ndarray of shape (d,)
        Shares of motion, ascending, which sum to one. Shares below rounding count alike.

    Returns
    -------
    count : int
        Number of constrained directions.
    reason : str
        Why so many.

    Raises
    ------
    DataError
        If no share is `LEAST_GAP` times the one before: the actions span everything.
    """
    floor = len(shares) * np.finfo(np.float64).eps
    floored = np.maximum(shares, floor)
    jumps = floored[1:] / floored[:-1]
    k = int(np.argmax(jumps)) + 1
    if jumps[k - 1] < LEAST_GAP:
        raise DataError(
            f"the actions span all {len(shares)} directions (shares of motion {format_shares(shares)}), so there is "
            f"no constraint to be found: no direction has {LEAST_GAP:g} times less motion than the next; give "
            "n_constraints if you know better"
        )
    return k, (
        f"{k} of {len(shares)} directions: shares of motion {format_shares(shares)} jump by {jumps[k - 1]:.3g} after "
        f"the {'first' if k == 1 else f'first {k}'}"
    )


def format_shares(shares: np.ndarray) -> str:
    """Write shares as text, with the zeros that rounding leaves shown as such.

    Parameters
    ----------
    shares : ndarray of shape (d,)
        Shares of motion.

    Returns
    -------
    str
        The shares, separated by commas.
    """
    return ", ".join("0" if share < 1e-15 else f"{share:.2g}" for share in shares)
