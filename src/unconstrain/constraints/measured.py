"""Projections from what is known sample by sample: contact normals, Jacobian rows, a flag that says "free".

A sample of which nothing is known has a projection that is all NaN.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from unconstrain.arrays import check_numbers
from unconstrain.constraints.nullspace import projection, unconstrained
from unconstrain.errors import DataError

Array = NDArray[np.float64]


def from_normals(normals: ArrayLike, jacobian: ArrayLike | None = None) -> Array:
    """Compute projections from the directions in which contacts block the motion, ``n·v = 0``.

    Parameters
    ----------
    normals : array_like of shape (N, m) or (N, k, m)
        One or several contact normals a sample, of any length and sign. A zero normal is no contact; a sample with
        NaN in its normals is one of which nothing is known.
    jacobian : array_like of shape (N, m, d), optional
        From actions to the velocities that the normals speak of, ``v = J u``: a contact at a robot's hand, with joint
        velocities as actions, has the constraint row ``nᵀJ``. By default v is the action itself.

    Returns
    -------
    ndarray of shape (N, d, d)
        Nullspace projections, all NaN where nothing is known.

    Raises
    ------
    DataError
        If shapes do not match, or an entry is infinite.
    """
    n = _check_not_infinite("normals", normals)
    if n.ndim == 2:
        n = n[:, None, :]
    if n.ndim != 3:
        raise DataError(
            f"normals must be (samples, m) or (samples, contacts, m), got shape {np.shape(normals)}"
        )
    unknown = np.asarray(np.isnan(n).any(axis=(1, 2)))
    rows = np.where(unknown[:, None, None], 0.0, n)
    if jacobian is not None:
        rows = rows @ check_jacobians(jacobian, len(n), n.shape[2])
    N = projection(rows)
    N[unknown] = np.nan
    return N


def from_jacobian(jacobian: ArrayLike, rows: Sequence[int] | None = None) -> Array:
    """Compute projections under which chosen rows of a task Jacobian do not move, ``A = J[rows]``.

    Parameters
    ----------
    jacobian : array_like of shape (N, m, d)
        One a sample, from actions to the velocities of m task coordinates.
    rows : sequence of int, optional
        Those task coordinates that are held fixed, counted from 0; all of them by default.

    Returns
    -------
    ndarray of shape (N, d, d)
        Nullspace projections.

    Raises
    ------
    DataError
        If the Jacobian is of another shape or not finite, or has no such row.
    """
    J = _check_not_infinite("the Jacobian", jacobian)
    if J.ndim != 3:
        raise DataError(f"the Jacobian must be (samples, task coordinates, actions), got shape {J.shape}")
    chosen = check_numbers(range(J.shape[1]) if rows is None else rows, "rows of the Jacobian").ravel()
    outside = [row for row in chosen.tolist() if not (-J.shape[1] <= row < J.shape[1] and row == int(row))]
    if outside:
        raise DataError(f"the Jacobian has {J.shape[1]} rows, counted from 0: there is no row {outside[0]:g}")
    return projection(J[:, chosen.astype(int)])


def from_flags(free: ArrayLike, d: int) -> Array:
    """Make projections from flags that say where a sample was free.

    Parameters
    ----------
    free : array_like of shape (N,)
        Booleans, or numbers of which 0 says "not free" and anything else "free".
    d : int
        Number of actions.

    Returns
    -------
    ndarray of shape (N, d, d)
        The identity where the sample was free, all NaN where it was not: its constraint is not known.

    Raises
    ------
    DataError
        If there is not one number a sample.
    """
    flags = _check_not_infinite("the free flags", free)
    if flags.ndim != 1:
        raise DataError(f"the free flags must be one a sample, (samples,), got shape {flags.shape}")
    if np.isnan(flags).any():
        raise DataError(
            f"the free flag of row {np.argmax(np.isnan(flags))} is NaN: give 0 where nothing is known"
        )
    N = unconstrained(d, len(flags))
    N[flags == 0] = np.nan
    return N


def first_known(*projections: ArrayLike) -> Array:
    """Choose for each sample the first of several projections that is known.

    Parameters
    ----------
    *projections : array_like of shape (N, d, d)
        Of the same samples; all NaN where not known.

    Returns
    -------
    ndarray of shape (N, d, d)
        Nullspace projections, all NaN where none is known.

    Raises
    ------
    DataError
        If none are given or their shapes differ.
    """
    if not projections:
        raise DataError("there are no projections to choose from: give at least one array (N, d, d)")
    first, *others = (check_numbers(N, "projections") for N in projections)
    chosen = first.copy()
    for other in others:
        if other.shape != chosen.shape:
            raise DataError(
                f"projections of shapes {chosen.shape} and {other.shape} are not of the same samples"
            )
        unknown = np.isnan(chosen).any(axis=(1, 2))
        chosen[unknown] = other[unknown]
    return chosen


def check_jacobians(jacobian: ArrayLike, samples: int, m: int) -> Array:
    """Check task Jacobians, one a sample.

    Parameters
    ----------
    jacobian : array_like of shape (N, m, d)
        From actions to the velocities of m components.
    samples, m : int
        Number N of samples, and m.

    Returns
    -------
    ndarray of shape (N, m, d)
        The Jacobians.

    Raises
    ------
    DataError
        If they are of another shape or not finite.
    """
    J = _check_not_infinite("the Jacobian", jacobian)
    if J.ndim != 3 or J.shape[:2] != (samples, m):
        raise DataError(
            f"the Jacobian must be ({samples}, {m}, actions), one a sample and a row for each of the {m} components, "
            f"got shape {J.shape}"
        )
    if np.isnan(J).any():
        raise DataError(
            f"the Jacobian of row {np.argwhere(np.isnan(J))[0][0]} has NaN: leave that sample out"
        )
    return J


def _check_not_infinite(what: str, values: ArrayLike) -> Array:
    array = check_numbers(values, what)
    if np.isinf(array).any():
        raise DataError(
            f"{what}: there is an infinite value at index {tuple(np.argwhere(np.isinf(array))[0].tolist())}"
        )
    return array
