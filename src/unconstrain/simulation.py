"""Follow a policy through time, freely or under a constraint."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from unconstrain.constraints import projection
from unconstrain.errors import DataError, PolicyError, UnconstrainError

Array = NDArray[np.float64]
Constraint = ArrayLike | Callable[[Array], ArrayLike]


@dataclass(frozen=True)
class Rollout:
    """Where a policy led, from one start or from S at once.

    Attributes
    ----------
    states : array (steps + 1, n) or (S, steps + 1, n)
        The start first, the state after the last step last.
    actions : array (steps, n) or (S, steps, n)
        What was done at each state but the last, ``N π(x)``, in state units per second.
    time : array (steps + 1,)
        Seconds since the start.
    """

    states: Array
    actions: Array
    time: Array


def rollout(
    policy: Any,
    start: ArrayLike,
    steps: int,
    dt: float,
    constraint: Constraint | None = None,
    *,
    stop_when: Callable[[Array], ArrayLike] | None = None,
) -> Rollout:
    """Integrate a policy whose actions are velocities of its state: ``x_{k+1} = x_k + dt N(x_k) π(x_k)``.

    Parameters
    ----------
    policy : object with ``predict(X)``, or callable ``X -> U``
        Maps states (S, n) to actions (S, n): a fitted policy of this library, or any function.
    start : array (n,) or (S, n)
        One start, or several that are followed side by side.
    steps : int
        Number of steps, at least 1.
    dt : float
        Duration of a step in seconds.
    constraint : array (k, n), callable, or None
        Rows ``A`` with ``A u = 0``, the same at every state; or a function that is given the current states
        (S, n) and returns the rows at each, (S, k, n), or (k, n) where all share them. Without it the
        policy moves freely.
    stop_when : callable, optional
        Is given the current states (S, n); where it says true for any of them the movement ends, with fewer steps.
        `uncertainty.Unsure` ends it where the policy is not known.

    Raises
    ------
    PolicyError
        If the start does not fit the policy, or its actions are not velocities of its state (d ≠ n).
    DataError
        If the start or the constraint is not finite or of the wrong shape.
    UnconstrainError
        If `steps` or `dt` is not positive, or the state grows beyond all bounds (it says at which step).
    """
    predict = policy.predict if hasattr(policy, "predict") else policy
    if not callable(predict):
        raise PolicyError(
            f"a rollout needs a policy with a predict method, or a function of states, not {policy!r:.60}"
        )
    if isinstance(steps, bool) or steps != int(steps) or steps < 1:
        raise UnconstrainError(f"a rollout needs a whole number of steps, at least 1, not {steps}")
    if not (np.isfinite(dt) and dt > 0):
        raise UnconstrainError(f"the time step dt must be a positive number of seconds, not {dt}")
    steps, single = int(steps), np.ndim(start) == 1
    x = _checked_start(start, getattr(policy, "n_features_in_", None))

    fixed = None if constraint is None or callable(constraint) else _projection(constraint, x.shape)
    states = np.empty((len(x), steps + 1, x.shape[1]))
    actions = np.empty((len(x), steps, x.shape[1]))
    states[:, 0] = x
    # A policy may overflow on its way out of all bounds; the sentence below says so better than a warning.
    with np.errstate(over="ignore", invalid="ignore"):
        for k in range(steps):
            if stop_when is not None and np.any(stop_when(x)):
                states, actions = states[:, : k + 1], actions[:, :k]
                break
            u = _actions(predict, x)
            N = _projection(constraint(x), x.shape) if callable(constraint) else fixed
            if N is not None:
                u = (N @ u[..., None])[..., 0]
            x = x + dt * u
            if not np.isfinite(x).all():
                raise UnconstrainError(
                    f"the rollout left all bounds at step {k + 1} of {steps} ({(k + 1) * dt:g} s): use a "
                    "smaller time step dt, or start nearer to the data the policy was learnt from"
                )
            actions[:, k] = u
            states[:, k + 1] = x
    time = np.linspace(0.0, actions.shape[1] * dt, actions.shape[1] + 1)
    return Rollout(states[0], actions[0], time) if single else Rollout(states, actions, time)


def _checked_start(start: ArrayLike, expected: int | None) -> Array:
    try:
        x = np.atleast_2d(np.asarray(start, dtype=np.float64))
    except (TypeError, ValueError) as error:
        raise DataError("the start must be numbers: an array (n,), or (S, n) for several starts") from error
    if x.ndim != 2 or x.size == 0:
        raise DataError(f"the start must be an array (n,), or (S, n) for several, not {np.shape(start)}")
    if expected is not None and x.shape[1] != expected:
        raise PolicyError(
            f"the start has {_counted(x.shape[1], 'number')} but the policy was learnt over states of "
            f"{_counted(expected, 'dimension')}: give {expected}"
        )
    if not np.isfinite(x).all():
        row, column = np.argwhere(~np.isfinite(x))[0]
        raise DataError(
            f"the start has NaN or infinity in dimension {column} of start {row}; give finite numbers"
        )
    return x


def _actions(predict: Callable[[Array], ArrayLike], x: Array) -> Array:
    u = np.asarray(predict(x), dtype=np.float64)
    if u.ndim != 2 or len(u) != len(x):
        raise PolicyError(
            f"the policy must map states of shape {x.shape} to one row of actions each, not to {u.shape}"
        )
    if u.shape[1] != x.shape[1]:
        raise PolicyError(
            f"the policy maps {_counted(x.shape[1], 'state')} to {_counted(u.shape[1], 'action')}, and only "
            "velocities of the state, one each, can be rolled out: learn it from such actions"
        )
    return u


def _projection(rows: ArrayLike, shape: tuple[int, ...]) -> Array:
    N = projection(rows)
    if N.shape[-1] != shape[1]:
        raise DataError(
            f"the constraint's rows have {_counted(N.shape[-1], 'number')} but the policy has "
            f"{_counted(shape[1], 'action')}: give one column per action"
        )
    if N.ndim == 3 and len(N) != shape[0]:
        raise DataError(
            f"the constraint gives rows for {_counted(len(N), 'state')} where there "
            f"{'is' if shape[0] == 1 else 'are'} {shape[0]}: return shape (S, k, n), or (k, n) for all alike"
        )
    return N


def _counted(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"
