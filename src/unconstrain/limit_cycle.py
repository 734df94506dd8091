"""The paper's limit cycle under random constraints (section 4.1): the smallest plant that shows the problem."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from unconstrain.constraints.nullspace import projection, unconstrained
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError, UnconstrainError
from unconstrain.simulation import check_size, simulate

SEGMENTS = 3
"""Constraints per trajectory: the first, and two redraws at regular intervals."""


@dataclass(frozen=True)
class LimitCycle:
    """An attracting circle: in polar coordinates ``ṙ = r (ρ - r²)``, ``θ̇ = ω``.

    States and actions are Cartesian, ``x1 = r sin θ``, ``x2 = r cos θ``, so that

        π(x) = (ρ - r²) x + ω (x2, -x1),    r² = x1² + x2²,

    which is also right at the origin. The circle has radius √ρ and is travelled clockwise.

    Parameters
    ----------
    rho : float
        Squared radius ρ of the cycle.
    omega : float
        Angular velocity ω in rad/s.
    """

    rho: float = 0.5
    omega: float = 1.0

    def __call__(self, X: ArrayLike) -> NDArray[np.float64]:
        """Return the actions (N, 2) at states X (N, 2)."""
        X = np.asarray(X, dtype=np.float64)
        if X.ndim != 2 or X.shape[1] != 2:
            raise DataError(f"the limit cycle moves in the plane: give states of shape (N, 2), not {X.shape}")
        turn = np.stack([X[:, 1], -X[:, 0]], axis=1)
        return (self.rho - np.sum(X**2, axis=1, keepdims=True)) * X + self.omega * turn


def demonstrate(
    n_episodes: int = 40,
    length: int = 40,
    rate: float = 50.0,
    noise: float = 0.0,
    *,
    policy: LimitCycle | None = None,
    constrained: bool = True,
    free: float = 0.0,
    random_state: int | np.random.Generator | None = None,
) -> Demonstrations:
    """Simulate movements of the limit cycle, each under three random constraints, one after the other.

    Starts are uniform in [-1, 1]². The constraint ``A = (α1, α2)``, ``α ~ N(0, 1)``, is drawn anew in each
    third of a trajectory; the action is ``u = N π(x)`` and the state moves by ``u / rate``. With `free`, some of
    these thirds have no constraint.

    Parameters
    ----------
    n_episodes, length : int
        Number of trajectories and of samples in each.
    rate : float
        Samples per second.
    noise : float
        Standard deviation of the Gaussian noise on the recorded actions, as a share of the standard
        deviation of the clean actions of this data set in the same dimension. It is noise of observation:
        the movement itself, and so the states, are clean.
    policy : LimitCycle, optional
        By default that of the paper, ρ = 0.5, ω = 1.
    constrained : bool
        If false, nothing stands in the way and ``u = π(x)``.
    free : float
        The probability that a third of a trajectory has no constraint, so that N = I there; each is drawn by itself.
        With 0 no random numbers are spent on it: the data are those of a call without `free`.
    random_state : int, Generator or None
        The same number gives the same data.

    Returns
    -------
    Demonstrations
        ``n_episodes * length`` samples with the true policy and projections.

    Raises
    ------
    UnconstrainError
        If a number is not positive, the noise is negative, `free` is no probability, or the samples do not fit into
        memory.
    """
    if n_episodes < 1 or length < 1 or not (np.isfinite(rate) and rate > 0):
        raise UnconstrainError(
            f"demonstrations need at least one episode and sample and a positive rate, not {n_episodes}, "
            f"{length} and {rate}"
        )
    if not (np.isfinite(noise) and noise >= 0):
        raise UnconstrainError(f"the noise is a share of the actions' scale, 0 or more, not {noise}")
    if not 0.0 <= free <= 1.0:
        raise UnconstrainError(f"free is the share of constraints that are left out, 0 to 1, not {free}")
    check_size(n_episodes, length, 2, 2, constrained=True)
    rng = np.random.default_rng(random_state)
    policy = policy or LimitCycle()

    x = rng.uniform(-1.0, 1.0, (n_episodes, 2))
    A = rng.standard_normal((n_episodes, SEGMENTS, 1, 2))
    N = projection(A.reshape(-1, 1, 2)).reshape(n_episodes, SEGMENTS, 2, 2)
    if free:
        left_out = rng.random((n_episodes, SEGMENTS)) < free
        N = np.where(left_out[:, :, None, None], unconstrained(2), N)
    if not constrained:
        N = np.broadcast_to(unconstrained(2), N.shape)

    segment = np.arange(length) * SEGMENTS // length
    clean = simulate(
        policy,
        x,
        steps=length - 1,
        dt=1 / rate,
        project=lambda k, X, wanted: N[:, segment[k]],
        state_names=("x1", "x2"),
        action_names=("u1", "u2"),
    )
    if not noise:
        return clean
    scale = noise * clean.actions.std(axis=0)
    return replace(clean, actions=clean.actions + scale * rng.standard_normal(clean.actions.shape))
