"""The function `view`: look at a policy, its recordings and where it leads."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.utils.validation import check_is_fitted

from unconstrain.arrays import check_whole
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError, PolicyError
from unconstrain.policies.base import Policy
from unconstrain.spaces import SecondOrder
from unconstrain.viewer import samples, server
from unconstrain.viewer.coordinates import Axes, Coordinates, Picked
from unconstrain.viewer.following import USUAL
from unconstrain.viewer.frame import Frame
from unconstrain.viewer.page import Page
from unconstrain.viewer.stage import DIRECT, LEARNT, Stage
from unconstrain.waiting import stage

if TYPE_CHECKING:
    from unconstrain.robots.robot import Robot

Array = NDArray[np.float64]

LASTS = 1.5
"""How long a rollout lasts at first, in durations of a recorded movement."""
SECONDS = 4.0
"""How long, where recordings have no time."""


@stage("drawing")
def view(
    policy: Policy,
    demos: Demonstrations | None = None,
    *,
    coordinates: Sequence[int] | None = None,
    robot: "Robot | str | PathLike[str] | None" = None,
    site: str | None = None,
    lock: Iterable[str] | Mapping[str, float] = (),
    constraint: Any = None,
    host: str = server.HOST,
    port: int = server.PORT,
) -> Page:
    """Open a page in the browser: recorded movements, the learnt field, and a rollout from a start that is dragged.

    Parameters
    ----------
    policy : Policy
        Fitted. Its actions are velocities of its states, or accelerations where states have velocities.
    demos : Demonstrations, optional
        Recordings. Without them, the places where the policy was learnt are shown.
    coordinates : sequence of int, optional
        Which two or three of the states are shown, counted from 0; by default the first. The page changes it.
    robot : Robot or path, optional
        A robot (MJCF or URDF) whose joints the states are: its hand is shown in place of states. Needs the extra `sim`.
    site : str, optional
        The frame of the robot that is shown; by default its last one.
    lock : iterable of str, or mapping from str to float
        Joints of the robot that hold still, as for `robots.Robot`, where it is given as a path.
    constraint : array_like of shape (k, d) or callable, optional
        Rows A with A u = 0 under which the rollout is followed, or a function that returns them for states (S, n).
    host : str
        The address to listen at; by default this computer only.
    port : int
        The port, 0 for any that is free.

    Returns
    -------
    Page
        That is served already: open its `url`, or go on in Python; `wait()` keeps a program alive for it, and `close()`
        ends it.

    Raises
    ------
    UnconstrainError
        The extra `view` is not installed, or the port is taken.
    PolicyError
        The policy's actions are not velocities or accelerations of its states.
    DataError
        Recordings, coordinates or robot do not go with the policy.

    Examples
    --------
    >>> page = view(policy, demos)                                  # doctest: +SKIP
    >>> page.url                                                    # doctest: +SKIP
    'http://localhost:8080'
    >>> page.wait()                                                 # doctest: +SKIP
    """
    _check(policy, demos)
    if robot is None and (site is not None or lock):
        raise DataError(f"{'lock' if site is None else 'site'}= is of a robot: name its file with robot=")
    port = check_whole(port, "port", least=0, most=65535)
    notes: list[str] = []
    shown = samples.choose(policy, demos)
    notes += shown.notes
    X = shown.demos.states
    names = shown.demos.state_names
    axes = Axes(policy.space_, names, X[len(X) // 2])
    seen: Coordinates
    if robot is not None:
        seen = _hand(robot, site, lock, policy, names, notes)
    else:
        which = range(min(3, len(axes.names))) if coordinates is None else coordinates
        seen = Picked(axes, which)
    under = None if constraint is None else _rows(constraint, policy.n_actions_)
    policies = {LEARNT: policy}
    other = policy.ordinary_regression()
    if policy.risk == "direct":
        notes.append("the policy is ordinary regression")
    elif other is None:
        notes.append("ordinary regression is not shown: the policy does not remember it")
    else:
        policies[DIRECT] = other
    if isinstance(policy.space_, SecondOrder):
        notes.append(
            "actions are accelerations, so there are no arrows over places, and nothing can be put in a rollout's way"
        )
    served = server.start(host, port)
    stage = Stage(
        server=served,
        policies=policies,
        shown=shown,
        axes=axes,
        scenery=(seen, Frame.around(seen.place(X), in_metres=robot is not None)),
        start=X[0].copy(),
        seconds=_duration(shown.demos if demos is None else demos),
        interval=_interval(demos),
        under=under,
    )
    try:
        draw = _draw_robot(served, seen, notes)
        page = Page(stage, demos, notes)
        if draw is not None:
            page.on_state(draw)
        return page
    except BaseException:
        server.stop(served)
        raise


def _check(policy: Policy, demos: Demonstrations | None) -> None:
    if not isinstance(policy, Policy):
        raise PolicyError(f"view shows a policy of unconstrain, got {type(policy).__name__}")
    check_is_fitted(policy)
    n, d, space = policy.n_features_in_, policy.n_actions_, policy.space_
    if d != space.n_actions:
        raise PolicyError(
            f"the policy maps {n} states to {d} actions, and only velocities of the states can be shown: learn it from "
            "such actions"
        )
    if demos is None:
        return
    if not isinstance(demos, Demonstrations):
        raise DataError(f"demos= must be Demonstrations, as uc.load returns them, not {type(demos).__name__}")
    if demos.states.shape[1] != n or demos.actions.shape[1] != d:
        raise DataError(
            f"these recordings have {demos.states.shape[1]} states and {demos.actions.shape[1]} actions, and the "
            f"policy {n} and {d}: give those it was learnt from, or others like them"
        )


def _hand(
    robot: "Robot | str | PathLike[str]",
    site: str | None,
    lock: Iterable[str] | Mapping[str, float],
    policy: Policy,
    names: Sequence[str],
    notes: list[str],
) -> Coordinates:
    from unconstrain.robots import Robot
    from unconstrain.viewer.hand import Hand

    loaded = robot if isinstance(robot, Robot) else Robot.load(robot, lock)
    chosen = loaded.frames[-1] if site is None else site
    hand = Hand(loaded, chosen, policy.space_, names)
    if site is None:
        notes.append(f"the robot's last frame, {chosen}, is taken for its hand; name another with site=")
    elif len(loaded.frames) > 1:
        notes.append(f"the place of {chosen} is shown")
    if not hand.by_name:
        pairs = ", ".join(f"{name} is {joint}" for name, joint in zip(names, loaded.joints, strict=False))
        notes.append(f"states are taken for the joints in their order, so {pairs}")
    return hand


def _draw_robot(served: Any, seen: Coordinates, notes: list[str]) -> Callable[[Array], None] | None:
    """Draw the robot whose hand is shown, and return what shows it in a state; None where there is no robot."""
    from unconstrain.viewer.hand import Hand

    if not isinstance(seen, Hand):
        return None
    from unconstrain.viewer.robot_scene import RobotScene

    drawn = RobotScene(served, seen.robot.model)
    notes += [*seen.robot.notes, *drawn.notes]
    return lambda state: drawn.show(seen.joints(state[None])[0])


def _rows(constraint: Any, d: int) -> Callable[[Array], Array]:
    """Make a function from states (S, n) to rows (S, k, d) of what `rollout` takes as a constraint."""

    def rows(X: Array) -> Array:
        A: ArrayLike = constraint(X) if callable(constraint) else constraint
        A = np.asarray(A, dtype=np.float64)
        return np.broadcast_to(A, (len(X), *A.shape[-2:])) if A.ndim == 2 else A

    if callable(constraint):
        return rows
    try:
        found = rows(np.zeros((1, d)))[0].shape
    except (TypeError, ValueError):
        found = None
    if found is None or len(found) != 2 or found[-1] != d:
        what = type(constraint).__name__ if found is None else f"shape {found}"
        raise DataError(f"constraint= must be rows of {d} numbers, one for each action, got {what}")
    return rows


def _interval(demos: Demonstrations | None) -> float:
    """Return the usual time between recorded samples, in seconds; that of a rollout's step where it is not known."""
    if demos is None or demos.time is None:
        return USUAL
    apart = np.diff(demos.time)[demos.episodes[1:] == demos.episodes[:-1]]
    apart = apart[apart > 0]
    return float(np.median(apart)) if len(apart) else USUAL


def _duration(demos: Demonstrations) -> float:
    """Return how long a rollout lasts at first, in seconds."""
    if demos.time is None:
        return SECONDS
    spans = [np.ptp(demos.time[demos.episodes == code]) for code in range(min(demos.n_episodes, 100))]
    usual = LASTS * float(np.median(spans))
    return float(f"{usual:.2g}") if usual > 0 else SECONDS
