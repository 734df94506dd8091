"""Where a recording would lead that has not been made: what the policy learnt so far does where one direction is free.

A recording is not a point. It moves, and what it tells is told along its way: one that stands still repeats itself, one
that moves far sees much. Actions that are velocities say how far it moves in a unit of time, and the recordings say how
much time passes between samples: the median of `Δxᵀu / uᵀu`. Where the median of `Δx - Δt u` exceeds half of Δx, the
actions are no velocities of the states (accelerations, forces), and a recording is taken to stay where it starts.

A policy that was learnt from little may lead anywhere, so none moves faster than something did in the recordings.
"""

from dataclasses import dataclass

import numpy as np

from unconstrain.constraints.nullspace import constrain
from unconstrain.errors import DataError
from unconstrain.fitting.observation import unknown
from unconstrain.policies.linear import LinearPolicy
from unconstrain.samples import Samples

POINTS = 8
"""How many points of its way stand for a recording."""

STEPS = 40
"""In how many steps a recording is followed at most."""

UNEXPLAINED = 0.5
"""The share of the states' change, in the median, that velocities may leave unexplained."""


@dataclass(frozen=True)
class Movements:
    """R movements by T points of their way, each of which stands for as many samples.

    Parameters
    ----------
    states : ndarray of shape (R, T, n)
        Where they pass.
    directions : ndarray of shape (R, T, d)
        Along which direction of length one each moves there; zero where it stands still.
    """

    states: np.ndarray
    directions: np.ndarray

    def __len__(self) -> int:
        return len(self.states)

    def select(self, rows: slice | np.ndarray) -> "Movements":
        """Select some of the movements.

        Parameters
        ----------
        rows : slice, or ndarray of int or bool
            Which.

        Returns
        -------
        Movements
            These.
        """
        return Movements(self.states[rows], self.directions[rows])


@dataclass(frozen=True)
class Foresight:
    """How recordings are foreseen.

    Parameters
    ----------
    policy : LinearPolicy
        Fitted.
    step : float
        Time between samples in the unit that actions are velocities in; zero where recordings stay where they start.
    fastest : float
        Length of the longest action in the recordings, in units of the policy's scale.
    told : float
        The share of samples whose projection will be known, as it was in the recordings.
    """

    policy: LinearPolicy
    step: float = 0.0
    fastest: float = np.inf
    told: float = 0.0

    @classmethod
    def of(cls, policy: LinearPolicy, samples: Samples) -> "Foresight":
        """Find from recordings how much time passes between samples.

        Parameters
        ----------
        policy : LinearPolicy
            Fitted.
        samples : Samples
            The recordings, in order.

        Returns
        -------
        Foresight
            That follows the policy, or stays where a recording starts.
        """
        X, U, space, scale = samples.states, samples.actions, policy.space_, policy.scale_
        scaled = U / scale
        fastest = float(np.linalg.norm(scaled, axis=1).max(initial=0.0))
        told = 0.0 if samples.projections is None else float(np.mean(~unknown(samples.projections)))
        together = np.ones(max(len(X) - 1, 0), dtype=bool)
        if samples.groups is not None:
            together = np.asarray(samples.groups[1:] == samples.groups[:-1])
        together &= np.linalg.norm(scaled[:-1], axis=1) > 0
        if space.n_actions != U.shape[1] or not together.any():
            return cls(policy, told=told)
        moved = space.difference(X[:-1][together], X[1:][together]) / scale
        along = scaled[:-1][together]
        step = float(np.median(np.sum(moved * along, axis=1) / np.sum(along**2, axis=1)))
        left = np.linalg.norm(moved - step * along, axis=1)
        unexplained = np.median(left) > UNEXPLAINED * np.median(np.linalg.norm(moved, axis=1))
        if unexplained or not step > 0:
            return cls(policy, told=told)
        return cls(policy, step, fastest, told)

    def follow(self, X: np.ndarray, directions: np.ndarray, length: float) -> Movements:
        """Foresee recordings.

        Parameters
        ----------
        X : ndarray of shape (R, n)
            Where each starts.
        directions : ndarray of shape (R, d)
            The direction of length one along which motion is free in each.
        length : float
            Samples in each.

        Returns
        -------
        Movements
            By one point where they stay, else by `POINTS`, or as many as there are samples.
        """
        points = min(POINTS, max(1, round(length)))
        if self.step == 0 or points == 1:
            return Movements(X[:, None], directions[:, None])
        each = max(1, min(STEPS, round(length)) // points)
        seconds = self.step * length / (each * points)
        N = directions[:, :, None] * directions[:, None, :]
        scale, space, x, passed = self.policy.scale_, self.policy.space_, X, []
        for k in range(each * points):
            if k % each == 0:
                passed.append(x)
            wanted = np.reshape(self.policy.predict(x), (len(x), -1))
            u = constrain(N, wanted, scale)
            speed = np.linalg.norm(u / scale, axis=1, keepdims=True)
            x = space.step(x, u * (self.fastest / np.maximum(speed, self.fastest)), seconds)
            if not np.isfinite(x).all():
                raise DataError(
                    "the policy leads out of all bounds from these states: give nearer candidates"
                )
        return Movements(
            np.stack(passed, axis=1),
            np.broadcast_to(directions[:, None], (len(X), points, directions.shape[1])),
        )
