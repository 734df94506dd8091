"""The DLR lightweight arm LWR-III, seven joints: closed-form kinematics for many postures at once (section 4.2).

The same arm as a MuJoCo model, with shapes and inertias, is `models/lwr.xml`, which `load_robot()` loads.
"""

from dataclasses import dataclass
from importlib.resources import as_file, files

import numpy as np
from numpy.typing import ArrayLike, NDArray

from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError, UnconstrainError
from unconstrain.robots import Robot, TaskConstraint
from unconstrain.simulation import Policy, check_size, simulate

Array = NDArray[np.float64]

# Denavit-Hartenberg parameters; all a are zero, all joint axes z.
OFFSETS = np.array([0.31, 0.0, 0.4, 0.0, 0.39, 0.0, 0.078])
"""d, in metres."""

TWISTS = np.array([1, -1, -1, 1, 1, -1, 0])
"""α, in quarter turns."""

LIMITS = np.radians([170.0, 120.0, 170.0, 120.0, 170.0, 120.0, 170.0])
"""Every joint turns this far either way, in radians."""

JOINTS = 7
HAND = "hand"
"""The frame at the end of the arm in `models/lwr.xml`."""


@dataclass(frozen=True)
class PowerPolicy:
    """The paper's policy over joint angles: down the slope of a sum of powers, to the zero posture.

        π(x) = -gain ∇ Σ_i |x_i|^p,    π_i = -gain p sign(x_i) |x_i|^(p - 1).

    Parameters
    ----------
    p : float
        1.5, 1.8 and 2.0 in the paper. Linear for 2; below, with infinite slope at 0.
    gain : float
        0.05 in the paper, per step.
    """

    p: float = 2.0
    gain: float = 0.05

    def __post_init__(self) -> None:
        if not (np.isfinite(self.p) and self.p > 1 and np.isfinite(self.gain) and self.gain > 0):
            raise UnconstrainError(
                f"the policy needs a power above 1 and a positive gain, not {self.p} and {self.gain}"
            )

    def __call__(self, X: ArrayLike) -> Array:
        """Return actions (N, 7) in radians per step at joint angles X (N, 7) in radians."""
        X = np.asarray(X, dtype=np.float64)
        return -self.gain * self.p * np.sign(X) * np.abs(X) ** (self.p - 1)


def pose(Q: ArrayLike) -> tuple[Array, Array]:
    """Compute positions (N, 3) in metres and rotations (N, 3, 3) of the hand at joint angles Q (N, 7)."""
    axes, _, hand = _chain(_postures(Q))
    return hand, axes[-1]


def jacobian(Q: ArrayLike) -> Array:
    """Compute geometric Jacobians J (N, 6, 7) of the hand at joint angles Q (N, 7).

    They give velocity and angular velocity in the base's frame, ``(v, ω) = J q̇``.

    Column i is ``(z_i × (p - p_i), z_i)``, with z_i the axis of joint i, p_i a point on it and p the hand.
    """
    turns, origins, hand = _chain(_postures(Q))
    axes = np.stack([turn[:, :, 2] for turn in turns[:JOINTS]], axis=1)
    arms = hand[:, None] - np.stack(origins, axis=1)
    return np.concatenate([np.cross(axes, arms), axes], axis=2).swapaxes(1, 2)


def load_robot() -> Robot:
    """Load the arm for MuJoCo. Raises `UnconstrainError` where the extra `sim` is not installed."""
    with as_file(files("reproduction.plants") / "models" / "lwr.xml") as path:
        return Robot.load(path)


def draw_starts(n_episodes: int, random_state: int | np.random.Generator | None = None) -> Array:
    """Draw postures (n_episodes, 7), each joint uniform in the middle half of its range, in radians."""
    rng = np.random.default_rng(random_state)
    return rng.uniform(-LIMITS / 2, LIMITS / 2, (n_episodes, JOINTS))


def demonstrate(
    constraint: str | ArrayLike | TaskConstraint = "1-2-3",
    policy: PowerPolicy | None = None,
    n_episodes: int = 100,
    length: int = 100,
    step: float = 1.0,
    *,
    random_state: int | np.random.Generator | None = None,
) -> Demonstrations:
    """Simulate movements of the arm to its zero posture while its hand is constrained.

    They begin at random starts, with ``u = N(x) π(x)``, ``N = I - A⁺A``, ``A = S J(x)``, and ``x ← x + step u``.

    Parameters
    ----------
    constraint : str, array_like, or TaskConstraint
        On the hand: task rows "1-2-3", the normal of a plane, or a matrix; see `TaskConstraint.parse`.
    policy : PowerPolicy, optional
        By default the linear one.
    n_episodes, length : int
        Number of trajectories, all simulated side by side, and of samples in each.
    step : float
        How long an action lasts. The paper does not say; 1 reproduces its figures.
    random_state : int, Generator or None
        The same number gives the same data.

    Returns
    -------
    Demonstrations
        ``n_episodes * length`` samples of joint angles (rad) and actions (rad per unit of time), with the
        true policy and projections.

    Raises
    ------
    UnconstrainError
        If a number is not positive, the constraint is not understood, or the samples do not fit into memory.
    """
    if n_episodes < 1 or length < 1 or not (np.isfinite(step) and step > 0):
        raise UnconstrainError(
            f"demonstrations need at least one episode and sample and a positive step, not {n_episodes}, "
            f"{length} and {step}"
        )
    constraint, policy = TaskConstraint.parse(constraint), policy or PowerPolicy()
    check_size(n_episodes, length, JOINTS, JOINTS, constrained=True)
    return follow(constraint, policy, draw_starts(n_episodes, random_state), length, step)


def follow(
    constraint: TaskConstraint, policy: Policy, starts: ArrayLike, length: int = 100, step: float = 1.0
) -> Demonstrations:
    """Follow any policy from given starts under a constraint on the hand.

    Parameters
    ----------
    constraint : TaskConstraint
        On the hand.
    policy : object with ``predict(X)``, or callable ``X -> U``
        Over joint angles: the true one, or one that was learnt.
    starts : array_like of shape (S, 7) or (7,)
        In radians.
    length : int
        Number of samples of each trajectory.
    step : float
        How long an action lasts.

    Returns
    -------
    Demonstrations
        As for `demonstrate`.
    """
    return simulate(
        policy,
        starts,
        length - 1,
        step,
        project=lambda k, X, wanted: constraint.projections(jacobian(X)),
        state_names=[f"joint{i + 1}" for i in range(JOINTS)],
    )


def _chain(Q: Array) -> tuple[list[Array], list[Array], Array]:
    """Compute orientations (N, 3, 3) of the eight link frames, origins (N, 3) of the seven joints, and the hand's."""
    turn, place = np.broadcast_to(np.eye(3), (len(Q), 3, 3)), np.zeros((len(Q), 3))
    turns, origins = [turn], []
    cos, sin = np.cos(Q), np.sin(Q)
    for i in range(JOINTS):
        origins.append(place)
        place = place + OFFSETS[i] * turn[:, :, 2]
        # A turn about z by q, then about the new x by a multiple of 90°: exact, no cosine of π/2 to round.
        x = turn[:, :, 0] * cos[:, i, None] + turn[:, :, 1] * sin[:, i, None]
        y = turn[:, :, 1] * cos[:, i, None] - turn[:, :, 0] * sin[:, i, None]
        z = turn[:, :, 2]
        y, z = {0: (y, z), 1: (z, -y), -1: (-z, y)}[int(TWISTS[i])]
        turn = np.stack([x, y, z], axis=2)
        turns.append(turn)
    return turns, origins, place


def _postures(Q: ArrayLike) -> Array:
    Q = np.asarray(Q, dtype=np.float64)
    if Q.ndim != 2 or Q.shape[1] != JOINTS:
        raise DataError(f"the arm has {JOINTS} joints: give postures of shape (N, {JOINTS}), not {Q.shape}")
    if not np.isfinite(Q).all():
        raise DataError("a posture of the arm has NaN or infinity: give joint angles in radians")
    return Q
