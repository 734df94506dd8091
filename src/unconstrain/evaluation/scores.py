"""How well predictions agree with recorded actions: one line of an evaluation."""

from dataclasses import dataclass

import numpy as np

from unconstrain.judging import Judge
from unconstrain.motion import directions


@dataclass(frozen=True)
class Score:
    """Errors of one policy on some samples.

    Parameters
    ----------
    name : str
        Of the policy, or of the samples.
    n_samples : int
        How many.
    free : float
        Share of them that were free, as inferred.
    rmse : float
        Root mean square error of the whole action, `√(mean ‖u - p‖²)`, in units of the policy's scale.
    angle : float
        Mean angle between recorded and predicted action, in radians; NaN where nothing moves.
    whole : float
        Share of whole actions explained, `1 - Σ ‖u - p‖² / Σ ‖u‖²`: 0 for standing still. NaN where nothing moves.
    shown : float
        Share explained of what the recordings show of a policy, `1 - Σ [γ ‖u - p‖² + (1 - γ) (r - ûᵀp)²] / Σ ‖u‖²`;
        where a projection N is known, of what that lets through.
    log_likelihood : float
        Of a sample, in nats; NaN where it is not known.
    """

    name: str
    n_samples: int
    free: float
    rmse: float
    angle: float
    whole: float
    shown: float
    log_likelihood: float = np.nan


def score(
    name: str,
    U: np.ndarray,
    P: np.ndarray,
    judge: Judge,
    log_likelihood: float = np.nan,
    rows: np.ndarray | None = None,
) -> Score:
    """Compare predictions with recorded actions.

    Parameters
    ----------
    name : str
        Of the line.
    U, P : ndarray of shape (N, d)
        Recorded and predicted actions, in units of the policy's scale.
    judge : Judge
        Says which samples were free, and what is known of the others.
    log_likelihood : float
        Of a sample, where it is known.
    rows : ndarray of shape (N,), bool, optional
        The samples that count; by default all.

    Returns
    -------
    Score
        Of these samples.
    """
    with np.errstate(over="ignore", invalid="ignore"):  # a policy may say 1e200, which is as bad as infinity
        shown, free = judge.unexplained(U, P), judge.free
        if rows is not None:
            U, P, shown, free = U[rows], P[rows], shown[rows], free[rows]
        (unit, r), (towards, speed) = directions(U), directions(P)
        missed = np.einsum("nd,nd->n", U - P, U - P)
        motion = float(r @ r)
        both = (r > 0) & (speed > 0)
        apart, together = (np.linalg.norm(each[both], axis=1) for each in (unit - towards, unit + towards))
        return Score(
            name,
            len(U),
            float(free.mean()),
            float(np.sqrt(missed.mean())),
            float(np.mean(2 * np.arctan2(apart, together))) if both.any() else np.nan,
            1.0 - float(missed.sum()) / motion if motion > 0 else np.nan,
            1.0 - float(shown.sum()) / motion if motion > 0 else np.nan,
            log_likelihood,
        )


def find_typical(U: np.ndarray, P: np.ndarray, judge: Judge, episodes: np.ndarray) -> float:
    """Find what is explained of the middle one of the episodes, which one far from all others does not spoil.

    Parameters
    ----------
    U, P : ndarray of shape (N, d)
        Recorded and predicted actions.
    judge : Judge
        Says what is shown.
    episodes : ndarray of shape (N,), int
        Codes from 0, of which each sample is.

    Returns
    -------
    float
        A share; NaN where there is one episode alone.
    """
    if not episodes.any():
        return np.nan
    with np.errstate(over="ignore", invalid="ignore"):
        missed = np.bincount(episodes, judge.unexplained(U, P))
        motion = np.bincount(episodes, np.einsum("nd,nd->n", U, U))
        return float(np.median(1 - missed[motion > 0] / motion[motion > 0])) if motion.any() else np.nan


def gaussian_log_likelihood(U: np.ndarray, P: np.ndarray) -> float:
    """Compute the log-likelihood of a sample if all were free, with the noise that makes it largest.

    Parameters
    ----------
    U, P : ndarray of shape (N, d)
        Recorded and predicted actions.

    Returns
    -------
    float
        `-d/2 (log 2πσ² + 1)` with `σ² = mean ‖u - p‖² / d`, in nats; infinite where there is no error.
    """
    d = U.shape[1]
    with np.errstate(over="ignore", divide="ignore"):
        variance = np.mean((U - P) ** 2)
        return float(-0.5 * d * (np.log(2 * np.pi * variance) + 1))
