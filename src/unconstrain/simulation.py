"""Follow a policy through time: the one integrator there is.

`rollout` is for users: a policy, a start, perhaps a constraint. `simulate` is the loop beneath it, open at two
places for plants that are more than that: what projects the policy's action, and how the plant moves on.
"""

import warnings
from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from unconstrain.arrays import check_numbers, quote
from unconstrain.constraints.nullspace import constrain, projection
from unconstrain.errors import DataError, PolicyError, UnconstrainError
from unconstrain.memory import check_memory
from unconstrain.spaces import Numbers, Space
from unconstrain.stopping import (
    OUT_OF_BOUNDS,
    Guard,
    Limits,
    Movement,
    MovementStopped,
    Recorded,
    Stop,
    check_inside,
    describe_stop,
)
from unconstrain.waiting import each, stage

Array = NDArray[np.float64]


class Predictor(Protocol):
    """Anything with a `predict` method: a fitted policy of this library, or any regressor."""

    def predict(self, X: Any, /) -> Any:
        """Predict actions (S, d) at states X (S, n)."""


Policy = Predictor | Callable[[Array], ArrayLike]
"""A fitted policy, or a function from states (S, n) to actions (S, d)."""

Constraint = ArrayLike | Callable[[Array], ArrayLike]
"""Rows A (k, d), or a function from states (S, n) to rows (S, k, d) or (k, d)."""

Project = Callable[[int, Array, Array], Array]
"""From the number of the sample, states (S, n) and the policy's actions (S, d) to projections N (S, d, d)."""

Advance = Callable[[Array, Array], tuple[Array, Array]]
"""From states (S, n) and actions (S, d) to the next states (S, n) and the actions that were carried out (S, d)."""

StopWhen = Callable[[Array], ArrayLike]
"""From states (S, n) to whether the movement ends there, one flag per state or one for all."""


def rollout(
    policy: Policy,
    start: ArrayLike,
    steps: int,
    dt: float,
    constraint: Constraint | None = None,
    *,
    stop_when: StopWhen | None = None,
    beyond: float | None = None,
    limits: Any = None,
) -> Movement:
    """Integrate a policy whose actions are velocities of its state: ``x_{k+1} = x_k + dt N(x_k) π(x_k)``.

    States of a space, such as rotations, are followed within it (`Space.step`); with accelerations for actions, so are
    velocities.

    A movement stops by itself, with a warning, before it leaves what a policy of this library was learnt from, its
    limits, or all bounds; what it reached is returned. A stabilised policy may leave what was recorded, since it leads
    back.

    Parameters
    ----------
    policy : object with ``predict(X)``, or callable ``X -> U``
        Maps states (S, n) to actions (S, n): a fitted policy of this library, or any function.
    start : array_like of shape (n,) or (S, n)
        One start, or several that are followed side by side.
    steps : int
        Number of steps, at least 1.
    dt : float
        Duration of a step in seconds.
    constraint : ndarray of shape (k, n), callable, or None
        Rows ``A`` with ``A u = 0``, the same at every state; or a function that is given the current states
        (S, n) and returns the rows at each, (S, k, n), or (k, n) where all share them. Without it the
        policy moves freely.
    stop_when : callable, optional
        Is given the current states (S, n). Each movement ends at its first state for which it returns true.
    beyond : float, optional
        How far from recorded states a movement may lead, in the policy's `distance_unit_`; by default as far as
        recordings lead from each other (`Policy.usual_distance`), infinite for anywhere, unless it diverges. Functions,
        and policies of others, do not know what was recorded.
    limits : sequence of n pairs, or mapping from str to pairs, optional
        The least and the largest value that each state may have, as those of joints, None where there is none; or by
        the names of the states, {"elbow": (-1.5, 1.5)}.

    Returns
    -------
    Movement
        Demonstrations of ``steps + 1`` samples per start, fewer where one ended; `stopped` says which had to, where and
        why. Samples have the state, the action
        ``N π(x)`` there, the policy's own action ``π(x)`` as `policy`, and the time in seconds. Every start is an
        episode. Under a constraint, `projections` holds N. States have the names that the policy learnt, if it
        knows them.

    Raises
    ------
    PolicyError
        If the start does not fit the policy, or its actions are not velocities of its state (d ≠ n).
    DataError
        If the start or the constraint is not finite or of the wrong shape.
    UnconstrainError
        If `steps` or `dt` is not positive, the samples do not fit into memory, a start is beyond the limits, or the
        action there is not finite.

    Examples
    --------
    >>> from unconstrain.limit_cycle import LimitCycle
    >>> movement = rollout(LimitCycle(), [1.0, 0.0], steps=100, dt=0.02)
    >>> movement.states.shape
    (101, 2)
    """
    if _whole(steps) < 1:
        raise UnconstrainError(f"a rollout needs a whole number of steps, at least 1, not {quote(steps)}")
    guards: list[Guard] = []
    if limits is not None:
        x = _checked_start(start, getattr(policy, "n_features_in_", None))
        held = limits if isinstance(limits, Limits) else Limits(limits, _names(policy, x.shape[1]))
        check_inside(held, x)
        guards.append(held)
    stability = getattr(policy, "stability_", None)
    leads_back = stability is not None and (constraint is None or stability.is_kept_under_constraints)
    if hasattr(policy, "usual_distance") and not leads_back:
        guards.append(Recorded(policy, beyond))
    if constraint is None:
        return simulate(policy, start, steps, dt, stop_when=stop_when, guards=guards)
    if callable(constraint):

        def project(sample: int, X: Array, wanted: Array) -> Array:
            return _one_per_start(projection(constraint(X)), *wanted.shape)

    else:
        fixed = projection(constraint)

        def project(sample: int, X: Array, wanted: Array) -> Array:
            return _one_per_start(fixed, *wanted.shape)

    return simulate(policy, start, steps, dt, project=project, stop_when=stop_when, guards=guards)


@stage("rolling out")
def simulate(
    policy: Policy,
    start: ArrayLike,
    steps: int,
    dt: float,
    *,
    project: Project | None = None,
    advance: Advance | None = None,
    stop_when: StopWhen | None = None,
    guards: Sequence[Guard] = (),
    state_names: Sequence[str] | None = None,
    action_names: Sequence[str] | None = None,
) -> Movement:
    """Let a policy move a plant, and record every sample.

    At sample k the policy is asked for its actions ``π(x_k)``, `project` for the projections ``N``, and `advance`
    is told to carry out ``N π(x_k)`` for the time `dt`.

    Parameters
    ----------
    policy : object with ``predict(X)``, or callable ``X -> U``
        Maps states (S, n) to actions (S, d).
    start : array_like of shape (n,) or (S, n)
        One start, or several that are followed side by side.
    steps : int
        Number of steps between samples, at least 0.
    dt : float
        Time between samples, in seconds.
    project : callable, optional
        ``project(k, X, Pi) -> N``: projections (S, d, d) at states X (S, n) where the policy's actions are Pi (S, d).
        Without it nothing constrains the plant.
    advance : callable, optional
        ``advance(X, U) -> (X, U)``: the states after the time `dt`, and the actions to record, which are those
        carried out. It is called at every sample, the last included, since a plant may know what it did only
        afterwards. By default ``X + dt U, U``, and actions have to be velocities of the state.
    stop_when : callable, optional
        As for `rollout`.
    guards : sequence of callable
        Each says of states (S, n) why a movement may not be there, in a list of texts, empty where it may. It then
        stops before.
    state_names, action_names : sequence of str, optional
        By default the names that the policy learnt, or x1, x2, ...; actions are named after the states' velocities.

    Returns
    -------
    Movement
        As for `rollout`.

    Raises
    ------
    UnconstrainError
        As for `rollout`.
    """
    predict = policy.predict if hasattr(policy, "predict") else policy
    if not callable(predict):
        raise PolicyError(
            f"a rollout needs a policy with a predict method, or a function of states, not {policy!r:.60}"
        )
    samples = _whole(steps) + 1
    if samples < 1:
        raise UnconstrainError(f"a rollout needs a whole number of steps, not {steps}")
    _check_duration(dt)
    x = _checked_start(start, getattr(policy, "n_features_in_", None))
    space = getattr(policy, "space_", None) or Numbers(x.shape[1])
    scale = getattr(policy, "scale_", None)
    under = None
    if getattr(policy, "stability_", None) is not None:
        # A stabilised policy has to know the constraint, and the step: what changes its actions later undoes them.
        stable: Any = policy
        stable = stable.held_for(dt)
        predict, under = stable.predict, stable.predict_constrained
    going: NDArray[np.bool_] = np.ones(len(x), dtype=bool)
    ends, stops = np.full(len(x), samples), list[Stop]()

    def halt(reasons: Sequence[str], step: int) -> None:
        """Stop each movement for which there is a reason, with this step as its last."""
        for start, reason in enumerate(reasons):
            if reason and going[start]:
                going[start], ends[start] = False, step + 1
                stops.append(Stop(start, step, step * dt, states[start, step].copy(), reason))

    # A policy may overflow on its way out of all bounds; the sentence of its stop says so better than a warning.
    with np.errstate(over="ignore", invalid="ignore"):
        for k in each(range(samples), "rolling out", unit="steps"):
            wanted = _actions(predict, x)
            N = None if project is None else project(k, x, wanted)
            if N is None:
                u = wanted
            elif under is not None:
                u = under(x, N)
            else:
                u = constrain(N, wanted, scale)
            if k == 0:
                (S, n), d = x.shape, wanted.shape[1]
                check_size(S, samples, n, d, constrained=N is not None)
                states, policies, actions = (np.empty((S, samples, width)) for width in (n, d, d))
                projections = None if N is None else np.empty((S, samples, d, d))
            if advance is None:
                _check_velocities(space, x, u)
            else:
                following, u = advance(x, u)
            finite = np.asarray(np.isfinite(u).all(axis=1))
            if not finite[going].all() and (k == 0 or advance is not None):
                raise UnconstrainError(
                    f"the actions are not finite at step {k} of {steps} ({k * dt:g} s): use a smaller time step dt, or "
                    "start nearer to the data the policy was learnt from"
                )
            halt(["" if good else OUT_OF_BOUNDS for good in finite], k - 1)
            states[:, k], policies[:, k], actions[:, k] = x, wanted, u
            if projections is not None:
                projections[:, k] = N
            if k == 0:
                halt(_find_reasons(guards, x, going), k)
            if stop_when is not None:
                ended = going & np.asarray(stop_when(x), dtype=bool)
                ends[ended] = k + 1
                going[ended] = False
            if k + 1 == samples or not going.any():
                break
            if advance is None:
                following = space.step(x, np.where(finite[:, None], u, 0.0), dt)
            halt(_find_reasons(guards, following, going), k)
            x = np.where(going[:, None], following, x)

    kept: NDArray[np.bool_] = np.arange(k + 1) < ends[:, None]
    names = _names(policy, x.shape[1]) if state_names is None else tuple(state_names)
    stops.sort(key=lambda stop: stop.episode)
    _warn(stops, steps, names, len(x))
    return Movement(
        states=states[:, : k + 1][kept],
        actions=actions[:, : k + 1][kept],
        episodes=np.repeat(np.arange(len(x)), kept.sum(axis=1)),
        time=np.tile(np.arange(k + 1) * dt, (len(x), 1))[kept],
        policy=policies[:, : k + 1][kept],
        projections=None if projections is None else projections[:, : k + 1][kept],
        state_names=names,
        action_names=_action_names(space, names, actions.shape[-1]) if action_names is None else action_names,
        space=space if advance is None else None,
        stopped=stops,
    )


def _find_reasons(guards: Sequence[Guard], X: Array, going: NDArray[np.bool_]) -> list[str]:
    """Return why each movement may not be in its state (S, n), empty where it may or has ended."""
    finite = np.asarray(np.isfinite(X).all(axis=1))
    reasons = ["" if good else OUT_OF_BOUNDS for good in finite]
    rows = np.flatnonzero(finite & going)
    for guard in guards if len(rows) else ():
        for row, reason in zip(rows.tolist(), guard(X[rows]), strict=True):
            reasons[row] = reasons[row] or reason
    return reasons


def _warn(stops: Sequence[Stop], steps: int, names: Sequence[str], starts: int) -> None:
    if stops:
        of = "" if starts == 1 else f"{len(stops)} of {starts} movements stopped; no. {stops[0].episode} "
        warnings.warn(of + describe_stop(stops[0], steps, names), MovementStopped, stacklevel=4)


def check_size(starts: int, samples: int, n: int, d: int, *, constrained: bool) -> None:
    """Refuse movements that would not fit into memory, before anything is allocated.

    Parameters
    ----------
    starts : int
        Number of movements.
    samples : int
        Number of samples in each.
    n : int
        Dimension of the states.
    d : int
        Dimension of the actions.
    constrained : bool
        Whether there is a projection (d, d) per sample.

    Raises
    ------
    DataError
        If there is not as much memory as the samples would take.
    """
    # States, policy, actions, time, episode; checking and flattening need some of them twice.
    needed = 2.0 * 8 * starts * samples * (n + 2 * d + 2 + constrained * d * d)
    check_memory(
        needed,
        f"a simulation of {_count(samples, 'sample')} from {_count(starts, 'start')}",
        "take fewer steps or fewer starts at a time",
    )


def _whole(steps: Any) -> int:
    """Return the number of steps as an int, -1 if it is not a whole number."""
    try:
        return -1 if isinstance(steps, bool) or steps != int(steps) else int(steps)
    except (TypeError, ValueError, OverflowError):
        return -1


def _check_duration(dt: Any) -> None:
    try:
        usable = bool(np.isfinite(dt) and dt > 0)
    except (TypeError, ValueError, OverflowError):
        usable = False
    if not usable:
        raise UnconstrainError(f"the time step dt must be a positive number of seconds, not {quote(dt)}")


def _checked_start(start: ArrayLike, expected: int | None) -> Array:
    x = np.atleast_2d(check_numbers(start, "the start"))
    if x.ndim != 2 or x.size == 0:
        raise DataError(f"the start must be an array (n,), or (S, n) for several, not {np.shape(start)}")
    if expected is not None and x.shape[1] != expected:
        raise PolicyError(
            f"the start has {_count(x.shape[1], 'number')} but the policy was learnt over states of "
            f"{_count(expected, 'dimension')}: give {expected}"
        )
    if not np.isfinite(x).all():
        row, column = np.argwhere(~np.isfinite(x))[0]
        raise DataError(
            f"the start has NaN or infinity in dimension {column} of start {row}; give finite numbers"
        )
    return x


def _actions(predict: Callable[[Array], ArrayLike], x: Array) -> Array:
    u = np.asarray(predict(x), dtype=np.float64)
    if u.ndim == 1 and x.shape[1] == 1:
        u = u[:, None]  # a policy that learnt actions (N,) predicts them so
    if u.ndim != 2 or len(u) != len(x):
        raise PolicyError(
            f"the policy must map states of shape {x.shape} to one row of actions each, not to {u.shape}"
        )
    return u


def _check_velocities(space: Space, x: Array, u: Array) -> None:
    if u.shape[1] != space.n_actions:
        raise PolicyError(
            f"the policy maps {_count(x.shape[1], 'state')} to {_count(u.shape[1], 'action')}, and only "
            f"velocities of the state, {'one each' if space.is_flat else _count(space.n_actions, 'number')}, can be "
            "rolled out: learn it from such actions"
        )


def _one_per_start(N: Array, starts: int, d: int) -> Array:
    """Projections (S, d, d) of as many or of one (d, d) that all starts share."""
    if N.shape[-1] != d:
        raise DataError(
            f"the constraint's rows have {_count(N.shape[-1], 'number')} but the policy has "
            f"{_count(d, 'action')}: give one column per action"
        )
    if N.ndim == 3 and len(N) != starts:
        raise DataError(
            f"the constraint gives rows for {_count(len(N), 'state')} where there "
            f"{'is' if starts == 1 else 'are'} {starts}: return shape (S, k, n), or (k, n) for all alike"
        )
    return np.broadcast_to(N, (starts, d, d))


def _names(policy: Policy, n: int) -> tuple[str, ...]:
    """Names of the states where the policy learnt distinct ones, else x1, x2, ..."""
    for attribute in ("state_names_", "feature_names_in_"):
        names = tuple(getattr(policy, attribute, ()))
        if len(names) == n and len(set(names)) == n and all(isinstance(name, str) for name in names):
            return names
    return tuple(f"x{i + 1}" for i in range(n))


def _action_names(space: Space, states: tuple[str, ...], d: int) -> tuple[str, ...] | None:
    if not space.is_flat and d == space.n_actions:
        return space.action_names(states)
    return tuple(f"{name}_velocity" for name in states) if len(states) == d else None


def _count(number: int, noun: str) -> str:
    return f"{number:,} {noun}{'' if number == 1 else 's'}"
