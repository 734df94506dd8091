"""The smallest change of an action that makes a Lyapunov function fall, in closed form."""

from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np

from unconstrain.constraints.nullspace import in_metric
from unconstrain.errors import DataError, PolicyError
from unconstrain.spaces import SecondOrder, Space
from unconstrain.stability.learning import learn_lyapunov
from unconstrain.stability.lyapunov import Array, Lyapunov

PACE = 0.15
"""Share of the usual speed with which states approach the goal at least, as far as V tells."""

RADIUS = 0.03
"""Share of the states' usual distance from the goal within which actions turn to lead straight there."""

SLOWING = 5.0
"""How many such radii from the goal the least speed begins to become less."""

ARRIVED = 0.01
"""Share of the states' extent within which a movement has reached the goal."""

FARTHEST = 1e100
"""The longest way to the goal of which powers are numbers in double precision; its inverse is the shortest."""

BLOCKED = 1e-12
"""Share of the squared slope of V below which what a constraint leaves of it is rounding."""


@dataclass(frozen=True)
class Stability:
    """What makes actions lead to a goal.

    All of it is done on `e = difference(goal, x) / scale` and `u / scale`, the metric that the policy was learnt in.

    Parameters
    ----------
    space : Space
        That states belong to.
    goal : ndarray of shape (n,)
        Where movements end.
    scale : ndarray of shape (d,)
        What a length of one is along each action.
    lyapunov : Lyapunov
        V(e).
    pace : float
        V falls at least as fast as it does on the straight way to the goal with this speed; nearer to it than a few
        times the radius, with a speed in proportion to the distance.
    radius : float
        Within it of the goal actions turn into `-pull e`.
    pull : float
        How fast states approach the goal there, 1/s.
    extent : float
        Diagonal of the box that holds the states it was learnt from.
    hold : float
        The longest time for which an action is held, in seconds.
    notes : tuple of str
        What was found when it was learnt, a sentence each.
    """

    space: Space
    goal: Array
    scale: Array
    lyapunov: Lyapunov
    pace: float
    radius: float
    pull: float
    extent: float
    hold: float
    notes: tuple[str, ...] = ()

    is_kept_under_constraints: ClassVar[bool] = True
    """Whether states cannot run away where a constraint takes part of an action."""

    @classmethod
    def learn(cls, space: Space, goal: Array, scale: Array, X: Array, U: Array, hold: float) -> Self:
        """Learn V from a policy's actions.

        Parameters
        ----------
        space : Space
            That states belong to.
        goal : ndarray of shape (n,)
            Where movements end.
        scale : ndarray of shape (d,)
            What a length of one is along each action.
        X : ndarray of shape (N, n)
            States of the recorded region.
        U : ndarray of shape (N, d)
            What the policy does there.
        hold : float
            The longest time for which an action is held, in seconds.

        Returns
        -------
        Stability
            For this goal.

        Raises
        ------
        PolicyError
            Actions are not velocities of the state.
        DataError
            All states are at the goal, or too far from it or too near to compute with.
        """
        if isinstance(space, SecondOrder):
            raise PolicyError(
                "a policy whose actions are accelerations cannot be stabilised: learn it from velocities, without the "
                "velocity among the states"
            )
        if U.shape[1] != space.n_actions:
            raise PolicyError(
                f"only a policy whose actions are velocities of its states, {space.n_actions} numbers, can be "
                f"stabilised, and this one has {U.shape[1]}"
            )
        E = space.difference(np.tile(goal, (len(X), 1)), X) / scale
        U = U / scale
        largest = float(np.abs(E).max(initial=0.0))
        if not largest:
            raise DataError(
                "all states are at the goal, so there is no way to it to learn: give another goal"
            )
        if largest > FARTHEST or 0 < largest < 1 / FARTHEST:
            raise DataError(
                f"the states are {largest:.2g} from the goal, which is no distance to compute with: give another goal, "
                "or states in another unit"
            )
        away, speeds = np.linalg.norm(E, axis=1), np.linalg.norm(U, axis=1)
        size = float(np.sqrt(np.mean(away**2)))
        radius = RADIUS * size
        outside = away > radius
        usual = float(np.median(speeds[outside])) if outside.any() else 0.0
        pace = PACE * (usual or size)
        near = outside & (away < SLOWING * radius)
        pulls = speeds[near] / away[near]
        pull = max(pace / (SLOWING * radius), float(np.median(pulls)) if near.any() else 0.0)
        wanted = -pace / np.maximum(away, SLOWING * radius)[:, None] * E
        lyapunov = learn_lyapunov(E, U, wanted, space.blocks)
        extent = float(np.linalg.norm(np.ptp(E, axis=0)))
        return cls(space, goal, scale, lyapunov, pace, radius, pull, extent, hold)

    def held_for(self, seconds: float) -> Self:
        """Return this for actions that are held for a time, where that is longer.

        Parameters
        ----------
        seconds : float
            Above zero.

        Returns
        -------
        Stability
            For at least that long.
        """
        return self if seconds <= self.hold else replace(self, hold=seconds)

    def stabilize(self, X: Array, U: Array, projections: Array | None = None) -> Array:
        """Change actions as little as it takes to make V fall.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        U : ndarray of shape (N, d)
            The policy's own actions.
        projections : ndarray of shape (N, d, d), optional
            Onto the motion that constraints leave. V falls as far as that can make it, and where it cannot the
            action is zero.

        Returns
        -------
        ndarray of shape (N, d)
            Actions; under constraints such as these let through.
        """
        with np.errstate(over="ignore", under="ignore", invalid="ignore"):
            E = self._from_goal(X)
            near = self.lyapunov.near(E)
            away = np.linalg.norm(E / near.unit[:, None], axis=1) * near.unit
            inside = np.minimum(away / self.radius, 1.0)
            own = (inside**2 * (3.0 - 2.0 * inside))[:, None]
            U = own * (U / self.scale) - (1.0 - own) * self.pull * E
            down, share = near.gradient, np.ones(len(E))
            if projections is not None:
                N = in_metric(projections, self.scale)
                U, down = (np.einsum("nij,nj->ni", N, each) for each in (U, down))
                share = self._share_left(near.gradient, down)
            steepness = np.einsum("ni,ni->n", near.gradient, down)
            rate = share * self.rate(away)
            needed = np.einsum("ni,ni->n", near.gradient, U + rate[:, None] * E)
            change = np.divide(needed, steepness, out=np.zeros_like(needed), where=steepness > 0)
            change[change < 0] = 0.0
            U = U - change[:, None] * down
            if projections is not None:  # where little is left, rounding in it has been multiplied
                U = np.einsum("nij,nj->ni", N, U)
            share = self.lyapunov.longest_share(near, U * (self.hold / near.unit)[:, None])
            return share[:, None] * U * self.scale

    def rate(self, away: Any) -> Any:
        """Compute the rate of the slowest approach at distances, 1/s."""
        return self.pace / np.maximum(away, self.slowing)

    @property
    def slowing(self) -> float:
        """The distance from the goal from which on the least speed becomes less."""
        return SLOWING * self.radius

    def freedom(self, X: Array, projections: Array) -> Array:
        """Compute how much of the steepest way down V a constraint leaves.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        projections : ndarray of shape (N, d, d)
            Onto the motion that is left.

        Returns
        -------
        ndarray of shape (N,)
            From 0, where V cannot be made to fall, to 1.
        """
        near = self.lyapunov.near(self._from_goal(X))
        down = np.einsum("nij,nj->ni", in_metric(projections, self.scale), near.gradient)
        return self._share_left(near.gradient, down)

    def value(self, X: Array) -> Array:
        """Compute V at states (N, n), (N,)."""
        return self.lyapunov.value(self._from_goal(X))

    def distance(self, X: Array) -> Array:
        """Compute how far states (N, n) are from the goal, as a share of the extent of those learnt from, (N,)."""
        return np.linalg.norm(self._from_goal(X), axis=1) / self.extent

    def _from_goal(self, X: Array) -> Array:
        return self.space.difference(np.tile(self.goal, (len(X), 1)), X) / self.scale

    @staticmethod
    def _share_left(gradient: Array, down: Array) -> Array:
        """Compute how much of the slope constraints leave, (N,)."""
        whole = np.einsum("ni,ni->n", gradient, gradient)
        left = np.divide(np.einsum("ni,ni->n", down, down), whole, out=np.ones_like(whole), where=whole > 0)
        return np.where(left < BLOCKED, 0.0, np.sqrt(left))
