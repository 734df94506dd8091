"""Constraints felt: a contact pushes back along the direction it blocks.

An ideal contact does no work, so its force is a constraint row: ``f·v = 0`` for the velocity v of the point that is
touched. What a sensor measures is noisy, flickers about any threshold as contact is made and broken, and contains
friction. Hence four steps:

1. a running median takes out spikes and keeps the edges of contacts, which a mean would smear;
2. a contact is a stretch of samples whose force stays above `release` and exceeds `threshold` at least once
   (hysteresis). Below `release` the sample is free; a stretch that never exceeds `threshold` could be either, and is
   left unknown;
3. the part of the force along the motion is friction, which does work, and is taken out. Where less than half of the
   force is left (it lies within 30° of the motion) this is no contact that blocks the motion, and its constraint is
   left unknown;
4. within a contact, and never across its ends, what is left is averaged over the window, which steadies its direction.
"""

from numbers import Real

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import median_filter, uniform_filter1d

from unconstrain.constraints.measured import checked_jacobians, from_normals
from unconstrain.errors import DataError

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

FRICTION = 0.5
"""Share of the measured force that has to be at right angles to the motion: that of friction coefficients up to √3."""


SLOW = 0.1
"""Below this share of its episode's root mean square speed the direction of motion is noise; friction is left in."""


def contact(
    forces: ArrayLike,
    threshold: float,
    *,
    release: float | None = None,
    window: int = 5,
    episodes: ArrayLike | None = None,
) -> tuple[Array, Array]:
    """Which samples are in contact, and the steadied forces there: steps 1, 2 and 4 of this module.

    Parameters
    ----------
    forces : array (N, m)
        As measured, in newtons or any other unit, in the order of time.
    threshold : float
        A force that exceeds this is a contact, in the unit of the forces. A sensor's noise should not reach it.
    release : float, optional
        A contact lasts until the force falls below this; half the threshold by default.
    window : int
        Samples, an odd number, of the median and of the average within a contact. 1 filters nothing.
    episodes : array (N,), optional
        Nothing is filtered across episodes, and what is said of one does not depend on the others.

    Returns
    -------
    array (N,)
        1 in contact, 0 free, NaN where it could be either.
    array (N, m)
        Forces in contact, else zero.

    Raises
    ------
    DataError
        If the forces are not finite and (N, m), or a number makes no sense.
    """
    F = _checked(forces)
    return _contact(F, F, threshold, release, window, _by_episode(episodes, len(F)))


def _contact(
    F: Array,
    directed: Array,
    threshold: float,
    release: float | None,
    window: int,
    each: list[Rows],
) -> tuple[Array, Array]:
    """Contact is read off forces F, the direction off `directed`, in each episode by itself."""
    if not (isinstance(threshold, Real) and np.isfinite(threshold) and threshold > 0):
        raise DataError(
            f"the force threshold must be a number above zero, in the unit of the forces, got {threshold!r}"
        )
    release = threshold / 2 if release is None else release
    if not 0 < release <= threshold:
        raise DataError(
            f"release must be above zero and at most the threshold {threshold:g}, got {release!r}"
        )
    if isinstance(window, bool) or not isinstance(window, int | np.integer) or window < 1 or window % 2 == 0:
        raise DataError(f"the window must be an odd number of samples, got {window!r}")
    touching, steadied = np.zeros(len(F)), np.zeros_like(F)
    for own in each:
        calm = median_filter(F[own], size=(window, 1), mode="nearest")
        size = np.linalg.norm(calm, axis=1)
        for run in _runs(size > release):
            stretch = own[run]
            if size[run].max() <= threshold:
                touching[stretch] = np.nan
                continue
            touching[stretch] = 1.0
            inside = median_filter(directed[stretch], size=(window, 1), mode="nearest")
            share = uniform_filter1d(np.ones(len(stretch)), window, mode="constant")
            steadied[stretch] = uniform_filter1d(inside, window, axis=0, mode="constant") / share[:, None]
    return touching, steadied


def from_forces(
    forces: ArrayLike,
    threshold: float,
    *,
    actions: ArrayLike | None = None,
    jacobian: ArrayLike | None = None,
    release: float | None = None,
    window: int = 5,
    margin: int = 0,
    episodes: ArrayLike | None = None,
) -> Array:
    """Projections (N, d, d) from measured contact forces: blocked along the force in contact, the identity out of it.

    Parameters
    ----------
    forces, threshold, release, window, episodes
        As for `contact`.
    actions : array (N, d), optional
        To take friction out of the forces (step 3); without them friction tilts the constraint.
    jacobian : array (N, m, d), optional
        From actions to the velocity of the point touched, ``v = J u``, in the frame of the forces; the constraint row
        is ``fᵀJ``. Needed where actions are joint velocities; by default v is the action itself.
    margin : int
        Samples at either end of a contact whose constraint is left unknown: as many as the actions were smoothed
        over, where they were differentiated.

    Returns
    -------
    array (N, d, d)
        All NaN where it is not known.

    Raises
    ------
    DataError
        If shapes do not match, entries are not finite, or a number makes no sense.
    """
    F = _checked(forces)
    J = None if jacobian is None else checked_jacobians(jacobian, *F.shape)
    each = _by_episode(episodes, len(F))
    along = None if actions is None else _directions(np.asarray(actions, dtype=np.float64), F, J, each)
    blocking = F if along is None else _across(F, along)
    touching, steadied = _contact(F, blocking, threshold, release, window, each)
    unknown = np.isnan(touching)
    if along is not None:
        # The mean over the window may lean a little the way this very sample moves, which it did.
        steadied = _across(steadied, along)
        size = np.empty(len(F))
        for own in each:
            size[own] = np.linalg.norm(median_filter(F[own], size=(window, 1), mode="nearest"), axis=1)
        unknown |= (touching == 1) & (np.linalg.norm(steadied, axis=1) < FRICTION * size)
    if margin:
        unknown |= _near_change(touching, margin, each)
    N = from_normals(steadied, J)
    N[unknown] = np.nan
    return N


def _directions(U: Array, F: Array, J: Array | None, each: list[Rows]) -> Array:
    """Directions (N, m) in which the point touched moves; zero where it hardly does."""
    if len(U) != len(F):
        raise DataError(f"there are {len(F)} forces and {len(U)} actions: give one force a sample")
    if J is not None and U.ndim == 2 and U.shape[1] != J.shape[2]:
        raise DataError(f"the Jacobian is over {J.shape[2]} actions, but there are {U.shape[1]}")
    velocity = U if J is None else np.einsum("nij,nj->ni", J, U)
    if velocity.shape != F.shape:
        raise DataError(
            f"forces have {F.shape[1]} components and actions {velocity.shape[1:]} dimensions: give the components of "
            "the force along the actions, or the Jacobian that leads from one to the other"
        )
    speed = np.linalg.norm(velocity, axis=1, keepdims=True)
    moves = np.empty_like(speed, dtype=bool)
    for own in each:
        moves[own] = speed[own] > SLOW * np.sqrt(np.mean(speed[own] ** 2))
    return np.divide(velocity, speed, out=np.zeros_like(velocity), where=moves)


def _across(F: Array, along: Array) -> Array:
    """What of F (N, m) is at right angles to unit vectors (N, m)."""
    return F - np.einsum("nm,nm->n", F, along)[:, None] * along


def _by_episode(episodes: ArrayLike | None, count: int) -> list[Rows]:
    """The rows of each episode, in their order."""
    labels = np.zeros(count, dtype=int) if episodes is None else np.asarray(episodes)
    if labels.shape != (count,):
        raise DataError(
            f"there are {count} forces and episode labels of shape {labels.shape}: give one a sample"
        )
    order = np.argsort(labels, kind="stable")
    return np.split(order, np.flatnonzero(labels[order][1:] != labels[order][:-1]) + 1)


def _runs(mask: NDArray[np.bool_]) -> list[slice]:
    """Stretches where the mask is true."""
    padded = np.concatenate([[False], mask, [False]])
    edges = np.flatnonzero(padded[1:] != padded[:-1]).tolist()
    return [slice(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _near_change(touching: Array, margin: int, each: list[Rows]) -> NDArray[np.bool_]:
    near = np.zeros(len(touching), dtype=bool)
    for own in each:
        state = np.nan_to_num(touching[own], nan=-1.0)
        for change in np.flatnonzero(state[1:] != state[:-1]) + 1:
            near[own[max(change - margin, 0) : change + margin]] = True
    return near


def _checked(forces: ArrayLike) -> Array:
    F = np.asarray(forces, dtype=np.float64)
    if F.ndim != 2 or 0 in F.shape:
        raise DataError(f"forces must be (samples, components), got shape {F.shape}")
    if not np.isfinite(F).all():
        raise DataError(
            f"forces have NaN or infinity in row {np.argwhere(~np.isfinite(F))[0][0]}: leave such samples out or fill "
            "them in"
        )
    return F
