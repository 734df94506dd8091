"""A humanoid that demonstrates a posture, a wall in the way of its hands (section 4.4)."""

from itertools import count

import numpy as np
from numpy.typing import NDArray

from reproduction.plants.barrier import CLEARANCE, Wall, find_blocking
from reproduction.plants.humanoid import Humanoid
from unconstrain.constraints import projection
from unconstrain.demonstrations import Demonstrations
from unconstrain.simulation import check_size, simulate

Array = NDArray[np.float64]

WEIGHT = 0.05
"""W = 0.05 I in φ = (x - x_c)ᵀ W (x - x_c), so that π = -∇φ = -0.1 (x - x_c)."""

TILT = np.pi / 4
"""The wall is turned to the side and tilted by up to this, in radians, uniformly."""

NEAREST, FARTHEST = 0.3, 0.9
"""Where the wall stands, uniformly, as a share of the way from the hands at home to the hands outstretched."""


def draw_walls(humanoid: Humanoid, hands: Array, rng: np.random.Generator) -> Wall:
    """Draw a wall in front of the robot for each of the hands' starts (S, 2, 3), anew while a hand is too near.

    Where a hand starts so far out that no such wall leaves it room, the walls drawn move farther away.
    """
    (home, out), _ = humanoid.hand_motion(np.stack([humanoid.home, humanoid.outstretched]))
    points, normals = np.empty((2, len(hands), 3))
    for start, point, normal in zip(hands, points, normals, strict=True):
        for draw in count():
            farthest = FARTHEST + 0.1 * (draw // 100)
            share, yaw, pitch = rng.uniform([NEAREST, -TILT, -TILT], [farthest, TILT, TILT])
            point[:] = (1 - share) * home.mean(axis=0) + share * out.mean(axis=0)
            normal[:] = -np.cos(yaw) * np.cos(pitch), -np.sin(yaw) * np.cos(pitch), np.sin(pitch)
            if ((start - point) @ normal > CLEARANCE).all():
                break
    return Wall(points, normals)


def demonstrate(
    humanoid: Humanoid,
    n_episodes: int = 100,
    length: int = 100,
    *,
    random_state: int | np.random.Generator | None = None,
) -> tuple[Demonstrations, NDArray[np.bool_]]:
    """Simulate movements towards the outstretched posture, `x ← x + N(x) π(x)`, a wall in the way of the hands.

    A hand nearer to its movement's wall than `CLEARANCE`, that the policy would bring nearer still, must not move
    along the wall's normal n: `nᵀ J_hand(x) u = 0` is then a row of A, over the n joints. A joint at its limit is
    held.

    Parameters
    ----------
    humanoid : Humanoid
        That moves.
    n_episodes, length : int
        Number of movements, all simulated side by side, and of samples in each.
    random_state : int, Generator or None
        The same number gives the same data.

    Returns
    -------
    demonstrations : Demonstrations
        ``n_episodes * length`` samples over the humanoid's joints, in radians and radians per step, with the true
        policy and projections. Time counts steps.
    blocked : ndarray of shape (N,), bool
        Samples at which the wall stops a hand.
    """
    rng = np.random.default_rng(random_state)
    check_size(n_episodes, length, humanoid.n, humanoid.n, constrained=True)
    starts = humanoid.draw_postures(n_episodes, rng)
    wall = draw_walls(humanoid, humanoid.hand_motion(starts)[0], rng)
    blocked: list[NDArray[np.bool_]] = []

    def project(sample: int, X: Array, wanted: Array) -> Array:
        hands, J = humanoid.hand_motion(X)
        rows, touching = find_blocking(wall, hands, np.einsum("shdn,sn->shd", J, wanted))
        blocked.append(np.any(touching, axis=1))
        A = np.einsum("shd,shdn->shn", rows[:, :, 0], J)
        return _project_within(humanoid.robot.limits, A, X, wanted)

    demonstrations = simulate(
        lambda X: -2 * WEIGHT * (X - humanoid.outstretched),
        starts,
        length - 1,
        1.0,
        project=project,
        state_names=humanoid.robot.joints,
        action_names=humanoid.robot.joints,
    )
    return demonstrations, np.stack(blocked, axis=1).ravel()


def _project_within(limits: Array, A: Array, X: Array, wanted: Array) -> Array:
    """Compute projections N (S, n, n) under rows A (S, k, n), so that no joint is led out of its limits (n, 2).

    A joint whose next step would leave them is held as well, which is one more row of A: its own unit vector.
    """
    free = np.ones(X.shape, dtype=bool)
    N, u = np.empty((*X.shape, X.shape[1])), np.empty(X.shape)
    changed = np.arange(len(X))
    while len(changed):
        still = free[changed]
        # Rows over the free joints alone project these; held joints do not move, whatever the others do.
        N[changed] = projection(A[changed] * still[:, None]) * (still[:, :, None] & still[:, None, :])
        u[changed] = np.einsum("sij,sj->si", N[changed], wanted[changed])
        leaving = (X + u < limits[:, 0]) | (X + u > limits[:, 1])
        leaving &= free & (u != 0)
        free &= ~leaving
        changed = np.flatnonzero(leaving.any(axis=1))
    return N
