"""Projections from obstacles whose places are known: a sample far from all of them was free."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from unconstrain.arrays import check_finite, check_number, check_numbers, quote
from unconstrain.constraints.measured import from_flags
from unconstrain.errors import DataError

Array = NDArray[np.float64]

Obstacle = tuple[ArrayLike, ArrayLike]
"""A centre (m,), and a box's sides (m,) along the axes or a sphere's radius."""


def from_obstacles(
    positions: ArrayLike, obstacles: Iterable[Obstacle], within: float, d: int | None = None
) -> Array:
    """Make projections from where obstacles are: nothing is in the way of a sample that is far from all of them.

    Near an obstacle nothing is known: people go round it without touching it, so no direction is blocked that its
    surface would tell. The fit takes such a motion for free, or for what a constraint left of the policy's. Where
    people steered round an obstacle it is neither, and leaving out what is not known may be better; where the motion
    slides along a surface, `from_normals` says more.

    Parameters
    ----------
    positions : array_like of shape (N, m)
        Of whatever could meet the obstacles, in their frame and unit: the columns of the states that are positions, or
        a robot's hand.
    obstacles : iterable of (centre, size)
        A centre, m numbers; and m numbers for a box, its whole sides along the axes, or one for a sphere, its radius.
    within : float
        The distance from an obstacle's surface within which it could have mattered, in the positions' unit.
    d : int, optional
        Number of actions; by default m.

    Returns
    -------
    ndarray of shape (N, d, d)
        The identity where every obstacle is farther away than that, all NaN elsewhere: what `policy.fit(X, U,
        projections=N)` takes. The adaptive risk goes on to infer which of the others were free; the risk
        "inconsistency" takes all of them for constrained.

    Raises
    ------
    DataError
        There are no obstacles, or one has another dimension than the positions or a negative size.
    PolicyError
        `within` is negative.
    """
    X = _check_positions(positions)
    reach = check_number(within, "within", positive=False)
    free = obstacle_distances(X, obstacles) > reach
    return from_flags(free, X.shape[1] if d is None else d)


def obstacle_distances(positions: ArrayLike, obstacles: Iterable[Obstacle]) -> Array:
    """Compute how far positions are from the nearest of some obstacles.

    Parameters
    ----------
    positions : array_like of shape (N, m)
        In the obstacles' frame and unit.
    obstacles : iterable of (centre, size)
        As for `from_obstacles`.

    Returns
    -------
    ndarray of shape (N,)
        From the surface; zero inside.

    Raises
    ------
    DataError
        There are no obstacles, or one has another dimension than the positions or a negative size.
    """
    X = _check_positions(positions)
    distances = []
    for k, obstacle in enumerate(obstacles):
        if not (isinstance(obstacle, tuple | list) and len(obstacle) == 2):
            raise DataError(
                f"obstacle {k} must be a pair (centre, size), in a list of such, got {quote(obstacle)}"
            )
        distances.append(_distance(X, k, *obstacle))
    if not distances:
        raise DataError("there are no obstacles: give at least one (centre, size)")
    return np.min(distances, axis=0)


def _distance(X: Array, k: int, centre: ArrayLike, size: ArrayLike) -> Array:
    m = X.shape[1]
    middle, sides = (
        check_numbers(each, f"{what} of obstacle {k}")
        for what, each in (("the centre", centre), ("the size", size))
    )
    if middle.shape != (m,) or sides.shape not in ((), (m,)):
        raise DataError(
            f"obstacle {k} must have a centre of {m} numbers, as many as a position, and {m} sides of a box or one "
            f"radius of a sphere, got shapes {middle.shape} and {sides.shape}"
        )
    check_finite(middle, f"the centre of obstacle {k}")
    if not (np.all(sides >= 0) and np.isfinite(sides).all()):
        raise DataError(f"the size of obstacle {k} must be lengths of zero or more, got {sides.tolist()}")
    if sides.ndim:
        return np.asarray(np.linalg.norm(np.maximum(np.abs(X - middle) - sides / 2, 0.0), axis=1))
    return np.asarray(np.maximum(np.linalg.norm(X - middle, axis=1) - sides, 0.0))


def _check_positions(positions: ArrayLike) -> Array:
    X = check_numbers(positions, "positions")
    if X.ndim != 2:
        raise DataError(f"positions must be (samples, m), a row a sample, got shape {X.shape}")
    check_finite(X, "positions")
    return X
