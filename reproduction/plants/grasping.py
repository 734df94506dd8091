"""A humanoid that demonstrates how to grasp a ball, a barrier in its way (section 4.3)."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from reproduction.plants.barrier import Barrier, find_blocking
from reproduction.plants.humanoid import Humanoid
from reproduction.plants.scene import Scene
from reproduction.plants.whole_body import WholeBody, make_floating
from unconstrain.constraints import projection
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import UnconstrainError
from unconstrain.simulation import Policy, simulate

Array = NDArray[np.float64]

ALPHA, SIGMA_SQUARED = 0.25, 2.0
"""α and σ² of the potential φ = α (1 - exp(-‖x - x_c‖² / 2σ²))."""

RATE = 16.0
"""Times the paper's policy, so that two seconds suffice to reach the ball: near it π = -2 (x - x_c) per second."""

DURATION, FREQUENCY = 2.0, 50.0
"""Of a movement in seconds, and samples per second."""

STATE_NAMES = tuple(f"{side}_{axis}" for side in ("left", "right") for axis in "xyz")


@dataclass(frozen=True, eq=False)
class Attractor:
    """The expert's policy `π(x) = -ρ ∇φ(x)`, `φ = α (1 - exp(-‖x - x_c‖² / 2σ²))`, over both hands.

    The paper prints +∇φ, which would drive the hands away. Equation (12).

    Parameters
    ----------
    target : ndarray of shape (6,)
        x_c, where the hands grasp, in metres.
    """

    target: Array

    def __call__(self, X: ArrayLike) -> Array:
        """Return velocities (N, 6) in m/s at hand positions X (N, 6)."""
        error = np.asarray(X, dtype=np.float64) - self.target
        steepness = np.exp(-np.sum(error**2, axis=1, keepdims=True) / (2 * SIGMA_SQUARED))
        return -RATE * ALPHA / SIGMA_SQUARED * error * steepness


def constrain(obstacle: Barrier | None, X: Array, Pi: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Find out how an obstacle constrains both hands.

    Parameters
    ----------
    obstacle : Barrier or None
        One for each of S movements.
    X, Pi : ndarray of shape (S, 6)
        The hands' positions, and how the policy would move them, in m and m/s.

    Returns
    -------
    projections : ndarray of shape (S, 6, 6)
        N.
    blocked : ndarray of shape (S, 2), bool
        Which hands the obstacle stops.
    """
    S = len(X)
    if obstacle is None:
        return np.tile(np.eye(6), (S, 1, 1)), np.zeros((S, 2), dtype=bool)
    rows, blocked = find_blocking(obstacle, X.reshape(S, 2, 3), Pi.reshape(S, 2, 3))
    A = np.zeros((S, 2, rows.shape[2], 2, 3))
    for hand in range(2):
        A[:, hand, :, hand] = rows[:, hand]
    return projection(A.reshape(S, -1, 6)), blocked


@dataclass(frozen=True, eq=False)
class Recording:
    """Movements of the robot, and what is known about them.

    Attributes
    ----------
    demonstrations : Demonstrations
        Hands' realised positions (m) and velocities (m/s), the true policy and projections.
    blocked : ndarray of shape (N, 2), bool
        Which hand the barrier stops.
    tracking : float
        Root mean square of realised minus commanded velocity, as a share of the commanded.
    postures : ndarray of shape (S, length, nq)
        The whole body's, to be shown.
    """

    demonstrations: Demonstrations
    blocked: NDArray[np.bool_]
    tracking: float
    postures: Array

    @property
    def movements_blocked(self) -> float:
        """Share of movements in which the barrier stops a hand at some time."""
        met = np.unique(self.demonstrations.episodes[self.blocked.any(axis=1)])
        return len(met) / self.demonstrations.n_episodes


class Demonstrator:
    """A humanoid that shows the grasp, its whole body controlled.

    Parameters
    ----------
    humanoid : Humanoid
        Its home posture decides where the scene is.
    """

    def __init__(self, humanoid: Humanoid):
        self.humanoid = humanoid
        self.scene = Scene(WholeBody(humanoid).hands.mean(axis=0), humanoid.floor)
        self.policy = Attractor(self.scene.grasp)
        self._model = make_floating(humanoid).compile()

    def draw_starts(self, n: int, rng: np.random.Generator, model: Any = None) -> list[WholeBody]:
        """Make n robots stand in random postures ~ N(q0, 0.1 I), free of self-collision, hands where the scene admits.

        Parameters
        ----------
        n : int
            Number of robots.
        rng : Generator
            That the postures are drawn from.
        model : mujoco.MjModel, optional
            That of `WholeBody`, if the robot shall stand in a scene that is shown.

        Returns
        -------
        list of WholeBody
            One for each movement.

        Raises
        ------
        UnconstrainError
            If hardly any posture is admitted.
        """
        bodies: list[WholeBody] = []
        model = self._model if model is None else model
        body, tries = WholeBody(self.humanoid, model), 1000 + 100 * n
        for _ in range(tries):
            body.stand(self.humanoid.draw_postures(1, rng)[0])
            if self.scene.admits(body.hands) and not self.humanoid.touches_itself(body.posture):
                bodies.append(body)
                if len(bodies) == n:
                    return bodies
                body = WholeBody(self.humanoid, model)
        raise UnconstrainError(
            f"only {len(bodies)} of {tries} random postures hold both hands in front of the barrier and above "
            "the table: give another home posture or other hands"
        )

    def record(
        self,
        obstacle: Barrier | None,
        bodies: list[WholeBody],
        *,
        policy: Policy | None = None,
        duration: float = DURATION,
    ) -> Recording:
        """Let robots move from where they stand, and record their hands.

        Parameters
        ----------
        obstacle : Barrier or None
            One for each robot.
        bodies : list of WholeBody
            Are moved.
        policy : object with ``predict(X)``, or callable ``X -> U``, optional
            Over both hands' positions (N, 6); by default the expert's.
        duration : float
            In seconds.

        Returns
        -------
        Recording
            ``duration * FREQUENCY`` samples per robot.
        """
        S, length = len(bodies), round(duration * FREQUENCY)
        blocked: list[NDArray[np.bool_]] = []
        postures: list[Array] = []

        def project(sample: int, X: Array, wanted: Array) -> Array:
            N, stopped = constrain(obstacle, X, wanted)
            blocked.append(stopped)
            return N

        # Whole-body control moves the hands, nearly as commanded; what they really did is recorded.
        def advance(X: Array, commanded: Array) -> tuple[Array, Array]:
            postures.append(np.stack([body.data.qpos.copy() for body in bodies]))
            realised = [
                body.move(velocities.reshape(2, 3), 1 / FREQUENCY).ravel()
                for body, velocities in zip(bodies, commanded, strict=True)
            ]
            return _stack_hands(bodies), np.stack(realised)

        demonstrations = simulate(
            policy or self.policy,
            _stack_hands(bodies),
            length - 1,
            1 / FREQUENCY,
            project=project,
            advance=advance,
            state_names=STATE_NAMES,
        )
        assert demonstrations.policy is not None
        assert demonstrations.projections is not None
        commanded = np.einsum("nij,nj->ni", demonstrations.projections, demonstrations.policy)
        off, speed = (np.linalg.norm(each) for each in (demonstrations.actions - commanded, commanded))
        return Recording(
            demonstrations,
            np.stack(blocked, axis=1).reshape(S * length, 2),
            float(off / speed) if speed else 0.0,
            np.stack(postures, axis=1),
        )


def _stack_hands(bodies: list[WholeBody]) -> Array:
    return np.stack([body.hands.ravel() for body in bodies])
