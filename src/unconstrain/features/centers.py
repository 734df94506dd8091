"""Where the centres of Gaussian receptive fields go, and how wide they are.

`width` is σ of `exp(-‖x - c‖² / 2σ²)` throughout, in the unit of the states. No placement depends on the
order of the samples, so neither does a policy built on it.
"""

import numpy as np
from numpy.typing import ArrayLike

from unconstrain.arrays import check_choice, check_finite
from unconstrain.errors import PolicyError
from unconstrain.receptive import squared_distances

PLACEMENTS = ("grid", "kmeans", "coverage")

# Neighbouring centres then overlap at exp(-1/(2 * 1.5²)) = 0.80 of their height: smooth, still well conditioned.
WIDTH_PER_SPACING = 1.5


def place(
    X: np.ndarray,
    centers: str | ArrayLike,
    *,
    n_centers: int,
    width: float | None,
    coverage: float,
    sample_weight: np.ndarray | None = None,
    random_state: int | np.random.RandomState | None = None,
) -> tuple[np.ndarray, float]:
    """Centres (M, n) and width for states X (N, n).

    centers: an array (M, n), or "grid" (over the range of the data, the most per dimension that `n_centers`
        allows), "kmeans" (`n_centers` of them), or "coverage" (every state has an activation of at least
        `coverage` somewhere; with a width given as many centres as that takes, without one `n_centers` of them,
        and the width that covers).
    width: σ, or None to take it from the coverage, or for other placements from the centres' spacing.

    Raises `PolicyError` for centres of another dimension than the states, and for unknown placements.
    """
    if isinstance(centers, str):
        check_choice(centers, "centers", PLACEMENTS)
        n_centers = _positive_integer(n_centers)
        if centers == "coverage":
            if not 0 < coverage < 1:
                raise PolicyError(f"coverage must be a number between 0 and 1, got {coverage!r}")
            # exp(-r² / 2σ²) = coverage at the edge of what a centre covers.
            radii = np.sqrt(-2.0 * np.log(coverage))
            if width is not None:
                return farthest_first(X, radius=radii * width)[0], width
            placed, radius = farthest_first(X, n_centers=n_centers)
            return placed, radius / radii if radius > 0 else _spacing_width(placed, X)
        placed = (
            grid(X, n_centers) if centers == "grid" else kmeans(X, n_centers, sample_weight, random_state)
        )
    else:
        placed = np.array(centers, dtype=np.float64, ndmin=2)
        if placed.ndim != 2 or placed.shape[1] != X.shape[1] or not len(placed):
            raise PolicyError(f"centers must be (M, {X.shape[1]}) for these states, got shape {placed.shape}")
        check_finite(placed, "centers")
    return placed, _spacing_width(placed, X) if width is None else width


def grid(X: np.ndarray, n_centers: int) -> np.ndarray:
    """Return a regular grid over the data's range: k centres per dimension, k the largest with `k^n <= n_centers`."""
    n = X.shape[1]
    per_axis = max(1, int(np.floor(n_centers ** (1.0 / n) + 1e-9)))
    low, high = X.min(axis=0), X.max(axis=0)
    ticks = (np.arange(per_axis) / (per_axis - 1)) if per_axis > 1 else np.array([0.5])
    axes = [np.unique(lo + (hi - lo) * ticks) for lo, hi in zip(low, high, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, n)


def kmeans(
    X: np.ndarray,
    n_centers: int,
    sample_weight: np.ndarray | None = None,
    random_state: int | np.random.RandomState | None = None,
) -> np.ndarray:
    """Cluster means (scikit-learn's `KMeans`), of the states sorted first so that their order does not matter."""
    from sklearn.cluster import KMeans  # slow to import

    order = np.lexsort(X.T)
    X = X[order]
    distinct = 1 + np.count_nonzero(np.any(X[1:] != X[:-1], axis=1))
    model = KMeans(min(n_centers, distinct), n_init=1, random_state=random_state)
    return model.fit(
        X, sample_weight=None if sample_weight is None else sample_weight[order]
    ).cluster_centers_


def farthest_first(
    X: np.ndarray, *, n_centers: int | None = None, radius: float = 0.0
) -> tuple[np.ndarray, float]:
    """Farthest-first traversal: each next centre is the state farthest from all centres so far.

    Starts at the state nearest the middle of the range; stops after `n_centers`, or once every state lies within
    `radius` of a centre. One vectorised pass over the N states per centre, N numbers of memory; any two centres
    are further apart than the radius reached. Returns the centres (M, n) and that radius.
    Source: Gonzalez, Clustering to minimize the maximum intercluster distance, 1985.
    """
    nearest = squared_distances(X, (X.min(axis=0, keepdims=True) + X.max(axis=0, keepdims=True)) / 2)[:, 0]
    chosen = [_first_of(X, nearest == nearest.min())]
    nearest = squared_distances(X, X[chosen])[:, 0]
    while True:
        farthest = nearest.max()
        if farthest <= radius**2 or len(chosen) == n_centers:
            return X[chosen], float(np.sqrt(farthest))
        chosen.append(_first_of(X, nearest == farthest))
        np.minimum(nearest, squared_distances(X, X[chosen[-1:]])[:, 0], out=nearest)


def _first_of(X: np.ndarray, tied: np.ndarray) -> int:
    """Of the tied rows the lexicographically first: a choice that does not depend on their order."""
    rows = np.flatnonzero(tied)
    return int(rows[0] if len(rows) == 1 else rows[np.lexsort(X[rows].T)[0]])


def _spacing_width(centers: np.ndarray, X: np.ndarray) -> float:
    """`WIDTH_PER_SPACING` times the mean distance to the nearest other centre; one centre: the data's spread."""
    distances = squared_distances(centers, centers)
    distances[distances == 0] = np.inf
    nearest = distances.min(axis=1)
    nearest = nearest[np.isfinite(nearest)]
    if len(nearest):
        return WIDTH_PER_SPACING * float(np.mean(np.sqrt(nearest)))
    return float(np.sqrt(np.sum(np.var(X, axis=0)))) or 1.0


def _positive_integer(n_centers: object) -> int:
    if not isinstance(n_centers, int | np.integer) or n_centers < 1:
        raise PolicyError(f"n_centers must be a whole number of at least 1, got {n_centers!r}")
    return int(n_centers)
