"""The arm under MuJoCo's dynamics: servos follow a policy, and physics, not a projection, constrains the hand.

All joints have velocity servos of the same gain k (N m s/rad), which turn the policy into torques
``τ = k (π(q) - q̇)``. Where these dominate inertia, and the constraint A q̇ = 0 answers with forces ``Aᵀ f``, the
arm moves so that ``k (π - q̇) + Aᵀ f = 0`` and hence

    q̇ = (I - Aᵀ (A Aᵀ)⁻¹ A) π = N π:

equal gains make the passive answer of the joints the orthogonal projection of the method. How near to it inertia
leaves the movement is measured, not assumed.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reproduction.plants import arm
from reproduction.plants.arm_stage import GRIPPED, TIMESTEP, TIP, TIP_RADIUS, stage
from unconstrain.constraints import projection
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import UnconstrainError
from unconstrain.recordings.derivative import differentiate
from unconstrain.robots import Robot, import_mujoco
from unconstrain.simulation import simulate

Array = NDArray[np.float64]

ENCODER_NOISE = 1e-4
"""Standard deviation of recorded joint angles, in radians; 0.006°."""

SETTLING = 0.25
"""Seconds of movement, from rest, before recording begins."""

RATE = 50.0
"""Samples per second of a recording."""

WINDOW = 0.2
"""Seconds of recording that a velocity is taken from."""

DEPTH = (0.85, 1.0)
"""Of the table under the base of the hanging arm, in metres, uniform."""

TILT = np.radians(20.0)
"""Largest tilt of the table, in radians; uniform from zero."""

CLEARANCE = 0.02
"""Of the tip above the table at a start, at least, in metres."""


@dataclass(frozen=True)
class PhysicalRecording:
    """Recordings of arms in physics, and what only the simulation knows.

    Attributes
    ----------
    demonstrations : Demonstrations
        Recorded joint angles (rad) with encoder noise, and their velocities (rad/s) by differentiation; time in
        seconds; the true policy at the true joint angles; N of the ideal constraint at them (where the hand does
        not touch the table, I).
    contact_force : ndarray of shape (N, 3)
        Force of the constraint on the hand in newtons, in the world: of the table on the tip, along its normal. Not
        measured (NaN) where the hand is gripped.
    touching : ndarray of shape (N,), bool
        Whether the constraint held at the sample.
    normals : ndarray of shape (N, 3)
        The table's normal; NaN where the hand is gripped.
    tables : ndarray of shape (episodes, 7)
        Position and quaternion of the table of each episode; NaN where the hand is gripped.
    """

    demonstrations: Demonstrations
    contact_force: Array
    touching: NDArray[np.bool_]
    normals: Array
    tables: Array

    @property
    def ideal(self) -> Array:
        """The actions ``N π`` that the method supposes, (N, 7)."""
        assert self.demonstrations.projections is not None
        assert self.demonstrations.policy is not None
        return np.einsum("nij,nj->ni", self.demonstrations.projections, self.demonstrations.policy)

    def off_projection(self) -> Array:
        """Measure the angle between recorded action and ``N π`` at every sample.

        Returns
        -------
        ndarray of shape (N,)
            In radians; NaN where either is zero.
        """
        ideal, actions = self.ideal, self.demonstrations.actions
        lengths = np.linalg.norm(ideal, axis=1) * np.linalg.norm(actions, axis=1)
        along = np.einsum("ni,ni->n", ideal, actions)
        cosine = np.divide(along, lengths, out=np.full_like(along, np.nan), where=lengths > 0)
        return np.arccos(np.clip(cosine, -1.0, 1.0))


def demonstrate(
    scenario: str,
    policy: arm.PowerPolicy | None = None,
    n_episodes: int = 50,
    duration: float = 4.0,
    rate: float = RATE,
    *,
    encoder_noise: float = ENCODER_NOISE,
    random_state: int | np.random.Generator | None = None,
) -> PhysicalRecording:
    """Simulate movements of the arm to its zero posture, in physics.

    Parameters
    ----------
    scenario : str
        "gripped": the hand is held where it starts, free to turn, by MuJoCo's `connect` constraint (1-2-3).
        "table": the arm hangs above a table of random height and tilt, reaches down, and slides on it without
        friction.
    policy : PowerPolicy, optional
        In rad/s. By default p = 1.8 with gain 0.5: a step of the paper lasts 0.1 s.
    n_episodes : int
        Trajectories, simulated side by side.
    duration, rate : float
        Of a recording in seconds, and samples per second.
    encoder_noise : float
        Standard deviation of recorded joint angles, in radians.
    random_state : int, Generator or None
        The same number gives the same data.

    Returns
    -------
    PhysicalRecording
        ``n_episodes * duration * rate`` samples.

    Raises
    ------
    UnconstrainError
        If the scenario is unknown, a number is not positive, or a recording is too short to differentiate.
    """
    if n_episodes < 1 or not (0 < rate <= 1 / TIMESTEP) or not (duration > WINDOW) or not encoder_noise >= 0:
        raise UnconstrainError(
            f"give at least one episode, a duration above {WINDOW} s, a rate of up to {1 / TIMESTEP:g} samples per "
            f"second and no negative noise, not {n_episodes}, {duration}, {rate} and {encoder_noise}"
        )
    rng = np.random.default_rng(random_state)
    policy = policy or arm.PowerPolicy(1.8, gain=0.5)
    robot = stage(scenario)
    if scenario == GRIPPED:
        q, tables = arm.draw_starts(n_episodes, rng), np.full((n_episodes, 7), np.nan)
        mocap = np.hstack([robot.pose(q, arm.HAND)[0], np.tile([1.0, 0, 0, 0], (n_episodes, 1))])
    else:
        q, tables = _above_tables(robot, n_episodes, rng)
        mocap = tables
    every = round(1 / (rate * TIMESTEP))
    states, touch = _simulate(robot, policy, q, mocap, round(duration / (every * TIMESTEP)), every)
    length = states.shape[1]
    time = np.arange(length) * every * TIMESTEP
    recorded = states + encoder_noise * rng.standard_normal(states.shape)
    actions = np.stack([differentiate(one, time, window=WINDOW) for one in recorded])

    truth = states.reshape(-1, arm.JOINTS)
    normals = np.repeat(_normals(tables), length, axis=0)
    if scenario == GRIPPED:
        touching, A = np.ones(len(truth), dtype=bool), robot.jacobian(truth, arm.HAND)[:, :3]
        force = np.full((len(truth), 3), np.nan)
    else:
        touching = touch.ravel() > 0
        force = touch.reshape(-1, 1) * normals
        A = (
            np.einsum("ni,nij->nj", normals, robot.jacobian(truth, TIP)[:, :3])[:, None]
            * touching[:, None, None]
        )
    names = [f"joint{i + 1}" for i in range(arm.JOINTS)]
    demonstrations = Demonstrations(
        states=recorded.reshape(-1, arm.JOINTS),
        actions=actions.reshape(-1, arm.JOINTS),
        episodes=np.repeat(np.arange(n_episodes), length),
        time=np.tile(time, n_episodes),
        policy=policy(truth),
        projections=projection(A),
        state_names=names,
        action_names=[f"{name}_velocity" for name in names],
    )
    return PhysicalRecording(demonstrations, force, touching, normals, tables)


def _simulate(
    robot: Robot, policy: arm.PowerPolicy, q: Array, mocap: Array, samples: int, every: int
) -> tuple[Array, Array]:
    """Simulate joint angles (S, samples, 7) and touch (S, samples) in newtons, a sample each `every` steps."""
    batch = import_mujoco().batch.Batch(robot.model, len(q), 1)
    batch.qpos, batch.mocap_pos, batch.mocap_quat = q, mocap[:, None, :3], mocap[:, None, 3:]
    qpos, ctrl = batch.bind("qpos"), batch.bind("ctrl")
    touch = batch.bind("sensordata") if robot.model.nsensor else None
    forces: list[Array] = []

    # MuJoCo moves the arms: the policy's actions are what the servos are told, and only part of what happens.
    def advance(X: Array, U: Array) -> tuple[Array, Array]:
        ctrl[:] = U
        batch.step()
        # Forces are known after the step, and are those of the state before it.
        forces.append(np.zeros(len(q)) if touch is None else touch[:, 0].copy())
        return qpos.copy(), U

    settling = round(SETTLING / TIMESTEP)
    followed = simulate(policy, q, settling + (samples - 1) * every, TIMESTEP, advance=advance)
    states = followed.states.reshape(len(q), -1, arm.JOINTS)
    return states[:, settling::every], np.stack(forces[settling::every], axis=1)


def _above_tables(robot: Robot, count: int, rng: np.random.Generator) -> tuple[Array, Array]:
    """Draw starts (count, 7) whose tip is above their table, and the tables' positions and quaternions (count, 7)."""
    starts, tables = np.empty((count, arm.JOINTS)), np.empty((count, 7))
    done = 0
    while done < count:
        q = arm.draw_starts(4 * count, rng)
        depth, tilt, heading = rng.uniform([DEPTH[0], 0.0, -np.pi], [DEPTH[1], TILT, np.pi], (len(q), 3)).T
        # A turn by the tilt about a level axis of any heading.
        half = np.sin(tilt / 2)
        quat = np.stack([np.cos(tilt / 2), half * np.cos(heading), half * np.sin(heading), 0 * half], axis=1)
        place = np.stack([0 * depth, 0 * depth, -depth], axis=1)
        table = np.hstack([place, quat])
        tip, _ = robot.pose(q, TIP)
        above = np.flatnonzero(np.einsum("ni,ni->n", tip - place, _normals(table)) > TIP_RADIUS + CLEARANCE)
        taken = above[: count - done]
        starts[done : done + len(taken)], tables[done : done + len(taken)] = q[taken], table[taken]
        done += len(taken)
    return starts, tables


def _normals(tables: Array) -> Array:
    """Compute the z axes (N, 3) of tables (N, 7)."""
    w, x, y, z = tables[:, 3:].T
    return np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x**2 + y**2)], axis=1)
