"""A humanoid that demonstrates how to grasp a ball, a barrier in its way (section 4.3)."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from reproduction.plants.barrier import Barrier, blocking
from reproduction.plants.humanoid import Humanoid
from reproduction.plants.scene import Scene
from reproduction.plants.whole_body import WholeBody, floating
from unconstrain.constraints import projection
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import UnconstrainError

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
    """

    target: Array

    def __call__(self, X: ArrayLike) -> Array:
        """Velocities (N, 6) in m/s at hand positions X (N, 6)."""
        error = np.asarray(X, dtype=np.float64) - self.target
        steepness = np.exp(-np.sum(error**2, axis=1, keepdims=True) / (2 * SIGMA_SQUARED))
        return -RATE * ALPHA / SIGMA_SQUARED * error * steepness


def constrain(obstacle: Barrier | None, X: Array, Pi: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Projections N (S, 6, 6) of the obstacle at hand positions X (S, 6), and which hands (S, 2) it blocks."""
    S = len(X)
    if obstacle is None:
        return np.tile(np.eye(6), (S, 1, 1)), np.zeros((S, 2), dtype=bool)
    rows, blocked = blocking(obstacle, X.reshape(S, 2, 3), Pi.reshape(S, 2, 3))
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
    blocked : array (N, 2) of bool
        Which hand the barrier stops.
    tracking : float
        Root mean square of realised minus commanded velocity, as a share of the commanded.
    postures : array (S, length, nq)
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
    """

    def __init__(self, humanoid: Humanoid):
        self.humanoid = humanoid
        self.scene = Scene(WholeBody(humanoid).hands.mean(axis=0), humanoid.floor)
        self.policy = Attractor(self.scene.grasp)
        self._model = floating(humanoid).compile()

    def starts(self, n: int, rng: np.random.Generator, model: Any = None) -> list[WholeBody]:
        """n robots standing in random postures ~ N(q0, 0.1 I), free of self-collision, hands where the scene admits.

        `model` is that of `WholeBody`, where the robot shall stand in a scene that is shown.

        Raises `UnconstrainError` if hardly any posture is admitted.
        """
        bodies: list[WholeBody] = []
        model = self._model if model is None else model
        body, tries = WholeBody(self.humanoid, model), 1000 + 100 * n
        for _ in range(tries):
            body.stand(self.humanoid.start_postures(1, rng)[0])
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
        self, obstacle: Barrier | None, bodies: list[WholeBody], *, policy=None, duration: float = DURATION
    ) -> Recording:
        """Let the robots move from where they stand, under the obstacle (one barrier each), and record their hands."""
        policy = policy or self.policy
        S, length = len(bodies), round(duration * FREQUENCY)
        X, U, Pi, commanded = np.empty((4, S, length, 6))
        N, blocked = np.empty((S, length, 6, 6)), np.empty((S, length, 2), dtype=bool)
        postures = np.empty((S, length, self._model.nq))
        for k in range(length):
            X[:, k] = [body.hands.ravel() for body in bodies]
            Pi[:, k] = policy(X[:, k])
            postures[:, k] = [body.data.qpos for body in bodies]
            N[:, k], blocked[:, k] = constrain(obstacle, X[:, k], Pi[:, k])
            commanded[:, k] = np.einsum("sij,sj->si", N[:, k], Pi[:, k])
            for s, body in enumerate(bodies):
                U[s, k] = body.move(commanded[s, k].reshape(2, 3), 1 / FREQUENCY).ravel()
        demonstrations = Demonstrations(
            states=X.reshape(-1, 6),
            actions=U.reshape(-1, 6),
            episodes=np.repeat(np.arange(S), length),
            time=np.tile(np.arange(length) / FREQUENCY, S),
            policy=Pi.reshape(-1, 6),
            projections=N.reshape(-1, 6, 6),
            state_names=STATE_NAMES,
            action_names=[f"{name}_velocity" for name in STATE_NAMES],
        )
        tracking = np.linalg.norm(U - commanded) / np.linalg.norm(commanded)
        return Recording(demonstrations, blocked.reshape(-1, 2), float(tracking), postures)
