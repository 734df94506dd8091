"""Errors and scores of policies and constraints: mean squared errors that differ only in the projection before them.

With predictions `p_n` of a model, every error here is a mean over samples,

    E = 1/N Σ_n ‖Q_n (u_n - p_n)‖²,

where the rows of `Q_n` (k x d) are the directions of the action in which the two are compared:

| error                            | Q_n          | error of a sample     | needs                            |
| -------------------------------- | ------------ | --------------------- | -------------------------------- |
| `direct`                         | I            | ‖u_n - p_n‖²          | recordings                       |
| `inconsistency`                  | û_nᵀ         | (r_n - û_nᵀ p_n)²     | recordings                       |
| `inconsistency`, some N_n known  | N_n or û_nᵀ  | either of the two     | recordings and some projections  |
| `constrained_policy_error`       | N_n          | ‖N_n (π_n - p_n)‖²    | true policy and projections      |
| `unconstrained_policy_error`     | I            | ‖π_n - p_n‖²          | true policy                      |

with `r = ‖u‖` and `û = u / r`. The line `û ûᵀ` lies in the image of the unknown `N`, so the true policy has no
inconsistency, whatever the constraints were. For every model

    inconsistency <= inconsistency with known projections <= constrained policy error <= unconstrained policy error.

Source: Howard, Klanke, Gienger, Goerick, Vijayakumar, ICRA 2009, equations (4) to (7).
"""

import numpy as np
from numpy.typing import ArrayLike

from unconstrain.arrays import (
    SQUARABLE,
    check_actions,
    check_number,
    check_numbers,
    check_projections,
    check_squarable,
)
from unconstrain.errors import DataError
from unconstrain.motion import directions

__all__ = [
    "constrained_policy_error",
    "direct",
    "explained",
    "free_error",
    "inconsistency",
    "mean_angle",
    "normalized",
    "projected_observation_error",
    "projected_policy_error",
    "root_mean_square",
    "shown_error",
    "unconstrained_policy_error",
]


def inconsistency(U: ArrayLike, P: ArrayLike, projections: ArrayLike | None = None) -> float:
    """Compare predictions with actions in the directions that were surely free: the mean inconsistency.

    Parameters
    ----------
    U : array_like of shape (N, d)
        Recorded actions.
    P : array_like of shape (N, d)
        Predicted actions, in the same unit.
    projections : array_like of shape (N, d, d), optional
        Nullspace projections. A sample whose projection is known contributes `‖N (u - p)‖²`, which asks more of the
        model than its direction does; a sample whose projection is not known is all NaN here.

    Returns
    -------
    float
        `1/N Σ (r_n - û_nᵀ p_n)²`, in squared units of the action.

    Raises
    ------
    DataError
        If shapes do not match, entries are not finite, or a matrix is no projection.

    Notes
    -----
    Actions of zero length have no direction. They add nothing to the sum, unless their projection is known, and are
    counted in N: so the inconsistency is never above the constrained policy error.
    """
    U, P = _check_pair(U, P, "actions", "predictions")
    unit, r = directions(U)
    error = (r - np.einsum("nd,nd->n", unit, P)) ** 2
    if projections is not None:
        N = check_projections(projections, *U.shape, unknown=True)
        known = ~np.isnan(N).any(axis=(1, 2))
        error[known] = _squares(np.einsum("nij,nj->ni", N[known], U[known] - P[known]))
    return float(np.mean(error))


def direct(U: ArrayLike, P: ArrayLike) -> float:
    """Compare predictions with whole actions: the mean squared error that ordinary regression minimises.

    Parameters
    ----------
    U : array_like of shape (N, d)
        Recorded actions.
    P : array_like of shape (N, d)
        Predicted actions, in the same unit.

    Returns
    -------
    float
        `1/N Σ ‖u_n - p_n‖²`, in squared units of the action.

    Raises
    ------
    DataError
        If shapes do not match or entries are not finite.
    """
    U, P = _check_pair(U, P, "actions", "predictions")
    return float(np.mean(_squares(U - P)))


def constrained_policy_error(Pi: ArrayLike, P: ArrayLike, N: ArrayLike) -> float:
    """Compare predictions with the true policy as far as the constraints let it show (CPE).

    Parameters
    ----------
    Pi : array_like of shape (N, d)
        Actions of the true policy, or the constrained actions `N π`, which give the same.
    P : array_like of shape (N, d)
        Predicted actions, in the same unit.
    N : array_like of shape (N, d, d)
        True nullspace projections.

    Returns
    -------
    float
        `1/N Σ ‖N_n (π_n - p_n)‖²`, in squared units of the action.

    Raises
    ------
    DataError
        If shapes do not match, entries are not finite, or a matrix is no projection.
    """
    Pi, P = _check_pair(Pi, P, "the true policy", "predictions")
    N = check_projections(N, *Pi.shape)
    return float(np.mean(_squares(np.einsum("nij,nj->ni", N, Pi - P))))


def unconstrained_policy_error(Pi: ArrayLike, P: ArrayLike) -> float:
    """Compare predictions with the true policy (UPE).

    Parameters
    ----------
    Pi : array_like of shape (N, d)
        Actions of the true policy.
    P : array_like of shape (N, d)
        Predicted actions, in the same unit.

    Returns
    -------
    float
        `1/N Σ ‖π_n - p_n‖²`, in squared units of the action.

    Raises
    ------
    DataError
        If shapes do not match or entries are not finite.
    """
    Pi, P = _check_pair(Pi, P, "the true policy", "predictions")
    return float(np.mean(_squares(Pi - P)))


def projected_policy_error(Pi: ArrayLike, N: ArrayLike, learnt: ArrayLike) -> float:
    """Compare what a learnt constraint leaves of the true policy with what the true constraint leaves (PPE).

    Parameters
    ----------
    Pi : array_like of shape (N, d)
        Actions of the true policy.
    N : array_like of shape (N, d, d)
        True nullspace projections.
    learnt : array_like of shape (N, d, d)
        Learnt nullspace projections.

    Returns
    -------
    float
        `1/N Σ ‖N_n π_n - Ñ_n π_n‖²`, in squared units of the action. ``normalized(error, Pi)`` is the nPPE.

    Raises
    ------
    DataError
        If shapes do not match, entries are not finite, or a matrix is no projection.

    References
    ----------
    Lin, Howard, Vijayakumar, "Learning null space projections", ICRA 2015.
    """
    Pi = check_actions(Pi, "the true policy")
    check_squarable("the true policy's actions", Pi)
    N, learnt = check_projections(N, *Pi.shape), check_projections(learnt, *Pi.shape)
    return float(np.mean(_squares(np.einsum("nij,nj->ni", N - learnt, Pi))))


def projected_observation_error(U: ArrayLike, learnt: ArrayLike) -> float:
    """Measure the motion that a learnt constraint would have blocked, although it was recorded (POE).

    Parameters
    ----------
    U : array_like of shape (N, d)
        Recorded actions, or their nullspace component.
    learnt : array_like of shape (N, d, d)
        Learnt nullspace projections.

    Returns
    -------
    float
        `1/N Σ ‖u_n - Ñ_n u_n‖²`, in squared units of the action. ``normalized(error, U)`` is the nPOE.

    Raises
    ------
    DataError
        If shapes do not match, entries are not finite, or a matrix is no projection.

    References
    ----------
    Lin, Howard, Vijayakumar, "Learning null space projections", ICRA 2015.
    """
    U = check_actions(U)
    check_squarable("actions", U)
    learnt = check_projections(learnt, *U.shape)
    return float(np.mean(_squares(U - np.einsum("nij,nj->ni", learnt, U))))


def normalized(error: float, Pi: ArrayLike) -> float:
    """Express a mean error as a share of the true policy's variance.

    Parameters
    ----------
    error : float
        An error of this module, in squared units of the action.
    Pi : array_like of shape (N, d)
        Actions of the true policy; recorded actions may stand for it where it is not known.

    Returns
    -------
    float
        `error / Σ_j var(π_j)`: the paper's nUPE, nCPE and normalised inconsistency.

    Raises
    ------
    DataError
        If the policy does not vary.
    """
    Pi = check_actions(Pi, "the true policy")
    if not len(Pi):
        raise DataError("no samples: the variance of the true policy needs at least one")
    check_squarable("the true policy's actions", Pi)
    variance = float(np.sum(np.var(Pi, axis=0)))
    if variance == 0.0:
        raise DataError(
            "the true policy is the same at every sample, so no error can be a share of its variance"
        )
    return check_number(error, "the error", positive=False) / variance


def explained(U: ArrayLike, P: ArrayLike, free: ArrayLike | None = None) -> float:
    """Compute the share of observed motion that predictions explain.

    Parameters
    ----------
    U : array_like of shape (N, d)
        Recorded actions, of any magnitude.
    P : array_like of shape (N, d)
        Predicted actions, in the same unit.
    free : array_like of shape (N,), optional
        Probability γ that nothing was in the way of a sample; 0 by default.

    Returns
    -------
    float
        `1 - Σ [γ ‖u - p‖² + (1 - γ) (r - û·p)²] / Σ r²`: 1 for a policy consistent with every sample, 0 for one that
        says "do not move", negative for a policy that is worse than that.

    Raises
    ------
    DataError
        If nothing moves, shapes do not match, or entries are not finite.
    """
    U, P = _check_shapes(U, P, "actions", "predictions")
    largest = np.abs(U).max(initial=0.0)
    if largest == 0.0:
        raise DataError("all actions are zero: there is no motion to explain")
    if np.abs(P).max(initial=0.0) / SQUARABLE > largest:
        raise DataError(
            "predictions are so much larger than the actions that their squares cannot be compared"
        )
    U, P = np.asarray(U / largest), np.asarray(P / largest)
    motion = float(np.mean(_squares(U)))
    if free is None:
        return 1.0 - inconsistency(U, P) / motion
    return 1.0 - shown_error(U, P, free) / motion


def shown_error(U: ArrayLike, P: ArrayLike, free: ArrayLike) -> float:
    """Compare predictions with what recordings show: whole actions where they were free, their motion elsewhere.

    Parameters
    ----------
    U : array_like of shape (N, d)
        Recorded actions.
    P : array_like of shape (N, d)
        Predicted actions, in the same unit.
    free : array_like of shape (N,)
        Probability γ that nothing was in the way of a sample, such as a policy's `free_probability`.

    Returns
    -------
    float
        `1/N Σ [γ ‖u - p‖² + (1 - γ) (r - ûᵀp)²]`, in squared units of the action.

    Raises
    ------
    DataError
        If shapes do not match, entries are not finite, or a probability is none.
    """
    U, P = _check_pair(U, P, "actions", "predictions")
    gamma = _check_probabilities(free, len(U))
    unit, r = directions(U)
    along = (r - np.einsum("nd,nd->n", unit, P)) ** 2
    return float(np.mean(gamma * _squares(U - P) + (1 - gamma) * along))


def free_error(U: ArrayLike, P: ArrayLike, free: ArrayLike) -> float:
    """Compare predictions with whole actions, on samples that were free.

    Parameters
    ----------
    U : array_like of shape (N, d)
        Recorded actions.
    P : array_like of shape (N, d)
        Predicted actions, in the same unit.
    free : array_like of shape (N,)
        Probability γ that nothing was in the way of a sample, inferred or known.

    Returns
    -------
    float
        `Σ γ ‖u - p‖² / Σ γ`, in squared units of the action.

    Raises
    ------
    DataError
        If shapes do not match, entries are not finite, a probability is none, or nothing was free.
    """
    U, P = _check_pair(U, P, "actions", "predictions")
    gamma = _check_probabilities(free, len(U))
    if not gamma.any():
        raise DataError("no sample is free, so there is no whole action to compare with")
    return float(gamma @ _squares(U - P) / gamma.sum())


def root_mean_square(U: ArrayLike, P: ArrayLike) -> float:
    """Compute the root mean square length of the difference between predictions and actions.

    Parameters
    ----------
    U : array_like of shape (N, d)
        Recorded actions, or those of the true policy.
    P : array_like of shape (N, d)
        Predicted actions, in the same unit.

    Returns
    -------
    float
        `√(1/N Σ ‖u - p‖²)`, in the unit of the actions.

    Raises
    ------
    DataError
        If shapes do not match or entries are not finite.
    """
    return float(np.sqrt(direct(U, P)))


def mean_angle(U: ArrayLike, P: ArrayLike) -> float:
    """Compute the mean angle between predictions and actions.

    Parameters
    ----------
    U : array_like of shape (N, d)
        Recorded actions, or those of the true policy.
    P : array_like of shape (N, d)
        Predicted actions.

    Returns
    -------
    float
        In radians, 0 to π. Samples at which either does not move have no angle, and are left out.

    Raises
    ------
    DataError
        If shapes do not match, entries are not finite, or nothing moves.
    """
    U, P = _check_shapes(U, P, "actions", "predictions")
    (u, r), (p, q) = directions(U), directions(P)
    both = (r > 0) & (q > 0)
    if not both.any():
        raise DataError("no sample at which both move: there is no angle between them")
    u, p = u[both], p[both]
    # Accurate where they nearly agree, unlike the cosine's inverse.
    return float(np.mean(2 * np.arctan2(np.linalg.norm(u - p, axis=1), np.linalg.norm(u + p, axis=1))))


def _check_probabilities(free: ArrayLike, n_samples: int) -> np.ndarray:
    gamma = check_numbers(free, "free")
    if gamma.shape != (n_samples,) or not np.all((gamma >= 0) & (gamma <= 1)):
        raise DataError(f"free must hold {n_samples} probabilities, one for each sample, of 0 to 1")
    return gamma


def _squares(E: np.ndarray) -> np.ndarray:
    """Compute `‖e‖²` of the rows of E (N, d): (N,)."""
    return np.einsum("nd,nd->n", E, E)


def _check_pair(A: ArrayLike, B: ArrayLike, name_a: str, name_b: str) -> tuple[np.ndarray, np.ndarray]:
    """Check two arrays (N, d) that are compared in squared units."""
    A, B = _check_shapes(A, B, name_a, name_b)
    check_squarable(f"{name_a} and {name_b}", A, B)
    return A, B


def _check_shapes(A: ArrayLike, B: ArrayLike, name_a: str, name_b: str) -> tuple[np.ndarray, np.ndarray]:
    A, B = check_actions(A, name_a), check_actions(B, name_b)
    if A.shape != B.shape:
        hint = ": did you mean the transpose?" if A.shape == B.shape[::-1] else ""
        raise DataError(f"{name_a} {A.shape} and {name_b} {B.shape} must have the same shape{hint}")
    if not len(A):
        raise DataError("no samples: a mean error needs at least one")
    return A, B
