"""Movement that goes round and round: a closed curve, and the smallest change of actions that keeps to it.

A state is told by its phase θ, the angle about the middle in the plane of the motion, and by how far it is from the
curve at that phase: along the radius, and across the plane. Both are known in closed form, also at the end of a step.
"""

from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from unconstrain.constraints.nullspace import constrain
from unconstrain.errors import DataError, PolicyError
from unconstrain.spaces import SecondOrder, Space

Array = NDArray[np.float64]

HARMONICS = 3
"""Of the curve and of the time that each phase takes, as Fourier series."""

TEMPO = 0.05
"""By which share the phase may go faster or slower than in the recordings."""

APPROACH = 1.0
"""How often the distance from the curve falls to 1/e in a turn, at least."""

LEAST = 0.2
"""Share of the mean below which neither the radius nor the time that a phase takes falls."""

FEWEST_TURNS = 2.0
"""Turns that have to be recorded to know a period."""

ONE_WAY = 0.8
"""Share of the way round that has to be net, rather than to and fro, in recordings that go round."""

COARSEST = 0.1
"""Share of the period that an action may be held at most."""


@dataclass(frozen=True)
class Cycle:
    """What keeps actions on a closed curve, at the recorded pace.

    All of it is done on `e = difference(center, x) / scale` and `u / scale`, the metric that the policy was learnt in.

    Parameters
    ----------
    space : Space
        That states belong to.
    center : ndarray of shape (n,)
        Middle of the recorded states.
    scale : ndarray of shape (d,)
        What a length of one is along each action.
    axes : ndarray of shape (d, d)
        Orthonormal rows; the first two span the plane in which the motion goes round, from the first to the second.
    curve : ndarray of shape (2K + 1, d - 1)
        Fourier coefficients (1, cos θ, sin θ, cos 2θ, ...) of the radius in the plane, and of what lies across it.
    slowness : ndarray of shape (2K + 1,)
        Those of dt/dθ, in seconds. The period is 2π times the first.
    extent : float
        Diagonal of the box that holds the recorded states.
    hold : float
        For how long an action is held, in seconds.
    notes : tuple of str
        What was found when it was learnt, a sentence each.
    """

    space: Space
    center: Array
    scale: Array
    axes: Array
    curve: Array
    slowness: Array
    extent: float
    hold: float
    notes: tuple[str, ...] = ()

    is_kept_under_constraints: ClassVar[bool] = False
    """Whether states cannot run away where a constraint takes part of an action."""

    @classmethod
    def learn(
        cls, space: Space, scale: Array, X: Array, episodes: NDArray[np.int64], time: Array, hold: float
    ) -> Self:
        """Learn the curve and its pace from recorded states.

        Parameters
        ----------
        space : Space
            That states belong to.
        scale : ndarray of shape (d,)
            What a length of one is along each action.
        X : ndarray of shape (N, n)
            States, in the order of time in each episode.
        episodes : ndarray of shape (N,), int
            Which samples belong together.
        time : ndarray of shape (N,)
            Seconds.
        hold : float
            For how long an action is held, in seconds.

        Returns
        -------
        Cycle
            The mean of all turns.

        Raises
        ------
        PolicyError
            Actions are not velocities of the state, or states are single numbers.
        DataError
            The recordings do not go round and round.
        """
        d = space.n_actions
        if isinstance(space, SecondOrder):
            raise PolicyError(
                "a policy whose actions are accelerations cannot be kept on a cycle: learn it from velocities, without "
                "the velocity among the states"
            )
        if d < 2 or len(scale) != d:
            raise PolicyError(
                f"a cycle needs two states or more, and actions that are their velocities, {d} numbers; these are "
                f"{len(scale)}"
            )
        center = _find_middle(space, X)
        E = space.difference(np.tile(center, (len(X), 1)), X) / scale
        # Singular vectors of the scatter: the plane of the motion, and what lies across it.
        axes = np.linalg.eigh(E.T @ E)[1].T[::-1]
        theta, rho, across = _cylindrical(E, axes)
        steps = _wrap(np.diff(theta))
        follows = episodes[1:] == episodes[:-1]
        turns, way = (float(np.sum(each[follows])) / (2 * np.pi) for each in (steps, np.abs(steps)))
        # Tremor goes to and fro as well; what counts is the way over a tenth of a turn.
        coarse = _coarse_way(theta, episodes)
        if abs(turns) < FEWEST_TURNS or abs(turns) < ONE_WAY * coarse or not way:
            raise DataError(
                f"the recordings do not go round and round: {abs(turns):.2g} turns about their middle, of {coarse:.2g} "
                "to and fro; at least two turns are needed, in one direction"
            )
        if turns < 0:
            axes = axes * np.where(np.arange(d) == 1, -1.0, 1.0)[:, None]
            theta = -theta
        B = _fourier(theta, 2 * HARMONICS + 1)
        curve = np.asarray(
            np.linalg.lstsq(B, np.column_stack([rho, across]), rcond=None)[0], dtype=np.float64
        )
        # The mean radius of uneven turns is less than how far they usually are from their middle.
        curve[:, 0] *= np.sqrt(np.mean(rho**2) / np.mean((B @ curve[:, 0]) ** 2))
        seconds = float(np.sum(np.diff(time)[follows]))
        # Samples are even in time, so the share of them at a phase is the time that it takes.
        per_turn = seconds / abs(turns) / (2 * np.pi)
        slowness: Array = B.mean(axis=0) * np.append(1.0, np.full(2 * HARMONICS, 2.0)) * per_turn
        extent = float(np.linalg.norm(np.ptp(E, axis=0)))
        cycle = cls(space, center, scale, axes, curve, slowness, extent, hold)
        cycle.check_hold()
        return replace(
            cycle,
            notes=(
                f"the cycle is the mean of {abs(turns):.3g} turns of {cycle.period:.3g} s; the recorded states lie "
                f"{np.sqrt(np.mean(cycle.distance(X) ** 2)):.2g} of their extent from it (root mean square)",
            ),
        )

    @property
    def period(self) -> float:
        """Time of a turn, in seconds."""
        return float(2 * np.pi * self.slowness[0])

    @property
    def goal(self) -> Array:
        """The middle of the curve, (n,)."""
        return self.center

    def check_hold(self) -> None:
        """Raise `PolicyError` where actions are held for too long to go round."""
        if self.hold > COARSEST * self.period:
            raise PolicyError(
                f"actions that are held for {self.hold:.3g} s cannot follow a cycle of {self.period:.3g} s: at most a "
                "tenth of it is possible, so give a shorter dt or hold"
            )

    def held_for(self, seconds: float) -> Self:
        """Return this for actions that are held for another time: steps end on the curve only if they last as long.

        Parameters
        ----------
        seconds : float
            Above zero.

        Returns
        -------
        Cycle
            With that hold.
        """
        held = replace(self, hold=seconds)
        held.check_hold()
        return held

    def stabilize(self, X: Array, U: Array, projections: Array | None = None) -> Array:
        """Change actions as little as it takes to come nearer to the curve, and to go round at its pace.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        U : ndarray of shape (N, d)
            The policy's own actions.
        projections : ndarray of shape (N, d, d), optional
            Onto the motion that constraints leave. The changed actions are projected, and may then not come nearer.

        Returns
        -------
        ndarray of shape (N, d)
            Actions.
        """
        with np.errstate(over="ignore", invalid="ignore"):
            E = self._from_center(X)
            theta, rho, across = _cylindrical(E, self.axes)
            ahead, out, beside = _cylindrical(E + self.hold * (U / self.scale), self.axes)
            usual = self.hold / self._slow(theta + 0.5 * self.hold / self._slow(theta))
            own = _wrap(ahead - theta)
            step = np.clip(own, (1 - TEMPO) * usual, (1 + TEMPO) * usual)
            now, then = self._deviation(theta, rho, across), self._deviation(ahead, out, beside)
            allowed = np.exp(-APPROACH * self.hold / self.period) * np.linalg.norm(now, axis=1)
            length = np.linalg.norm(then, axis=1)
            share = np.divide(allowed, length, out=np.ones_like(length), where=length > allowed)
            keeps = (step == own) & (share == 1.0)
            target = self._place(theta + step, share[:, None] * np.where(np.isfinite(then), then, 0.0))
            U = np.where(keeps[:, None], U, self._velocity(X, E, target))
        return U if projections is None else constrain(projections, U, self.scale)

    def distance(self, X: Array) -> Array:
        """Compute how far states (N, n) are from the curve, as a share of the extent of those learnt from, (N,)."""
        return (
            np.linalg.norm(self._deviation(*_cylindrical(self._from_center(X), self.axes)), axis=1)
            / self.extent
        )

    def phase(self, X: Array) -> Array:
        """Compute the phases of states (N, n), from -π to π, (N,)."""
        return _cylindrical(self._from_center(X), self.axes)[0]

    def amplitude(self, X: Array) -> float:
        """Compute the root mean square distance of states (N, n) from the middle, in units of the scale."""
        return float(np.sqrt(np.mean(np.sum(self._from_center(X) ** 2, axis=1))))

    def points(self, theta: Array) -> Array:
        """Compute the states of the curve at phases (N,), (N, n)."""
        E = self._place(theta, np.zeros((len(theta), len(self.scale) - 1)))
        return self.space.step(np.tile(self.center, (len(E), 1)), E * self.scale, 1.0)

    def _from_center(self, X: Array) -> Array:
        return self.space.difference(np.tile(self.center, (len(X), 1)), X) / self.scale

    def _radius(self, theta: Array) -> tuple[Array, Array]:
        """Return the radius of the curve, and what lies across the plane."""
        found = _fourier(theta, len(self.curve)) @ self.curve
        return np.maximum(found[:, 0], LEAST * self.curve[0, 0]), found[:, 1:]

    def _slow(self, theta: Array) -> Array:
        return np.maximum(_fourier(theta, len(self.slowness)) @ self.slowness, LEAST * self.slowness[0])

    def _deviation(self, theta: Array, rho: Array, across: Array) -> Array:
        """Return how far states are from the curve at their phase, (N, d - 1): the first is relative to the radius."""
        radius, beside = self._radius(theta)
        return np.column_stack([self.curve[0, 0] * (rho / radius - 1.0), across - beside])

    def _place(self, theta: Array, deviation: Array) -> Array:
        """Undo `_deviation`, (N, d)."""
        radius, beside = self._radius(theta)
        rho = radius * np.maximum(1.0 + deviation[:, 0] / self.curve[0, 0], 0.0)
        return (
            np.column_stack([rho * np.cos(theta), rho * np.sin(theta), beside + deviation[:, 1:]]) @ self.axes
        )

    def _velocity(self, X: Array, E: Array, target: Array) -> Array:
        if self.space.is_flat:
            return (target - E) / self.hold * self.scale
        there = self.space.step(np.tile(self.center, (len(X), 1)), target * self.scale, 1.0)
        return self.space.difference(X, there) / self.hold


def _find_middle(space: Space, X: Array) -> Array:
    middle = X[:1]
    for _ in range(1 if space.is_flat else 10):
        away = space.difference(np.repeat(middle, len(X), axis=0), X)
        middle = space.step(middle, away.mean(axis=0, keepdims=True), 1.0)
    return middle[0]


def _cylindrical(E: Array, axes: Array) -> tuple[Array, Array, Array]:
    """Return phases, radii in the plane, and what lies across it."""
    W = E @ axes.T
    return np.arctan2(W[:, 1], W[:, 0]), np.hypot(W[:, 0], W[:, 1]), W[:, 2:]


def _fourier(theta: Array, terms: int) -> Array:
    several = theta[:, None] * np.arange(1, terms // 2 + 1)
    pairs = np.stack([np.cos(several), np.sin(several)], axis=2).reshape(len(theta), -1)
    return np.column_stack([np.ones(len(theta)), pairs])


def _wrap(angle: Any) -> Any:
    return angle - 2 * np.pi * np.round(angle / (2 * np.pi))


def _coarse_way(theta: Array, episodes: NDArray[np.int64]) -> float:
    """Compute how many turns phases make to and fro, less what is shorter than a tenth of a turn."""
    way = 0.0
    for code in np.unique(episodes):
        followed = np.unwrap(theta[episodes == code])
        at = followed[0]
        for value in followed:
            if abs(value - at) > 0.2 * np.pi:
                way, at = way + abs(value - at), value
    return way / (2 * np.pi)
