"""What a recording itself says of its constraints: forces, and flags that say "free"."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from unconstrain.constraints.forces import from_forces
from unconstrain.constraints.measured import first_known, from_flags
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError


def from_recording(
    demonstrations: Demonstrations,
    *,
    force_threshold: float | None = None,
    release: float | None = None,
    window: int = 5,
    margin: int = 0,
    jacobian: ArrayLike | None = None,
) -> NDArray[np.float64]:
    """Return the projections of a recording that holds forces, free flags, or both.

    A sample flagged "free" has the identity. One that is not flagged, though there are flags, has what its force says,
    unless that is "free" too: then the two disagree, and nothing is known.

    Parameters
    ----------
    demonstrations : Demonstrations
        With `forces` (N, m), `free` (N,), or both, as ``load(..., force=[...], free=...)`` reads them.
    force_threshold : float, optional
        Needed where there are forces, in their unit; see `from_forces`.
    release, window, margin, jacobian : optional
        See `from_forces`.

    Returns
    -------
    ndarray of shape (N, d, d)
        NaN where nothing is known.

    Raises
    ------
    DataError
        There are neither forces nor flags, or forces without a threshold.
    """
    if demonstrations.forces is None and demonstrations.free is None:
        raise DataError(
            "these demonstrations have neither forces nor flags that say free: name the columns when loading, with "
            "force= or free="
        )
    return from_forces_and_flags(
        demonstrations.forces,
        demonstrations.free,
        demonstrations.actions,
        demonstrations.episodes,
        force_threshold=force_threshold,
        release=release,
        window=window,
        margin=margin,
        jacobian=jacobian,
    )


def from_forces_and_flags(
    forces: NDArray[np.float64] | None,
    free: NDArray[np.float64] | None,
    actions: NDArray[np.float64],
    episodes: NDArray[np.int64],
    *,
    force_threshold: float | None = None,
    release: float | None = None,
    window: int = 5,
    margin: int = 0,
    jacobian: ArrayLike | None = None,
) -> NDArray[np.float64]:
    """Return projections of what `from_recording` takes from demonstrations.

    Parameters
    ----------
    forces : ndarray of shape (N, m) or None
    free : ndarray of shape (N,) or None
        Not None where there are no forces.
    actions : ndarray of shape (N, d)
    episodes : ndarray of shape (N,)
        Forces are filtered within each.
    force_threshold, release, window, margin, jacobian : optional
        See `from_forces`.

    Returns
    -------
    ndarray of shape (N, d, d)
        NaN where nothing is known.

    Raises
    ------
    DataError
        There are forces without a threshold, or forces that do not fit the actions.
    """
    d = actions.shape[1]
    if forces is None:
        assert free is not None
        return from_flags(free, d)
    if force_threshold is None:
        raise DataError("give force_threshold=, above which a force is a contact, in the unit of the forces")
    if jacobian is None and forces.shape[1] != d:
        raise DataError(
            f"forces have {forces.shape[1]} components and actions {d} dimensions: give one force column for each "
            "action column, or the Jacobian that leads from actions to the point touched"
        )
    felt = from_forces(
        forces,
        force_threshold,
        actions=actions,
        jacobian=jacobian,
        release=release,
        window=window,
        margin=margin,
        episodes=episodes,
    )
    if free is None:
        return felt
    felt[(felt == np.eye(d)).all(axis=(1, 2))] = np.nan
    return first_known(from_flags(free, d), felt)


def describe_known(projections: NDArray[np.float64]) -> str:
    """Say of how many samples the constraint is known.

    Parameters
    ----------
    projections : ndarray of shape (N, d, d)
        All NaN where nothing is known.

    Returns
    -------
    str
        Shares of samples: known, in contact, free, unknown.
    """
    unknown = np.isnan(projections).all(axis=(1, 2))
    free = (projections == np.eye(projections.shape[1])).all(axis=(1, 2))
    return (
        f"known of {np.mean(~unknown):.1%} of the samples ({np.mean(~unknown & ~free):.1%} in contact, "
        f"{np.mean(free):.1%} free), not of {np.mean(unknown):.1%}"
    )
