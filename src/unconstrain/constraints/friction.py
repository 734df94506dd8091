"""The part of a contact force that lies along the motion: friction, which does work, and constrains nothing."""

from dataclasses import dataclass
from numbers import Real

import numpy as np
from numpy.typing import ArrayLike, NDArray

from unconstrain.arrays import check_actions, quote
from unconstrain.constraints.contacts import check_forces, detect_contact
from unconstrain.constraints.filtering import split_episodes
from unconstrain.constraints.measured import check_jacobians
from unconstrain.errors import DataError

Array = NDArray[np.float64]

SLOW = 0.1
"""Below this share of its episode's root mean square speed the direction of motion is noise; friction is left in."""


def directions_of_motion(
    actions: ArrayLike, F: Array, jacobian: Array | None, episodes: list[NDArray[np.intp]]
) -> Array:
    """Find the directions in which the point that is touched moves.

    Parameters
    ----------
    actions : array_like of shape (N, d)
        Actions.
    F : ndarray of shape (N, m)
        Forces, whose components the directions have.
    jacobian : ndarray of shape (N, m, d), or None
        From actions to the velocity of the point; None where the action is that velocity.
    episodes : list of ndarray of int
        Rows of each episode.

    Returns
    -------
    ndarray of shape (N, m)
        Unit vectors, zero where the point hardly moves.

    Raises
    ------
    DataError
        If shapes do not match.
    """
    U = check_actions(actions)
    if len(U) != len(F):
        raise DataError(f"there are {len(F)} forces and {len(U)} actions: give one force a sample")
    if jacobian is not None and U.shape[1] != jacobian.shape[2]:
        raise DataError(f"the Jacobian is over {jacobian.shape[2]} actions, but there are {U.shape[1]}")
    velocity = U if jacobian is None else np.einsum("nij,nj->ni", jacobian, U)
    if velocity.shape != F.shape:
        raise DataError(
            f"forces have {F.shape[1]} components and actions {velocity.shape[1:]} dimensions: give the components of "
            "the force along the actions, or the Jacobian that leads from one to the other"
        )
    speed = np.linalg.norm(velocity, axis=1, keepdims=True)
    moves = np.empty_like(speed, dtype=bool)
    for own in episodes:
        moves[own] = speed[own] > SLOW * np.sqrt(np.mean(speed[own] ** 2))
    return np.divide(velocity, speed, out=np.zeros_like(velocity), where=moves)


def remove_along(F: Array, along: Array) -> Array:
    """Remove from forces what lies along given directions.

    Parameters
    ----------
    F : ndarray of shape (N, m)
        Forces.
    along : ndarray of shape (N, m)
        Unit vectors, or zero where nothing is to be removed.

    Returns
    -------
    ndarray of shape (N, m)
        The forces at right angles to them.
    """
    return F - np.einsum("nm,nm->n", F, along)[:, None] * along


def check_friction(coefficient: float) -> float:
    """Check a coefficient of friction.

    Parameters
    ----------
    coefficient : float
        Zero or more.

    Returns
    -------
    float
        The coefficient.

    Raises
    ------
    DataError
        If it is no such number.
    """
    if isinstance(coefficient, Real) and np.isfinite(coefficient) and coefficient >= 0:
        return float(coefficient)
    raise DataError(f"friction must be a coefficient of zero or more, got {quote(coefficient)}")


@dataclass(frozen=True)
class Friction:
    """How much of a contact force opposes the motion.

    Parameters
    ----------
    coefficient : float
        Friction as a share of the force across the motion. Below zero where forces push along more than they oppose.
    uncertainty : float
        Its standard error, by leaving out a tenth of the contact at a time.
    explained : float
        Share of the mean square force along the motion that μ explains. Where it is small, the force along the motion
        is something else: a surface that is not flat, or the hand that leads.
    """

    coefficient: float
    uncertainty: float
    explained: float


PARTS = 10


def find_friction(
    forces: ArrayLike,
    actions: ArrayLike,
    threshold: float,
    *,
    jacobian: ArrayLike | None = None,
    episodes: ArrayLike | None = None,
) -> Friction:
    """Estimate the coefficient of friction μ of contacts: ``f·v̂ = -μ ‖f - (f·v̂) v̂‖``, by least squares.

    Parameters
    ----------
    forces : array_like of shape (N, m)
        As measured, in the order of time, in the frame of the velocities.
    actions : array_like of shape (N, d)
        As for `from_forces`.
    threshold : float
        A force that exceeds this is a contact.
    jacobian : array_like of shape (N, m, d), optional
        As for `from_forces`.
    episodes : array_like of shape (N,), optional
        Nothing is filtered across episodes.

    Returns
    -------
    Friction
        The coefficient, how sure it is, and how much it explains.

    Raises
    ------
    DataError
        If shapes do not match, or there is no contact in which anything moves.
    """
    F = check_forces(forces)
    J = None if jacobian is None else check_jacobians(jacobian, *F.shape)
    each = split_episodes(episodes, len(F))
    along = directions_of_motion(actions, F, J, each)
    touching, _ = detect_contact(F, F, threshold, None, 5, each)
    used = (touching == 1) & along.any(axis=1)
    if used.sum() < PARTS:
        raise DataError(
            "there are too few samples that move in contact for a coefficient of friction to be told"
        )
    push = -np.einsum("nm,nm->n", F[used], along[used])
    across = np.linalg.norm(remove_along(F[used], along[used]), axis=1)
    part = PARTS * np.arange(len(push)) // len(push)
    products, squares = (np.bincount(part, values) for values in (across * push, across**2))
    coefficient = products.sum() / squares.sum()
    others = (products.sum() - products) / (squares.sum() - squares)
    error = float(np.sqrt((PARTS - 1) / PARTS * np.sum((others - others.mean()) ** 2)))
    total = float(push @ push)
    explained = 1.0 - float(np.sum((push - coefficient * across) ** 2)) / total if total > 0 else 0.0
    return Friction(float(coefficient), error, explained)
