"""What else may explain a motion, tried: a linear model, a goal, a centre that moves, velocity, phase."""

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from sklearn.base import clone

from unconstrain import waiting
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import UnconstrainError
from unconstrain.evaluation.jumps import Jumps, find_jumps
from unconstrain.evaluation.turns import find_turn
from unconstrain.policies import ParametricPolicy
from unconstrain.policies.base import Policy
from unconstrain.policies.inferred import finds_no_contact
from unconstrain.policies.linear import LinearPolicy
from unconstrain.recordings.derivative import differentiate, longest_window
from unconstrain.recordings.phase import add_phase
from unconstrain.recordings.relative import GOAL, START, end_of, moving_centre
from unconstrain.recordings.smoothing import find_smoothing
from unconstrain.selection import select_policy
from unconstrain.spaces import Numbers, Phased, SecondOrder
from unconstrain.spaces.frames import relate

Array = NDArray[np.float64]

MOST_SAMPLES = 3000
"""More are thinned evenly along episodes: it is to be seen what helps, not by how much exactly."""

HELPS = 0.6
"""What is left unexplained has to fall to this share, or else the alternative is not worth its option."""

AS_GOOD = 0.05
"""Of alternatives that explain as much as the best but for this, the one that asks least of the robot is named."""

MOST_INFERRED = 3
"""Of so many views that explain most by ordinary regression it is tried what inference of contact explains."""

LARGEST, LARGEST_LINEAR = 300, 1500
"""Parameters of a linear policy of the states up to which the policy's own model is tried, and a linear one: of many
dimensions fits take minutes."""

LINEAR = "a linear model"

SMOOTHED = 0.4
"""Standard deviation over which a centre is smoothed, in turns: 4 % of a turn is left in it."""


@dataclass(frozen=True)
class Alternative:
    """Something that position was replaced by, or that was added to it.

    Parameters
    ----------
    meaning : str
        What it is, in words: "velocity".
    option : str
        Of `unconstrain fit`: "--order 2".
    explained : float
        Share explained of what held-out recordings show.
    """

    meaning: str
    option: str
    explained: float


def try_alternatives(
    policy: Policy,
    demos: Demonstrations,
    *,
    without: Collection[str] = (),
    progress: Callable[[str], None] | None = None,
) -> list[Alternative]:
    """Fit the same model to other views of the same recordings, and see how much of held-out episodes these explain.

    Parameters
    ----------
    policy : Policy
        The model; it is cloned.
    demos : Demonstrations
        With time, or else nothing can be tried that needs it.
    without : collection of str
        Options that are not tried, since the recordings were read with them: "relative_to", "moving_centre", "order",
        "phase".
    progress : callable, optional
        Called with what is tried.

    Returns
    -------
    list of Alternative
        In the order of what they ask of the robot: a goal first, phase last, which binds it to the clock.
    """
    views = []
    jumps = find_jumps(demos.actions) if demos.time is not None else None
    limit = "" if jumps is None else f"--max-speed {jumps.max_speed:g}"
    ways = list(_list_views(demos, jumps, without))
    for meaning, options, make in waiting.each(ways, "trying what may be missing", unit="ways"):
        if progress is not None:
            progress(f"trying {meaning}")
        try:
            view = _thin(make(), jumps)
        except UnconstrainError:  # episodes too short to be differentiated, say
            continue
        for model, name in _list_models(policy, meaning, view):
            option = " ".join(word for word in (limit, options, name) if word)
            explained = _explain(model, "direct", view)
            if explained is not None:
                views.append((Alternative(meaning, option, explained), model, view))
    if policy.risk == "direct" or finds_no_contact(policy):
        return [each for each, _, _ in views]
    # Inferring contact takes long, and helps little where ordinary regression sees nothing better.
    promising = sorted(views, key=lambda each: each[0].explained)[-MOST_INFERRED:]
    tried = []
    for each, model, view in waiting.each(views, "inferring contact with what may be missing", unit="ways"):
        if any(view is other for _, _, other in promising):
            inferred = _explain(model, policy.risk, view)
            each = replace(each, explained=max(each.explained, inferred or 0.0))
        tried.append(each)
    return tried


def _explain(model: Policy, risk: str, view: Demonstrations) -> float | None:
    """Return the share explained of what held-out episodes of a view show; None where it cannot be fitted."""
    try:
        table = select_policy([clone(model).set_params(risk=risk)], view, groups=view.folds()).table
    except UnconstrainError:  # nothing moves any more, say
        return None
    (row,) = table
    return row.explained


def _list_models(policy: Policy, meaning: str, view: Demonstrations) -> list[tuple[Policy, str]]:
    """List the models to be tried: the policy's own, unless that takes long, and the simplest."""
    size = view.actions.shape[1] * (view.states.shape[1] + 1)
    own = clone(policy).set_params(space=None, scale=None, noise=None)
    simplest = ParametricPolicy(alpha=getattr(policy, "alpha", "cv"))
    is_simplest = isinstance(policy, ParametricPolicy) and policy.features is None
    is_quick = isinstance(policy, LinearPolicy) and size <= LARGEST
    models: list[tuple[Policy, str]] = [(own, "")] if is_quick and meaning != LINEAR else []
    if size <= LARGEST_LINEAR and not (is_simplest and (models or meaning == LINEAR)):
        models.append((simplest, "" if is_simplest else "--model linear"))
    return models


def choose_missing(explained: float, tried: list[Alternative]) -> Alternative | None:
    """Choose what is missing.

    Parameters
    ----------
    explained : float
        What position explains.
    tried : list of Alternative
        As `try_alternatives` returns them.

    Returns
    -------
    Alternative or None
        The first that explains nearly as much as the best; None where none helps.
    """
    helping = [each for each in tried if 1 - each.explained < HELPS * (1 - explained)]
    best = max((each.explained for each in helping), default=0.0)
    return next((each for each in helping if each.explained > best - AS_GOOD), None)


def _list_views(
    demos: Demonstrations, jumps: Jumps | None, without: Collection[str]
) -> Iterator[tuple[str, str, Callable[[], Demonstrations]]]:
    space, time = demos.space, demos.time
    if jumps is not None:
        yield "its fastest samples left out", "", lambda: demos
    else:
        yield LINEAR, "", lambda: demos
    moves = demos.actions.shape[1] == space.n_actions
    several = demos.n_episodes > 1
    first_order = not isinstance(space, SecondOrder)
    if several and moves and "relative_to" not in without:
        yield "where it ends (the goal)", "--relative-to goal", lambda: _relate(demos, GOAL)
        yield "where it starts", "--relative-to start", lambda: _relate(demos, START)
    if time is None or not first_order:
        return
    if isinstance(space, Numbers) and moves and "moving_centre" not in without:
        turn = find_turn(demos)
        if turn is not None:
            seconds = float(f"{SMOOTHED * turn:.2g}")
            yield "a centre that moves", f"--moving-centre {seconds:g}", lambda: _centre(demos, seconds)
    if moves and "order" not in without:
        yield "velocity", "--order 2", lambda: _accelerate(demos)
    if "phase" not in without and not isinstance(space, Phased):
        yield "phase (how far it has come)", "--phase", lambda: add_phase(demos)


def _relate(demos: Demonstrations, to: str) -> Demonstrations:
    X, U = demos.states.copy(), demos.actions.copy()
    for own in _episodes(demos):
        end = np.tile(end_of(demos.states[own], to), (int(own.sum()), 1))
        X[own], U[own] = relate(demos.space, X[own], U[own], end, np.zeros_like(U[own]))
        X[own] = demos.space.follow(X[own])
    return replace(demos, states=X, actions=U, policy=None, projections=None)


def _centre(demos: Demonstrations, seconds: float) -> Demonstrations:
    assert demos.time is not None
    X, U = demos.states.copy(), demos.actions.copy()
    for own in _episodes(demos):
        for each in (X, U):
            each[own] -= moving_centre(each[own], demos.time[own], seconds)
    return replace(demos, states=X, actions=U, policy=None, projections=None)


def _accelerate(demos: Demonstrations) -> Demonstrations:
    assert demos.time is not None
    U = np.empty_like(demos.actions)
    smoothing = find_smoothing(demos.actions, demos.time, demos.episodes)
    for own in _episodes(demos):
        time = demos.time[own]
        found = 2 * float(np.median(np.diff(time))) if smoothing is None else smoothing.window
        U[own] = differentiate(demos.actions[own], time, window=min(found, longest_window(time)))
    X = np.hstack([demos.states, demos.actions])
    return Demonstrations(X, U, demos.episodes, demos.time, space=SecondOrder(demos.space))


def _thin(demos: Demonstrations, jumps: Jumps | None) -> Demonstrations:
    if jumps is not None:
        demos = demos.select(~jumps.are)
    step = -(-len(demos) // MOST_SAMPLES)
    return demos if step == 1 else demos.select(slice(None, None, step))


def _episodes(demos: Demonstrations) -> Iterator[NDArray[np.bool_]]:
    for k in range(demos.n_episodes):
        yield demos.episodes == k
