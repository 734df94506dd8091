"""
A Panda, guided by hand
=======================

For people who guide an arm of their own and record its joints: what they meant to do with the hand is learnt from
joint angles alone, though boards were in the way of most movements. `robot_wall.py` then runs it on the arm, past a
wall. It needs the extra `sim` and the robots of the package `example-robot-data`.
"""

# %%
# The arm as its maker describes it. Every frame of it can be asked for positions and Jacobians; the fingers stay
# shut. MuJoCo moves it: seven velocity servos of one gain with the maker's limits of torque, motors whose inertia is
# felt as 0.1 kg m², and gravity compensated, as the real arm does by itself. Only a ball at the hand's tip can touch
# something.

from importlib.metadata import files
from pathlib import Path

import matplotlib.pyplot as plt
import mujoco
import numpy as np

import unconstrain as uc
from unconstrain.robots import Robot

(urdf,) = [file for file in files("example-robot-data") if file.name == "panda.urdf"]
panda = Robot.load(urdf.locate(), lock=["panda_finger_joint1", "panda_finger_joint2"])
TIP = "panda_hand_tcp"
TIMESTEP, SUBSTEPS = 0.001, 2

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
sphere, plane = mujoco.mjtGeom.mjGEOM_SPHERE, mujoco.mjtGeom.mjGEOM_PLANE
smooth = {"contype": 1, "conaffinity": 1, "condim": 1, "solref": [2 * TIMESTEP, 1.0]}
ball = {"size": [0.01, 0, 0], "mass": 0.01, "rgba": [0.8, 0.3, 0.1, 1.0]}
spec.body(TIP).add_geom(name="tip", type=sphere, **ball, **smooth)
spec.worldbody.add_body(name="board", mocap=True).add_geom(
    name="board", type=plane, size=[0.3, 0.3, 0.01], **smooth
)
model = spec.compile()

# %%
# The person is simulated: they lead the hand over the place it goes to, and down on it, while the elbow goes back to
# where it likes to be. Boards of many tilts are in the way of most of these movements; the hand slides along them. The
# recording has joint angles, as noisy as encoders are, and what a force sensor at the tip says.

HOME = np.array([0.0, -0.5, 0.0, -2.2, 0.0, 1.75, 0.78])
GOAL = np.array([0.5, 0.25, 0.2])
MOVEMENTS, SECONDS = 60, 2.2


def lead(place):
    """The velocity (m/s) that the person wants the hand to have."""
    away = place - GOAL
    above = 0.25 * (1 - np.exp(-np.sum(away[..., :2] ** 2, axis=-1) / (2 * 0.12**2)))
    return 1.5 * (np.stack([0 * above, 0 * above, above], axis=-1) - away)


def wanted(Q, place, J):
    """The joint velocities that give the hand its velocity, and else lead to the posture the person likes."""
    rest, inverse = HOME - Q, np.linalg.pinv(J)
    return rest + np.matvec(inverse, lead(place) - np.matvec(J, rest))


def guide(q, board, normal):
    """Move the arm under MuJoCo, and record it 25 times a second after a start of 0.16 s."""
    data, tip, jacobian, contact = mujoco.MjData(model), model.body(TIP).id, np.zeros((3, 7)), np.zeros(6)
    data.qpos, data.mocap_pos[0] = q, board
    mujoco.mju_quatZ2Vec(data.mocap_quat[0], normal)
    rows = []
    for k in range(round(SECONDS / (SUBSTEPS * TIMESTEP))):
        mujoco.mj_forward(model, data)
        mujoco.mj_jacBody(model, data, jacobian, None, tip)
        data.ctrl = wanted(data.qpos, data.xpos[tip], jacobian)
        if k % 20 == 0 and k >= 80:
            contact[:] = 0.0
            if data.ncon:
                mujoco.mj_contactForce(model, data, 0, contact)
            rows.append([data.time, *data.qpos, *contact[0] * normal])
        mujoco.mj_step(model, data, SUBSTEPS)
    return np.array(rows)


rng = np.random.default_rng(0)
movements = []
while len(movements) < MOVEMENTS:
    q = np.clip(HOME + rng.normal(0, [0.5, *6 * [0.35]]), *panda.limits.T)
    normal = rng.normal([0.0, 0.0, 1.0])
    normal /= np.linalg.norm(normal)
    board = GOAL + rng.uniform(0.02, 0.15) * normal if len(movements) % 6 else np.array([0.0, 0.0, -5.0])
    (place,) = panda.pose(q[None], TIP)[0]
    if place[0] > 0.2 and place[2] > 0.15 and (place - board) @ normal > 0.05:
        movement = guide(q, board, normal)
        movement[:, 1:8] += rng.normal(0, 1e-4, movement[:, 1:8].shape)
        movement[:, 8:] += rng.normal(0, 0.2, movement[:, 8:].shape)
        movements.append(np.column_stack([np.full(len(movement), len(movements)), movement]))
columns = ["run", "t", *panda.joints, "fx", "fy", "fz"]
np.savetxt("panda.csv", np.concatenate(movements), delimiter=",", header=",".join(columns), comments="")

# %%
# From here on it is your file. Joint velocities come from the joint angles. What is learnt is a policy over the
# joints: there a contact takes away the part of the motion along one direction, the row ``nᵀJ`` of the Jacobian,
# since all servos are alike; of the hand's own velocity it takes a slanted part. But not any policy of seven joints
# will do. `HandFeatures` are those of a hand's velocity, which depends on where the hand is, and a pull on the
# posture that leaves the hand alone.

demos = uc.load("panda.csv", state=list(panda.joints), time="t", episode="run")
print(*demos.notes, sep="\n")
features = uc.robots.HandFeatures(panda, TIP, uc.NormalizedRBF(15))

# %%
# Three ways to learn it from the first 48 movements: by ordinary regression; by inferring what was free; and by being
# told by the sensor, through the Jacobian, which direction the board took away. The simulation knows what the person
# wanted, so the other twelve movements show how wrong each is.

J = panda.jacobian(demos.states, TIP)[:, :3]
forces = np.loadtxt("panda.csv", delimiter=",", skiprows=1)[:, -3:]
known = uc.constraints.from_forces(
    forces, 2.0, actions=demos.actions, jacobian=J, episodes=demos.episodes, margin=1
)
new = demos.episodes >= 48
truth = wanted(demos.states, panda.pose(demos.states, TIP)[0], J)
ways = {
    "ordinary regression": ("direct", None),
    "free inferred": ("adaptive", None),
    "told by the sensor": ("adaptive", known[~new]),
}
policies = {}
for name, (risk, projections) in ways.items():
    policy = uc.ParametricPolicy(features, risk=risk)
    policy.fit(demos.states[~new], demos.actions[~new], groups=demos.episodes[~new], projections=projections)
    error = uc.metrics.unconstrained_policy_error(truth[new], policy.predict(demos.states[new]))
    print(f"{name}: nUPE {uc.metrics.normalized(error, truth[new]):.4f}")
    policies[name] = policy
learnt = policies["free inferred"]
touched = np.linalg.norm(forces[~new], axis=1) > 2.0
print(f"free: {1 - touched.mean():.0%} by the sensor, {learnt.free_share_:.0%} inferred without it")
print(uc.identifiability(learnt, demos.states[~new], demos.actions[~new], groups=demos.episodes[~new]))

# %%
# Where each leads the hand from a start of its own. What follows is for `robot_wall.py`: the arm, the hand's policy
# compiled for a control loop, from place to velocity, and the pull on the posture.

figure, axes = plt.subplots(1, 2, figsize=(9, 4.2), layout="constrained")
start = HOME + np.array([-0.9, 0.1, 0.0, 0.2, 0.0, 0.0, 0.0])
paths = [panda.pose(demos.states[demos.episodes == e], TIP)[0] for e in np.unique(demos.episodes[~new])]
for ax, (i, j), view in zip(axes, [(0, 1), (1, 2)], ["from above", "from the side"], strict=True):
    for path in paths:
        ax.plot(path[:, i], path[:, j], color="0.85", linewidth=0.8)
    ax.plot(GOAL[i], GOAL[j], "k*", markersize=10, label="the goal")
    ax.set(title=view, aspect="equal", xlabel=f"{'xyz'[i]} (m)", ylabel=f"{'xyz'[j]} (m)")
for name, policy in policies.items():
    led = panda.pose(policy.rollout(start, steps=200, dt=0.02, beyond=np.inf).states, TIP)[0]
    axes[0].plot(led[:, 0], led[:, 1])
    axes[1].plot(led[:, 1], led[:, 2], label=name)
    print(f"{name}: ends {100 * np.linalg.norm(led[-1] - GOAL):.1f} cm from the goal")
    offset, slope = policy.features_.posture(policy.weights_)
    policy.features_.hand(policy.weights_).save(f"{name}.npz")
    np.save(f"{name}, posture.npy", [offset, slope])
axes[1].legend(loc="lower left", fontsize="small")
Path("panda.xml").write_text(spec.to_xml())
figure.savefig("robot_panda.png", dpi=110)
plt.show()
