"""
A Panda, guided by hand, and a wall it never met
================================================

For people who guide an arm of their own and record its joints: what they meant to do with the hand is learnt from
joint angles alone, though boards were in the way of most movements. Then it runs on the arm's dynamics at 500 Hz, free
and past a wall that was in no recording. It needs the extra `sim` and the robots of the package `example-robot-data`.
"""

# %%
# The arm as its maker describes it. Every frame of it can be asked for positions and Jacobians; the fingers stay
# shut. MuJoCo moves it: seven velocity servos of one gain with the maker's limits of torque, motors whose inertia is
# felt as 0.1 kg m², and gravity compensated, as the real arm does by itself. Only a ball at the hand's tip can touch
# something.

import base64
import os
import sys
import time
from functools import cache
from importlib.metadata import files

if sys.platform == "linux":
    os.environ.setdefault("MUJOCO_GL", "egl")  # draws without a screen

import imageio.v3 as imageio
import matplotlib.pyplot as plt
import mink
import mujoco
import numpy as np
from sklearn.base import BaseEstimator, clone

import unconstrain as uc
from unconstrain.robots import Robot

(urdf,) = [file for file in files("example-robot-data") if file.name == "panda.urdf"]
panda = Robot.load(urdf.locate(), lock=["panda_finger_joint1", "panda_finger_joint2"])
TIP = "panda_hand_tcp"
HOME = np.array([0.0, -0.5, 0.0, -2.2, 0.0, 1.75, 0.78])
GOAL = np.array([0.5, 0.25, 0.2])
TIMESTEP, SUBSTEPS = 0.001, 2
DT = SUBSTEPS * TIMESTEP


def equip(wall=None):
    """Give the arm servos, and a board that can be moved, or a wall of half sizes, position and turn about z."""
    spec = panda.spec.copy()
    spec.option.timestep = TIMESTEP
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    for body in spec.bodies[1:]:
        body.gravcomp = 1
    for geom in spec.geoms:
        geom.contype = geom.conaffinity = 0
        geom.rgba = [0.9, 0.9, 0.92, 1.0]
    for joint in spec.joints:
        joint.armature = 0.1
        servo = spec.add_actuator(name=joint.name, target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        servo.set_to_velocity(kv=50.0)
    smooth = {"contype": 1, "conaffinity": 1, "condim": 1, "solref": [2 * TIMESTEP, 1.0]}
    sphere, plane, box = (
        mujoco.mjtGeom.mjGEOM_SPHERE,
        mujoco.mjtGeom.mjGEOM_PLANE,
        mujoco.mjtGeom.mjGEOM_BOX,
    )
    tip = spec.body(TIP).add_geom(name="tip", type=sphere, size=[0.01, 0, 0], mass=0.01, **smooth)
    tip.rgba = [0.8, 0.3, 0.1, 1.0]
    if wall is None:
        board = spec.worldbody.add_body(name="board", mocap=True)
        board.add_geom(name="board", type=plane, size=[0.3, 0.3, 0.01], **smooth)
    else:
        size, place, turn = wall
        spec.worldbody.add_geom(
            name="wall", type=box, size=size, pos=place, quat=[np.cos(turn / 2), 0, 0, np.sin(turn / 2)],
            rgba=[0.2, 0.45, 0.75, 0.45], **smooth,
        )  # fmt: skip
    decorate(spec)
    return Robot(spec).model


def decorate(spec):
    """Add what is only to be seen: a bright room, and the goal."""
    sky, ramp = mujoco.mjtTexture.mjTEXTURE_SKYBOX, mujoco.mjtBuiltin.mjBUILTIN_GRADIENT
    spec.add_texture(
        name="sky", type=sky, builtin=ramp, rgb1=[1, 1, 1], rgb2=[0.85, 0.88, 0.92], width=64, height=384
    )
    spec.visual.headlight.ambient = [0.45, 0.45, 0.45]
    sphere, plane = mujoco.mjtGeom.mjGEOM_SPHERE, mujoco.mjtGeom.mjGEOM_PLANE
    seen = {"contype": 0, "conaffinity": 0}
    spec.worldbody.add_geom(name="floor", type=plane, size=[2, 2, 0.01], rgba=[0.9, 0.9, 0.9, 1], **seen)
    spec.worldbody.add_geom(
        name="goal", type=sphere, size=[0.02, 0, 0], pos=GOAL, rgba=[0.1, 0.6, 0.2, 1], **seen
    )


# %%
# The person is simulated: they lead the hand over the place it goes to, and down on it, while the elbow goes back to
# where it likes to be. Boards of many tilts are in the way of most of these movements; the hand slides along them. The
# recording has joint angles, as noisy as encoders are, and what a force sensor at the tip says.

MOVEMENTS, SECONDS = 36, 2.2


def lead(place):
    """The velocity (m/s) that the person wants the hand to have."""
    away = place - GOAL
    above = 0.25 * (1 - np.exp(-np.sum(away[..., :2] ** 2, axis=-1) / (2 * 0.12**2)))
    return 1.5 * (np.stack([0 * above, 0 * above, above], axis=-1) - away)


def inverse(J):
    """J⁺, where J has full rank."""
    return J.swapaxes(-1, -2) @ np.linalg.inv(J @ J.swapaxes(-1, -2))


def wanted(Q, place, J):
    """The joint velocities that give the hand its velocity, and else lead to the posture the person likes."""
    rest = HOME - Q
    return rest + np.einsum(
        "...ij,...j->...i", inverse(J), lead(place) - np.einsum("...ij,...j->...i", J, rest)
    )


def guide(model, q, board, normal):
    """Move the arm under MuJoCo, and record it 25 times a second after a start of 0.16 s."""
    data, tip, jacobian, contact = mujoco.MjData(model), model.body(TIP).id, np.zeros((3, 7)), np.zeros(6)
    data.qpos, data.mocap_pos[0] = q, board
    mujoco.mju_quatZ2Vec(data.mocap_quat[0], normal)
    rows = []
    for k in range(round(SECONDS / DT)):
        mujoco.mj_forward(model, data)
        mujoco.mj_jacBody(model, data, jacobian, None, tip)
        data.ctrl = wanted(data.qpos, data.xpos[tip], jacobian)
        if k % 20 == 0 and k >= 80:
            contact[:] = 0.0
            if data.ncon:
                mujoco.mj_contactForce(model, data, 0, contact)
            rows.append([k * DT, *data.qpos, *contact[0] * normal])
        mujoco.mj_step(model, data, SUBSTEPS)
    return np.array(rows)


rng = np.random.default_rng(0)
model, movements = equip(), []
while len(movements) < MOVEMENTS:
    q = np.clip(HOME + rng.normal(0, [0.5, *6 * [0.35]]), *panda.limits.T)
    normal = rng.normal([0.0, 0.0, 1.0])
    normal /= np.linalg.norm(normal)
    board = GOAL + rng.uniform(0.02, 0.15) * normal if len(movements) % 6 else np.array([0.0, 0.0, -5.0])
    (place,) = panda.pose(q[None], TIP)[0]
    if place[0] > 0.2 and place[2] > 0.15 and (place - board) @ normal > 0.05:
        movement = guide(model, q, board, normal)
        movement[:, 1:8] += rng.normal(0, 1e-4, movement[:, 1:8].shape)
        movement[:, 8:] += rng.normal(0, 0.2, movement[:, 8:].shape)
        movements.append(np.column_stack([np.full(len(movement), len(movements)), movement]))
columns = ["run", "t", *panda.joints, "fx", "fy", "fz"]
np.savetxt("panda.csv", np.concatenate(movements), delimiter=",", header=",".join(columns), comments="")

# %%
# From here on it is your file. Joint velocities come from the joint angles. What is learnt is a policy over the
# joints: there a contact takes away the part of the motion along one direction, the row ``nᵀJ`` of the Jacobian,
# since all servos are alike. Of the hand's own velocity it would take away a slanted part. But not any policy of
# seven joints will do: it is the velocity of a hand, which depends on where the hand is, brought to the joints by
# ``J⁺``, and a pull on the posture that leaves the hand alone. Three methods make that a feature map.

demos = uc.load("panda.csv", state=list(panda.joints), time="t", episode="run")
print(*demos.notes, sep="\n")


class OfTheHand(BaseEstimator):
    """π(q) = J⁺(q) W b(hand) + (I - J⁺J)(r + s * q): W, r and s are learnt."""

    def __init__(self, hand):
        self.hand = hand

    def fit(self, X, d):
        self.basis_ = clone(self.hand).fit(panda.pose(X, TIP)[0])
        # The fit comes back to the same postures many times.
        self.kept_ = cache(lambda postures: self.fields(np.frombuffer(postures).reshape(-1, panda.n)))
        return self

    def along(self, X, directions):
        return np.einsum("nd,ndp->np", directions, self.kept_(X.tobytes()))

    def evaluate(self, X, w):
        return self.fields(X) @ w

    def fields(self, Q):
        J = panda.jacobian(Q, TIP)[:, :3]
        inward = inverse(J)
        still = np.eye(panda.n) - inward @ J
        hand = inward[:, :, :, None] * self.basis_.transform(panda.pose(Q, TIP)[0])[:, None, None, :]
        return np.concatenate([hand.reshape(len(Q), panda.n, -1), still, still * Q[:, None]], axis=2)

    def parts(self, w):
        """Return the hand's policy, compiled, and the pull on the posture, r and s."""
        W, pull = np.split(w, [-2 * panda.n])
        return self.basis_.compile(W.reshape(3, -1)), pull.reshape(2, -1)


# %%
# Three ways to learn it from the first 28 movements: by ordinary regression; by inferring what was free; and by being
# told by the sensor, through the Jacobian, which direction the board took away. The simulation knows what the person
# wanted, so the other eight movements show how wrong each is.

J = panda.jacobian(demos.states, TIP)[:, :3]
forces = np.loadtxt("panda.csv", delimiter=",", skiprows=1)[:, -3:]
known = uc.constraints.from_forces(
    forces, 2.0, actions=demos.actions, jacobian=J, episodes=demos.episodes, margin=1
)
new = demos.episodes >= 28
truth = wanted(demos.states, panda.pose(demos.states, TIP)[0], J)
ways = {
    "ordinary regression": ("direct", None),
    "free inferred": ("adaptive", None),
    "told by the sensor": ("adaptive", known[~new]),
}
policies = {}
for name, (risk, projections) in ways.items():
    policy = uc.ParametricPolicy(OfTheHand(uc.NormalizedRBF(15)), risk=risk)
    policy.fit(demos.states[~new], demos.actions[~new], groups=demos.episodes[~new], projections=projections)
    error = uc.metrics.unconstrained_policy_error(truth[new], policy.predict(demos.states[new]))
    print(f"{name}: nUPE {uc.metrics.normalized(error, truth[new]):.4f}")
    policies[name] = policy
learnt = policies["free inferred"]
touched = np.linalg.norm(forces[~new], axis=1) > 2.0
print(f"free: {1 - touched.mean():.0%} by the sensor, {learnt.free_share_:.0%} inferred without it")

# %%
# On the robot. The hand's part of what was learnt is compiled for the control loop. Every 2 ms mink turns its velocity
# into joint velocities: those that move the hand so and, as far as that leaves it open, pull on the posture as the
# person did. They keep to the joints' limits and to 80 % of the maker's velocities, and no link comes nearer to the
# wall than 2 cm, written as Pink writes barriers: at a distance ``h`` it approaches at ``BRAKING (h - 2 cm)`` at most.

VELOCITIES = np.array([2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61])
CLEARANCE, BRAKING = 0.02, 4.0


class KeepAway(mink.Limit):
    """Every link from the elbow on keeps its distance from the wall, and brakes before."""

    def __init__(self, model):
        self.model, self.wall = model, model.geom("wall").id
        elbow, last = model.body("panda_link4").id, model.body("panda_rightfinger").id
        self.geoms = [i for i in range(model.ngeom) if elbow <= model.geom_bodyid[i] <= last]

    def nearest(self, data):
        """Yield each geom, its distance up to 0.3 m, and the nearest points of it and of the wall."""
        for geom in self.geoms:
            ends = np.empty(6)
            yield (
                geom,
                mujoco.mj_geomDistance(self.model, data, geom, self.wall, 0.3, ends),
                ends[:3],
                ends[3:],
            )

    def compute_qp_inequalities(self, configuration, dt):
        rows, room, jacobian = [], [], np.empty((3, self.model.nv))
        for geom, distance, own, other in self.nearest(configuration.data):
            if 0 < distance < 0.3:
                mujoco.mj_jac(
                    self.model, configuration.data, jacobian, None, own, self.model.geom_bodyid[geom]
                )
                rows.append((other - own) / distance @ jacobian)
                room.append(BRAKING * dt * (distance - CLEARANCE))
        return mink.Constraint(np.array(rows), np.array(room)) if rows else mink.Constraint()


def run(model, policy, wall=None, seconds=5.0):
    """Run a policy on the arm, and log what happened and how long the loop took."""
    hand, (offset, slope) = policy.features_.parts(policy.weights_)
    data, tip = mujoco.MjData(model), model.body(TIP).id
    data.qpos = START
    configuration = mink.Configuration(model)
    reach = mink.FrameTask(TIP, "body", position_cost=1.0, orientation_cost=0.0)
    posture = mink.PostureTask(model, cost=0.02)
    limits = [
        mink.ConfigurationLimit(model, gain=0.1),
        mink.VelocityLimit(model, dict(zip(panda.joints, 0.8 * VELOCITIES, strict=True))),
        *([wall] if wall else []),
    ]
    log = {name: [] for name in ("posture", "hand", "velocity", "clock", "processor", "distance")}
    for _ in range(round(seconds / DT)):
        clock, processor = time.perf_counter(), time.thread_time()
        configuration.update(data.qpos)
        place = configuration.data.xpos[tip].copy()
        pose = configuration.get_transform_frame_to_world(TIP, "body")
        reach.set_target(mink.SE3.from_translation(DT * hand(place)) @ pose)
        posture.set_target(data.qpos + DT * (offset + slope * data.qpos))
        data.ctrl = mink.solve_ik(configuration, [reach, posture], DT, "daqp", limits=limits)
        log["clock"].append(1e3 * (time.perf_counter() - clock))
        log["processor"].append(1e3 * (time.thread_time() - processor))
        log["posture"].append(data.qpos.copy())
        log["hand"].append(place)
        if wall:
            log["distance"].append(min(distance for _, distance, *_ in wall.nearest(configuration.data)))
        mujoco.mj_step(model, data, SUBSTEPS)
        log["velocity"].append(data.qvel.copy())
    return {name: np.array(values) for name, values in log.items()}


START = HOME + np.array([-0.9, 0.1, 0.0, 0.2, 0.0, 0.0, 0.0])
WALL = ([0.12, 0.01, 0.35], [0.46, -0.02, 0.35], -1.1)
empty, walled = equip(), equip(WALL)
runs = {
    "ordinary regression": run(empty, policies["ordinary regression"]),
    "free": run(empty, learnt),
    "with the wall": run(walled, learnt, KeepAway(walled)),
}
for name, log in runs.items():
    room = np.minimum(log["posture"] - panda.limits[:, 0], panda.limits[:, 1] - log["posture"])
    print(
        f"{name}: ends {100 * np.linalg.norm(log['hand'][-1] - GOAL):.1f} cm from the goal; joints stay "
        f"{np.degrees(room.min()):.0f}° within their limits, and below "
        f"{np.abs(log['velocity'] / VELOCITIES).max():.0%} of the maker's velocities"
    )
    clock, processor = np.percentile(log["clock"], 99), np.percentile(log["processor"], 99)
    print(
        f"  of the 2 ms a step took {log['clock'].mean():.2f} ms in the mean; 99 % took at most {clock:.2f} ms by the "
        f"clock, {processor:.2f} ms of the processor"
    )
print(f"nearest to the wall: {100 * runs['with the wall']['distance'].min():.1f} cm")

# %%
# A rollout of the policy knows no inertia, no servos and no limits. How far the arm's dynamics take the hand from it,
# without a wall, is the price of the servos' lag:

steps = len(runs["free"]["hand"]) // 10
rollout = learnt.rollout(START, steps=steps - 1, dt=10 * DT, beyond=np.inf)
ideal = panda.pose(rollout.states, TIP)[0]
apart = np.linalg.norm(ideal - runs["free"]["hand"][::10][: len(ideal)], axis=1)
print(
    f"dynamics and rollout are at most {100 * apart.max():.1f} cm apart, {100 * apart[-1]:.1f} cm at the end"
)

# %%
# The picture: the hand's paths from above and from the side, those that were recorded in grey, and the arm as it
# slides along the wall.


def film(name, model, every=25):
    """Draw every so many postures of a run."""
    data, camera = mujoco.MjData(model), mujoco.MjvCamera()
    camera.lookat, camera.distance, camera.azimuth, camera.elevation = [0.25, 0.0, 0.4], 1.7, 215, -25
    with mujoco.Renderer(model, 368, 368) as renderer:
        renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = False
        for q in runs[name]["posture"][::every]:
            data.qpos = q
            mujoco.mj_forward(model, data)
            renderer.update_scene(data, camera)
            yield renderer.render().copy()


frames = list(map(np.hstack, zip(film("free", empty), film("with the wall", walled), strict=True)))
figure, axes = plt.subplots(1, 3, figsize=(12, 4.4), layout="constrained", width_ratios=[0.8, 1.2, 1.1])
paths = [panda.pose(demos.states[demos.episodes == e], TIP)[0] for e in np.unique(demos.episodes[~new])]
for ax, pair in zip(axes, ([0, 1], [1, 2]), strict=False):
    for path in paths:
        ax.plot(*path[:, pair].T, color="0.85", linewidth=0.8)
    for name, log in runs.items():
        ax.plot(*log["hand"][:, pair].T, label=name)
    ax.plot(*GOAL[pair], "k*", markersize=10)
    ax.set(aspect="equal", xlabel=f"{'xyz'[pair[0]]} (m)", ylabel=f"{'xyz'[pair[1]]} (m)")
(half, *_), place, turn = WALL
ends = np.array(place[:2]) + half * np.array([[-1.0], [1.0]]) * [np.cos(turn), np.sin(turn)]
axes[0].plot(*ends.T, color="tab:blue", linewidth=5, alpha=0.5, solid_capstyle="butt", zorder=0)
axes[0].set_title("from above")
axes[1].set_title("from the side")
axes[1].legend(loc="lower left", fontsize="small")
axes[2].imshow(frames[int(1.4 * 20)][:, 368:])
axes[2].set_title("at the wall, 1.4 s")
axes[2].set_axis_off()
figure.savefig("robot_panda.png", dpi=110)
plt.show()

# %%
# The video, with the free run on the left:


class Film:
    """A video that a page can show."""

    def __init__(self, path):
        self.path = path

    def _repr_html_(self):
        with open(self.path, "rb") as file:
            video = base64.b64encode(file.read()).decode()
        return f'<video controls muted style="max-width: 100%" src="data:video/mp4;base64,{video}"></video>'


imageio.imwrite("robot_panda.mp4", frames, fps=20)
Film("robot_panda.mp4")
