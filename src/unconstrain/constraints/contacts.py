"""Which samples are in contact, read off measured forces by two thresholds (hysteresis).

A contact is a stretch of samples whose force stays above `release` and exceeds `threshold` at least once. Below
`release` the sample is free; a stretch that never exceeds `threshold` could be either, and is left unknown.
"""

from numbers import Real

import numpy as np
from numpy.typing import ArrayLike, NDArray

from unconstrain.arrays import check_number, check_numbers, quote
from unconstrain.constraints.filtering import check_window, running_mean, running_median, split_episodes
from unconstrain.errors import DataError, PolicyError

Array = NDArray[np.float64]
Rows = NDArray[np.intp]


def contact(
    forces: ArrayLike,
    threshold: float,
    *,
    release: float | None = None,
    window: int = 5,
    episodes: ArrayLike | None = None,
) -> tuple[Array, Array]:
    """Find which samples are in contact, and the steadied forces there.

    Parameters
    ----------
    forces : array_like of shape (N, m)
        As measured, in newtons or any other unit, in the order of time.
    threshold : float
        A force that exceeds this is a contact, in the unit of the forces. A sensor's noise should not reach it.
    release : float, optional
        A contact lasts until the force falls below this; half the threshold by default.
    window : int
        Samples, an odd number, of the median and of the average within a contact. 1 filters nothing.
    episodes : array_like of shape (N,), optional
        Nothing is filtered across episodes, and what is said of one does not depend on the others.

    Returns
    -------
    touching : ndarray of shape (N,)
        1 in contact, 0 free, NaN where it could be either.
    steadied : ndarray of shape (N, m)
        Forces in contact, else zero.

    Raises
    ------
    DataError
        If the forces are not finite and (N, m), or a number makes no sense.
    """
    F = check_forces(forces)
    return detect_contact(F, F, threshold, release, window, split_episodes(episodes, len(F)))


def detect_contact(
    F: Array, directed: Array, threshold: float, release: float | None, window: int, episodes: list[Rows]
) -> tuple[Array, Array]:
    """Detect contact by one array of forces, and steady another within the contacts.

    Parameters
    ----------
    F : ndarray of shape (N, m)
        Forces by whose size contact is told.
    directed : ndarray of shape (N, m)
        Forces whose direction matters, such as those left without friction.
    threshold, release, window
        As for `contact`.
    episodes : list of ndarray of int
        Rows of each episode.

    Returns
    -------
    touching : ndarray of shape (N,)
        1 in contact, 0 free, NaN where it could be either.
    steadied : ndarray of shape (N, m)
        `directed`, averaged within each contact; zero elsewhere.

    Raises
    ------
    DataError
        If a number makes no sense.
    """
    try:
        threshold = check_number(threshold, "the force threshold, in the unit of the forces,", positive=True)
    except PolicyError as error:  # here a number that goes with the data
        raise DataError(str(error)) from None
    release = threshold / 2 if release is None else release
    if not (isinstance(release, Real) and 0 < release <= threshold):
        raise DataError(
            f"release must be above zero and at most the threshold {threshold:g}, got {quote(release)}"
        )
    window = check_window(window)
    touching, steadied = np.zeros(len(F)), np.zeros_like(F)
    for own in episodes:
        size = np.linalg.norm(running_median(F[own], window), axis=1)
        for stretch in _find_runs(size > release):
            rows = own[stretch]
            if size[stretch].max() <= threshold:
                touching[rows] = np.nan
                continue
            touching[rows] = 1.0
            steadied[rows] = running_mean(running_median(directed[rows], window), window)
    return touching, steadied


def near_change(touching: Array, margin: int, episodes: list[Rows]) -> NDArray[np.bool_]:
    """Find the samples near the beginning or the end of a contact.

    Parameters
    ----------
    touching : ndarray of shape (N,)
        As `contact` returns it.
    margin : int
        Samples on either side of a change.
    episodes : list of ndarray of int
        Rows of each episode.

    Returns
    -------
    ndarray of shape (N,), bool
        True near a change.
    """
    near = np.zeros(len(touching), dtype=bool)
    for own in episodes:
        state = np.nan_to_num(touching[own], nan=-1.0)
        for change in np.flatnonzero(state[1:] != state[:-1]) + 1:
            near[own[max(change - margin, 0) : change + margin]] = True
    return near


def check_forces(forces: ArrayLike) -> Array:
    """Check measured forces.

    Parameters
    ----------
    forces : array_like of shape (N, m)
        As measured.

    Returns
    -------
    ndarray of shape (N, m)
        The forces, in double precision.

    Raises
    ------
    DataError
        If they are of another shape or not finite.
    """
    F = check_numbers(forces, "forces")
    if F.ndim != 2 or 0 in F.shape:
        raise DataError(f"forces must be (samples, components), got shape {F.shape}")
    if not np.isfinite(F).all():
        raise DataError(
            f"forces have NaN or infinity in row {np.argwhere(~np.isfinite(F))[0][0]}: leave such samples out or fill "
            "them in"
        )
    return F


def _find_runs(mask: NDArray[np.bool_]) -> list[slice]:
    """Find the stretches where the mask is true."""
    padded = np.concatenate([[False], mask, [False]])
    edges = np.flatnonzero(padded[1:] != padded[:-1]).tolist()
    return [slice(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True)]
