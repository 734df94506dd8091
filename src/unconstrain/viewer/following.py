"""The rollout from a start, by the compiled step."""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.errors import PolicyError
from unconstrain.policies.base import Policy
from unconstrain.simulation import simulate
from unconstrain.stopping import Movement, MovementStopped, Recorded
from unconstrain.viewer.barriers import Barrier, InTheWay
from unconstrain.viewer.coordinates import Coordinates
from unconstrain.viewer.frame import Frame

Array = NDArray[np.float64]

USUAL, LEAST, MOST = 0.02, 20, 500
"""Seconds of a step, as of `policy.rollout`, where recordings have no finer ones; and how many steps a rollout has: a
smooth line, and what can be followed while a start is dragged."""


@dataclass(frozen=True)
class Wanted:
    """A rollout that is wanted.

    Parameters
    ----------
    start : ndarray of shape (n,)
        Where it starts.
    steps : int
        How many.
    dt : float
        Seconds of each.
    barriers : sequence of Barrier
        What is in its way, in the scene.
    under : callable, optional
        From states (S, n) to rows (S, k, d) of a constraint that holds as well.
    anywhere : bool
        Whether it may leave what was recorded, unless it diverges.
    """

    start: Array
    steps: int
    dt: float
    barriers: Sequence[Barrier] = ()
    under: Callable[[Array], Array] | None = None
    anywhere: bool = False


class Compiled:
    """A policy whose actions are those of its compiled step, as `simulate` takes policies.

    A stabilised policy stays as it is, since it has to know constraints and steps; so does one that cannot be compiled.

    Parameters
    ----------
    policy : Policy
        Fitted.
    """

    def __init__(self, policy: Policy) -> None:
        self.n_features_in_, self.space_, self.scale_ = policy.n_features_in_, policy.space_, policy.scale_
        names = getattr(policy, "state_names_", None)
        if names is not None:
            self.state_names_ = names
        self._predict: Callable[..., Any] = policy.predict
        self.is_compiled = False
        try:
            self._predict = policy.compile()
            self.is_compiled = True
        except PolicyError:
            pass

    def predict(self, X: Array) -> Array:
        """Predict actions (S, d) at states (S, n)."""
        # One state at a time is what a compiled step is fast for.
        return self._predict(X[0])[None] if self.is_compiled and len(X) == 1 else self._predict(X)


class Follower:
    """Follows a policy from starts, among barriers.

    Parameters
    ----------
    policy : Policy
        Fitted.
    state_names : sequence of str, optional
        Of the n states.
    """

    def __init__(self, policy: Policy, state_names: Sequence[str] | None = None) -> None:
        self.policy, self.state_names = policy, state_names
        self._step = None if policy.stability_ is not None else Compiled(policy)
        self._recorded, self._anywhere = Recorded(policy), Recorded(policy, np.inf)

    @property
    def is_compiled(self) -> bool:
        """Whether the compiled step is followed."""
        return self._step is not None and self._step.is_compiled

    def follow(self, wanted: Wanted, coordinates: Coordinates, frame: Frame) -> Movement:
        """Roll the policy out.

        Parameters
        ----------
        wanted : Wanted
            From where, for how long, and what is in the way.
        coordinates : Coordinates
            In which barriers lie.
        frame : Frame
            Of the scene.

        Returns
        -------
        Movement
            Of at most the steps that are wanted; `stopped` says where it left what was recorded. `projections` are
            there where something may be in the way.
        """
        in_the_way = InTheWay(wanted.barriers, coordinates, frame, wanted.dt, self.policy.scale_)

        def project(sample: int, X: Array, U: Array) -> Array:
            return in_the_way.projections(X, U, None if wanted.under is None else wanted.under(X))

        policy: Any = self.policy if self._step is None else self._step
        constrained = bool(wanted.barriers) or wanted.under is not None
        # A stabilised policy leads back by itself, but not necessarily under a constraint.
        leads_back = self._step is None and not constrained
        guards = [] if leads_back else [self._anywhere if wanted.anywhere else self._recorded]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", MovementStopped)  # which the page says
            return simulate(
                policy,
                wanted.start,
                wanted.steps,
                wanted.dt,
                project=project if constrained else None,
                guards=guards,
                state_names=self.state_names,
            )


def choose_steps(seconds: float, usual: float) -> tuple[int, float]:
    """Choose the steps of a rollout.

    Parameters
    ----------
    seconds : float
        How long it lasts.
    usual : float
        Seconds between recorded samples.

    Returns
    -------
    steps : int
        From `LEAST` to `MOST`.
    dt : float
        Seconds of each: no more than the usual, and than `USUAL`, if that makes no more than `MOST`.
    """
    steps = int(np.clip(np.ceil(seconds / min(usual, USUAL) - 1e-6), LEAST, MOST))
    return steps, seconds / steps


def is_held(movement: Movement) -> NDArray[np.bool_]:
    """Say which samples (N,) of a rollout something was in the way of."""
    N = movement.projections
    if N is None:
        return np.zeros(len(movement), dtype=bool)
    return np.asarray(np.einsum("njj->n", N) < N.shape[-1] - 0.5)
