"""A policy held against recordings it has not seen: errors of whole actions, and of what the recordings show."""

from dataclasses import dataclass

import numpy as np

from unconstrain import metrics
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError
from unconstrain.policies.base import Policy


@dataclass(frozen=True)
class Line:
    """Errors on some samples.

    Parameters
    ----------
    label : str
        Which they are.
    n_samples : int
        How many.
    free : float
        Share of them that were free, as the policy infers, or as its risk assumes.
    rmse : float
        Root mean square error of the whole action, in units of the policy's scale.
    angle : float
        Mean angle between recorded and predicted action, in radians; NaN where nothing moves.
    explained : float
        Share of what the recordings show that is explained; NaN where nothing moves.
    """

    label: str
    n_samples: int
    free: float
    rmse: float
    angle: float
    explained: float


@dataclass(frozen=True)
class Evaluation:
    """How a policy predicts recordings.

    Parameters
    ----------
    episodes : tuple of Line
        One for each of the first episodes.
    n_more : int
        Episodes besides these.
    total : Line
        All samples.
    free_rmse : float
        Root mean square error of the whole action where samples were free; NaN where none was.
    nupe : float or None
        The normalised error against the true policy, where the recordings carry it.
    """

    episodes: tuple[Line, ...]
    n_more: int
    total: Line
    free_rmse: float
    nupe: float | None = None


def evaluate(policy: Policy, demos: Demonstrations, most_episodes: int = 20) -> Evaluation:
    """Compare a policy's predictions with recordings.

    Parameters
    ----------
    policy : Policy
        Fitted, to others.
    demos : Demonstrations
        N samples.
    most_episodes : int
        How many episodes are listed by themselves.

    Returns
    -------
    Evaluation
        By episode, and of all samples.

    Raises
    ------
    DataError
        The recordings have other numbers of states or actions than the policy.
    """
    U = demos.actions
    if demos.states.shape[1] != policy.n_features_in_ or U.shape[1] != policy.n_actions_:
        raise DataError(
            f"the policy maps {policy.n_features_in_} states to {policy.n_actions_} actions, but the recordings have "
            f"{demos.states.shape[1]} and {U.shape[1]}: choose the columns it was learnt from"
        )
    P = policy.predict(demos.states).reshape(U.shape)
    U, P = policy.scaled(U), policy.scaled(P)
    if policy.solution_.belief is not None:
        free = policy.free_probability(demos)
    else:
        free = np.full(len(U), float(policy.risk == "direct"))
    several = demos.n_episodes > 1
    labels = demos.episode_labels[:most_episodes] if several else []
    nupe = None
    if demos.policy is not None:
        true = policy.scaled(demos.policy)
        nupe = metrics.normalized(metrics.unconstrained_policy_error(true, P), true)
    return Evaluation(
        tuple(_line(label, demos.episodes == code, U, P, free) for code, label in enumerate(labels)),
        demos.n_episodes - len(labels) if several else 0,
        _line("all", np.ones(len(U), dtype=bool), U, P, free),
        float(np.sqrt(metrics.free_error(U, P, free))) if free.any() else np.nan,
        nupe,
    )


def _line(label: str, rows: np.ndarray, U: np.ndarray, P: np.ndarray, free: np.ndarray) -> Line:
    U, P, free = U[rows], P[rows], free[rows]
    moves = bool(np.any(U))
    return Line(
        label,
        len(U),
        float(free.mean()),
        metrics.root_mean_square(U, P),
        metrics.mean_angle(U, P) if moves and np.any(P) else np.nan,
        metrics.explained(U, P, free) if moves else np.nan,
    )
