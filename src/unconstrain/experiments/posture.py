"""A posture in 27 dimensions, with a wall in the way of the hands (section 4.4)."""

import numpy as np
from numpy.typing import NDArray

from unconstrain import risk
from unconstrain.constraints import projection
from unconstrain.demonstrations import Demonstrations
from unconstrain.plants.barrier import CLEARANCE, Wall, blocking
from unconstrain.plants.humanoid import Humanoid
from unconstrain.policies import ParametricPolicy

Array = NDArray[np.float64]

WEIGHT = 0.05
"""W = 0.05 I in φ = (x - x_c)ᵀ W (x - x_c), so that π = -∇φ = -0.1 (x - x_c)."""

TILT = np.pi / 4
"""The wall is turned to the side and tilted by up to this, in radians, uniformly."""

NEAREST, FARTHEST = 0.3, 0.9
"""Where the wall stands, uniformly, as a share of the way from the hands at home to the hands outstretched."""

HELD_OUT = 0.2
"""Movements made for the test alone, as a share of those to learn from."""


def walls(humanoid: Humanoid, hands: Array, rng: np.random.Generator) -> Wall:
    """A wall in front of the robot for each of the hands' starts (S, 2, 3), drawn anew while a hand is too near."""
    (home, out), _ = humanoid.hand_motion(np.stack([humanoid.home, humanoid.outstretched]))
    points, normals = np.empty((2, len(hands), 3))
    for start, point, normal in zip(hands, points, normals, strict=True):
        while True:
            share, yaw, pitch = rng.uniform([NEAREST, -TILT, -TILT], [FARTHEST, TILT, TILT])
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
    """Movements towards the outstretched posture, `x ← x + N(x) π(x)`, with a wall in the way of the hands.

    A hand nearer to its movement's wall than `CLEARANCE`, that the policy would bring nearer still, must not move
    along the wall's normal n: `nᵀ J_hand(x) u = 0` is then a row of A, over the n joints. A joint at its limit is
    held.

    Returns
    -------
    demonstrations : Demonstrations
        ``n_episodes * length`` samples over the humanoid's joints, in radians and radians per step, with the true
        policy and projections. Time counts steps.
    blocked : array (N,) of bool
        Samples at which the wall stops a hand.
    """
    rng = np.random.default_rng(random_state)
    n = humanoid.n
    x = humanoid.start_postures(n_episodes, rng)
    wall = walls(humanoid, humanoid.hand_motion(x)[0], rng)
    states, wanted, actions = np.empty((3, n_episodes, length, n))
    N = np.empty((n_episodes, length, n, n))
    blocked = np.empty((n_episodes, length), dtype=bool)
    for k in range(length):
        states[:, k] = x
        wanted[:, k] = -2 * WEIGHT * (x - humanoid.outstretched)
        hands, J = humanoid.hand_motion(x)
        rows, touching = blocking(wall, hands, np.einsum("shdn,sn->shd", J, wanted[:, k]))
        A = np.einsum("shd,shdn->shn", rows[:, :, 0], J)
        N[:, k], actions[:, k] = _constrained(A, wanted[:, k], x, humanoid.robot.limits)
        blocked[:, k] = touching.any(axis=1)
        x = x + actions[:, k]
    demonstrations = Demonstrations(
        states=states.reshape(-1, n),
        actions=actions.reshape(-1, n),
        episodes=np.repeat(np.arange(n_episodes), length),
        time=np.tile(np.arange(float(length)), n_episodes),
        policy=wanted.reshape(-1, n),
        projections=N.reshape(-1, n, n),
        state_names=humanoid.robot.joints,
        action_names=humanoid.robot.joints,
    )
    return demonstrations, blocked.ravel()


def _constrained(A: Array, wanted: Array, x: Array, limits: Array) -> tuple[Array, Array]:
    """Projections N (S, n, n) and actions (S, n) under rows A (S, k, n), no joint led out of its limits (n, 2).

    A joint whose next step would leave them is held as well, which is one more row of A: its own unit vector.
    """
    free = np.ones(x.shape, dtype=bool)
    N, u = np.empty((*x.shape, x.shape[1])), np.empty(x.shape)
    changed = np.arange(len(x))
    while len(changed):
        still = free[changed]
        # Rows over the free joints alone project these; held joints do not move, whatever the others do.
        N[changed] = projection(A[changed] * still[:, None]) * (still[:, :, None] & still[:, None, :])
        u[changed] = np.einsum("sij,sj->si", N[changed], wanted[changed])
        leaving = (x + u < limits[:, 0]) | (x + u > limits[:, 1])
        leaving &= free & (u != 0)
        free &= ~leaving
        changed = np.flatnonzero(leaving.any(axis=1))
    return N, u


def trial(humanoid: Humanoid, seed: int, n_episodes: int = 100, length: int = 100) -> dict[str, float]:
    """One data set: normalised errors of a linear policy on movements it has not seen, and what the wall did."""
    held_out = max(1, round(HELD_OUT * n_episodes))
    everything, blocked = demonstrate(humanoid, n_episodes + held_out, length, random_state=seed)
    train = everything.select(everything.episodes < n_episodes)
    test = everything.select(everything.episodes >= n_episodes)
    result = {}
    for name in ("inconsistency", "direct"):
        policy = ParametricPolicy(risk=name, alpha="cv").fit(
            train.states, train.actions, groups=train.episodes
        )
        P = policy.predict(test.states)
        result[f"{name} nUPE"] = risk.normalized(risk.unconstrained_policy_error(test.policy, P), test.policy)
        error = risk.constrained_policy_error(test.policy, P, test.projections)
        result[f"{name} nCPE"] = risk.normalized(error, test.policy)
    blocked = blocked[: len(train)].reshape(n_episodes, length)
    result["samples blocked"] = float(blocked.mean())
    result["movements blocked"] = float(blocked.any(axis=1).mean())
    return result
