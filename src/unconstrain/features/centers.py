"""Where the centres of Gaussian receptive fields go, and how wide the fields are.

`width` is σ of `exp(-‖x - c‖² / 2σ²)` throughout, one number for each dimension of the states, in its unit. Where it is
given as one number, distances are as they stand; where it is not given, each dimension is measured in units of its own
spread, so that where centres lie and how far they reach does not depend on the units of the states. No placement
depends on the order of the samples, so neither does a policy built on it.
"""

from numbers import Real

import numpy as np
from numpy.typing import ArrayLike

from unconstrain.arrays import check_choice, check_finite, check_numbers, check_whole, check_widths, quote
from unconstrain.errors import PolicyError
from unconstrain.features.scaling import Scaling
from unconstrain.memory import check_memory
from unconstrain.parallel import cut_blocks
from unconstrain.receptive import squared_distances

PLACEMENTS = ("grid", "kmeans", "coverage")

# Neighbouring centres then overlap at exp(-1/(2 * 1.5²)) = 0.80 of their height: smooth, still well conditioned.
WIDTH_PER_SPACING = 1.5

DISTANCES_IN_BLOCK = 2**22


def place_centers(
    X: np.ndarray,
    centers: str | ArrayLike,
    *,
    n_centers: int,
    width: float | ArrayLike | None,
    coverage: float,
    sample_weight: np.ndarray | None = None,
    random_state: int | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Place centres for some states, and choose the width of their receptive fields.

    Parameters
    ----------
    X : ndarray of shape (N, n)
        States.
    centers : {"grid", "kmeans", "coverage"} or array_like of shape (M, n)
        "grid" spans the range of the states, with as many centres along each dimension as `n_centers` allows. "kmeans"
        places `n_centers` cluster means. "coverage" gives every state an activation of at least `coverage` in some
        centre: with a width given, as many centres as that takes; without one, `n_centers` of them and the width that
        covers. An array is taken as it is.
    n_centers : int
        How many, where neither the centres themselves nor a width says so.
    width : float, array_like of shape (n,), or None
        Width σ, of all dimensions or of each; None takes it from the coverage, or for other placements from the spacing
        of the centres, in units of each dimension's spread.
    coverage : float
        Between 0 and 1, for "coverage".
    sample_weight : ndarray of shape (N,), optional
        Weight of each state, for "kmeans" and the spread.
    random_state : int, optional
        Seed, for "kmeans".

    Returns
    -------
    centers : ndarray of shape (M, n)
        The centres, in the states' units.
    width : ndarray of shape (n,)
        Their width σ along each dimension, in its unit.

    Raises
    ------
    PolicyError
        The centres are of another dimension than the states, or an option is impossible.
    DataError
        So many centres do not fit into memory.
    """
    n = X.shape[1]
    scaling = Scaling.of(X, sample_weight)
    if width is None:
        unit, sigma = scaling.spread, None
    else:  # one number leaves distances as they stand, and n numbers are units as well
        widths = check_widths(width, "width", n)
        unit, sigma = (np.ones(n), float(widths[0])) if np.ndim(width) == 0 else (widths, 1.0)
    if not isinstance(centers, str):
        placed = np.atleast_2d(check_numbers(centers, "centers")).copy()
        if placed.ndim != 2 or placed.shape[1] != n or not len(placed):
            raise PolicyError(f"centers must be (M, {n}) for these states, got shape {placed.shape}")
        check_finite(placed, "centers")
    else:
        check_choice(centers, "centers", PLACEMENTS)
        n_centers = check_whole(n_centers, "n_centers", least=1)
        measured = Scaling(scaling.mean, unit)
        if centers == "coverage":
            placed, sigma = _cover(X, measured, int(n_centers), sigma, coverage)
        elif centers == "grid":
            placed = grid(X, int(n_centers))
        else:
            found = kmeans(measured(X), int(n_centers), sample_weight, random_state)
            placed = measured.mean + measured.spread * found
    if sigma is None:
        sigma = _spacing_width(Scaling(scaling.mean, unit), placed, X)
    return placed, unit * sigma


def grid(X: np.ndarray, n_centers: int) -> np.ndarray:
    """Place centres on a regular grid over the range of the states.

    Parameters
    ----------
    X : ndarray of shape (N, n)
        States.
    n_centers : int
        The most there may be.

    Returns
    -------
    ndarray of shape (M, n)
        Centres: k along each dimension in which the states differ, the largest k with `k^n <= n_centers`.

    Raises
    ------
    DataError
        So many centres do not fit into memory.
    """
    n = X.shape[1]
    per_axis = max(1, int(np.floor(float(min(n_centers, 10**300)) ** (1.0 / n) + 1e-9)))
    low, high = X.min(axis=0), X.max(axis=0)
    varying = max(1, int(np.count_nonzero(low < high)))
    # Twice: the coordinates, and the grid that is made of them.
    check_memory(
        2.0 * 8.0 * n * float(per_axis) ** varying,
        "a grid of so many centres",
        "choose a smaller n_centers",
    )
    ticks = (np.arange(per_axis) / (per_axis - 1)) if per_axis > 1 else np.array([0.5])
    axes = [np.unique(lo + (hi - lo) * ticks) for lo, hi in zip(low, high, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, n)


def kmeans(
    X: np.ndarray,
    n_centers: int,
    sample_weight: np.ndarray | None = None,
    random_state: int | None = None,
) -> np.ndarray:
    """Place centres at cluster means (scikit-learn's `KMeans`).

    Parameters
    ----------
    X : ndarray of shape (N, n)
        States; they are sorted first, so that their order does not matter.
    n_centers : int
        How many; fewer where fewer states differ.
    sample_weight : ndarray of shape (N,), optional
        Weight of each state.
    random_state : int, optional
        Seed.

    Returns
    -------
    ndarray of shape (M, n)
        Cluster means.
    """
    from sklearn.cluster import KMeans  # slow to import

    if random_state is not None and not isinstance(random_state, np.random.RandomState):
        random_state = check_whole(random_state, "random_state", least=0, most=2**32 - 1)
    order = np.lexsort(X.T)
    X = X[order]
    distinct = 1 + np.count_nonzero(np.any(X[1:] != X[:-1], axis=1))
    model = KMeans(min(n_centers, distinct), n_init=1, random_state=random_state)
    weights = None if sample_weight is None else sample_weight[order]
    return model.fit(X, sample_weight=weights).cluster_centers_


def farthest_first(
    X: np.ndarray, *, scaling: Scaling | None = None, n_centers: int | None = None, radius: float = 0.0
) -> tuple[np.ndarray, float]:
    """Choose states one after the other, each the farthest from all chosen before (farthest-first traversal).

    The first is the state nearest the middle of the range. Each costs one pass over the N states; any two are further
    apart than the radius reached.

    Parameters
    ----------
    X : ndarray of shape (N, n)
        States.
    scaling : Scaling, optional
        Of which distances are taken; by default as they stand.
    n_centers : int, optional
        How many to choose at most.
    radius : float
        Stop once every state lies within this distance of a chosen one.

    Returns
    -------
    centers : ndarray of shape (M, n)
        The chosen states.
    radius : float
        The largest distance of a state from the nearest of them.

    References
    ----------
    Gonzalez, Clustering to minimize the maximum intercluster distance, 1985.
    """
    Z = X if scaling is None else scaling(X)
    nearest = squared_distances(Z, (Z.min(axis=0, keepdims=True) + Z.max(axis=0, keepdims=True)) / 2)[:, 0]
    chosen = [_first_of(X, nearest == nearest.min())]
    nearest = squared_distances(Z, Z[chosen])[:, 0]
    while True:
        farthest = nearest.max()
        # Roots are compared: the square of a radius may be more or less than double precision holds.
        if np.sqrt(farthest) <= radius or len(chosen) == n_centers:
            return X[chosen], float(np.sqrt(farthest))
        chosen.append(_first_of(X, nearest == farthest))
        np.minimum(nearest, squared_distances(Z, Z[chosen[-1:]])[:, 0], out=nearest)


def _cover(
    X: np.ndarray, scaling: Scaling, n_centers: int, width: float | None, coverage: float
) -> tuple[np.ndarray, float | None]:
    """Place centres among the states so that each has an activation of at least `coverage` in one of them."""
    if not (isinstance(coverage, Real) and 0 < coverage < 1):
        raise PolicyError(f"coverage must be a number between 0 and 1, got {quote(coverage)}")
    # exp(-r² / 2σ²) = coverage at the edge of what a centre covers.
    widths = float(np.sqrt(-2.0 * np.log(coverage)))
    if width is not None:
        return farthest_first(X, scaling=scaling, radius=widths * width)[0], width
    placed, radius = farthest_first(X, scaling=scaling, n_centers=n_centers)
    return placed, radius / widths if radius > 0 else None


def _first_of(X: np.ndarray, tied: np.ndarray) -> int:
    """Find the lexicographically first of the tied rows: a choice that does not depend on their order."""
    rows = np.flatnonzero(tied)
    return int(rows[0] if len(rows) == 1 else rows[np.lexsort(X[rows].T)[0]])


def _spacing_width(scaling: Scaling, centers: np.ndarray, X: np.ndarray) -> float:
    """Take `WIDTH_PER_SPACING` times the mean distance to the nearest other centre, or the spread of the states."""
    placed = scaling(centers)
    nearest = np.empty(len(placed))
    for rows in cut_blocks(len(placed), max(1, DISTANCES_IN_BLOCK // len(placed))):
        distances = squared_distances(placed[rows], placed)
        distances[distances == 0] = np.inf
        nearest[rows] = distances.min(axis=1)
    nearest = nearest[np.isfinite(nearest)]
    if len(nearest):
        return WIDTH_PER_SPACING * float(np.mean(np.sqrt(nearest)))
    return float(np.sqrt(np.sum(np.var(scaling(X), axis=0)))) or 1.0
