"""Projections from contact forces: a contact pushes back along the direction it blocks.

An ideal contact does no work, so its force is a constraint row: ``f·v = 0`` for the velocity v of the point that is
touched. What a sensor measures is noisy, flickers about any threshold as contact is made and broken, and contains
friction. Where a sensor had stopped (`stuck`) nothing is known. Else, four steps:

1. a running median takes out spikes and keeps the edges of contacts, which a mean would smear (`filtering`);
2. contact is told by two thresholds (`contacts`);
3. the part of the force along the motion is friction, which does work, and is taken out (`friction`). Where less than
   half of the force is left (it lies within 30° of the motion) this is no contact that blocks the motion, and its
   constraint is left unknown. With a coefficient of friction that is known, no more is taken out than that;
4. within a contact, and never across its ends, what is left is averaged over the window, which steadies its direction.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from unconstrain.arrays import check_whole
from unconstrain.constraints.contacts import check_forces, detect_contact, near_change
from unconstrain.constraints.filtering import running_median, split_episodes
from unconstrain.constraints.friction import check_friction, directions_of_motion, remove_along
from unconstrain.constraints.measured import check_jacobians, from_normals
from unconstrain.constraints.stuck import detect_stuck
from unconstrain.errors import DataError

FRICTION = 0.5
"""Share of the measured force that has to be at right angles to the motion: that of friction coefficients up to √3."""


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
    friction: float | None = None,
) -> NDArray[np.float64]:
    """Compute projections from measured contact forces: the identity out of contact, and across the force in contact.

    Parameters
    ----------
    forces : array_like of shape (N, m)
        As measured, in newtons or any other unit, in the order of time.
    threshold : float
        A force that exceeds this is a contact, in the unit of the forces. A sensor's noise should not reach it.
    actions : array_like of shape (N, d), optional
        To take friction out of the forces; without them friction tilts the constraint.
    jacobian : array_like of shape (N, m, d), optional
        From actions to the velocity of the point touched, ``v = J u``, in the frame of the forces; the constraint row
        is ``fᵀJ``. Needed where actions are joint velocities; by default v is the action itself.
    release : float, optional
        A contact lasts until the force falls below this; half the threshold by default.
    window : int
        Samples, an odd number, of the median and of the average within a contact. 1 filters nothing.
    margin : int
        Samples at either end of a contact whose constraint is left unknown: as many as the actions were smoothed
        over, where they were differentiated.
    episodes : array_like of shape (N,), optional
        Nothing is filtered across episodes, and what is said of one does not depend on the others.
    friction : float, optional
        Coefficient of friction, such as `find_friction` estimates; needs actions. By default all of the force along the
        motion is taken for friction.

    Returns
    -------
    ndarray of shape (N, d, d)
        Nullspace projections, all NaN where not known.

    Raises
    ------
    DataError
        If shapes do not match, entries are not finite, or a number makes no sense.
    """
    F = check_forces(forces)
    J = None if jacobian is None else check_jacobians(jacobian, *F.shape)
    each = split_episodes(episodes, len(F))
    along = None if actions is None else directions_of_motion(actions, F, J, each)
    blocking = F if along is None else remove_along(F, along)
    if friction is not None:
        if along is None:
            raise DataError("friction opposes the motion: give actions= beside friction=")
        size = check_friction(friction) * np.linalg.norm(blocking, axis=1)
        blocking = F + size[:, None] * along
    touching, steadied = detect_contact(F, blocking, threshold, release, window, each)
    unknown = np.isnan(touching) | detect_stuck(F, each)
    if along is not None:
        if friction is None:
            # The mean over the window may lean a little the way this very sample moves, which it did.
            steadied = remove_along(steadied, along)
        size = np.empty(len(F))
        for own in each:
            size[own] = np.linalg.norm(running_median(F[own], window), axis=1)
        unknown |= (touching == 1) & (np.linalg.norm(steadied, axis=1) < FRICTION * size)
    margin = check_whole(margin, "margin", least=0)
    if margin:
        unknown |= near_change(touching, margin, each)
    N = from_normals(steadied, J)
    N[unknown] = np.nan
    return N
