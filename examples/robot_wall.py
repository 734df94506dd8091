"""
A learnt policy on an arm, past a wall
======================================

For people who want to see what was learnt move an arm: a Panda in MuJoCo's dynamics at 500 Hz, its hand led by the
policy of `robot_panda.py`, its joints by mink within their limits; first free, then past a wall that was in no
recording. Run `robot_panda.py` before, in the same folder.
"""

# %%
# The arm with its servos, as the other example left it; a room to look at, and a wall on the way.

import base64
import os
import sys
import time
from pathlib import Path

if sys.platform == "linux":
    os.environ.setdefault("MUJOCO_GL", "egl")  # draws without a screen

import imageio.v3 as imageio
import matplotlib.pyplot as plt
import mink
import mujoco
import numpy as np

import unconstrain as uc
from unconstrain.robots import Robot

if not Path("panda.xml").exists():
    raise SystemExit("there is no panda.xml here: run robot_panda.py first, in this folder")
panda = Robot.load("panda.xml")
TIP, GOAL = "panda_hand_tcp", np.array([0.5, 0.25, 0.2])
START = np.array([-0.9, -0.4, 0.0, -2.0, 0.0, 1.75, 0.78])
WALL, TURN = {"size": [0.12, 0.01, 0.35], "pos": [0.46, -0.02, 0.35]}, -1.1
SUBSTEPS = 2
DT = SUBSTEPS * panda.model.opt.timestep


def build(wall):
    """Put the arm into a room, the board away, and a wall there or not."""
    spec = panda.spec.copy()
    sky, ramp = mujoco.mjtTexture.mjTEXTURE_SKYBOX, mujoco.mjtBuiltin.mjBUILTIN_GRADIENT
    spec.add_texture(
        name="sky", type=sky, builtin=ramp, rgb1=[1, 1, 1], rgb2=[0.85, 0.88, 0.92], width=64, height=384
    )
    spec.visual.headlight.ambient = [0.45, 0.45, 0.45]
    spec.body("board").pos = [0.0, 0.0, -5.0]
    seen = {"contype": 0, "conaffinity": 0}
    sphere, plane, box = (getattr(mujoco.mjtGeom, f"mjGEOM_{name}") for name in ("SPHERE", "PLANE", "BOX"))
    room = spec.worldbody
    room.add_geom(name="floor", type=plane, size=[2, 2, 0.01], rgba=[0.9, 0.9, 0.9, 1], **seen)
    room.add_geom(name="goal", type=sphere, size=[0.02, 0, 0], pos=GOAL, rgba=[0.1, 0.6, 0.2, 1], **seen)
    if wall:
        turn = [np.cos(TURN / 2), 0, 0, np.sin(TURN / 2)]
        room.add_geom(name="wall", type=box, quat=turn, rgba=[0.2, 0.45, 0.75, 0.45], **WALL)
    return spec.compile()


empty, walled = build(wall=False), build(wall=True)

# %%
# Every 2 ms the policy says where the hand shall go, and mink turns that into joint velocities: those that move the
# hand so and, as far as that leaves it open, pull on the posture as the person did. They keep to the joints' limits
# and to 80 % of the maker's velocities, and no link comes nearer to the wall than 2 cm, written as Pink writes
# barriers: at a distance ``h`` it approaches at ``BRAKING (h - 2 cm)`` at most.

VELOCITIES = np.array([2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61])
CLEARANCE, BRAKING = 0.02, 4.0


class KeepAway(mink.Limit):
    """Every link from the elbow on keeps its distance from the wall, and brakes before."""

    def __init__(self, model):
        self.model, self.wall = model, model.geom("wall").id
        elbow, last = model.body("panda_link4").id, model.body("panda_rightfinger").id
        self.geoms = [i for i in range(model.ngeom) if elbow <= model.geom_bodyid[i] <= last]

    def nearest(self, data):
        """Yield the body of each shape, its distance up to 0.3 m, and the nearest points of it and the wall."""
        for geom in self.geoms:
            ends = np.empty(6)
            distance = mujoco.mj_geomDistance(self.model, data, geom, self.wall, 0.3, ends)
            yield self.model.geom_bodyid[geom], distance, ends[:3], ends[3:]

    def compute_qp_inequalities(self, configuration, dt):
        rows, room, jacobian = [], [], np.empty((3, self.model.nv))
        for body, distance, own, other in self.nearest(configuration.data):
            if 0 < distance < 0.3:
                mujoco.mj_jac(self.model, configuration.data, jacobian, None, own, body)
                rows.append((other - own) / distance @ jacobian)
                room.append(BRAKING * dt * (distance - CLEARANCE))
        return mink.Constraint(np.array(rows), np.array(room)) if rows else mink.Constraint()


def run(model, policy, wall=None, seconds=5.0):
    """Run a policy on the arm, and log what happened and how long the loop took."""
    hand, (offset, slope) = uc.load_compiled(f"{policy}.npz"), np.load(f"{policy}, posture.npy")
    data, tip = mujoco.MjData(model), model.body(TIP).id
    data.qpos = START
    configuration = mink.Configuration(model)
    reach = mink.FrameTask(TIP, "body", position_cost=1.0, orientation_cost=0.0)
    posture = mink.PostureTask(model, cost=0.03)
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


runs = {
    "ordinary regression": run(empty, "ordinary regression"),
    "free": run(empty, "free inferred"),
    "with the wall": run(walled, "free inferred", KeepAway(walled)),
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
nearest = runs["with the wall"]["distance"].min()
print(f"nearest to the wall: {1e3 * nearest:.1f} mm, where {1e3 * CLEARANCE:.0f} mm were asked for")

# %%
# A rollout knows no inertia, no servos and no limits. How far the arm's dynamics take the hand from it, without a
# wall, is what the servos' lag costs.

hand, path, apart = uc.load_compiled("free inferred.npz"), runs["free"]["hand"], []
place = path[0]
for there in path:
    apart.append(100 * np.linalg.norm(there - place))
    place = place + DT * hand(place)
print(f"dynamics and rollout are at most {max(apart):.1f} cm apart, {apart[-1]:.1f} cm at the end")

# %%
# The picture: the hand's paths from above and from the side, and the arm as it slides along the wall. Past
# the wall's edge the path has small bends, where the nearest points of hand and wall change.


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
for ax, pair in zip(axes, ([0, 1], [1, 2]), strict=False):
    for name, log in runs.items():
        ax.plot(*log["hand"][:, pair].T, label=name)
    ax.plot(*GOAL[pair], "k*", markersize=10)
    ax.set(aspect="equal", xlabel=f"{'xyz'[pair[0]]} (m)", ylabel=f"{'xyz'[pair[1]]} (m)")
half = WALL["size"][0] * np.array([np.cos(TURN), np.sin(TURN)])
ends = np.array([WALL["pos"][:2] - half, WALL["pos"][:2] + half])
axes[0].plot(*ends.T, color="tab:blue", linewidth=5, alpha=0.5, solid_capstyle="butt", zorder=0)
axes[0].set_title("from above")
axes[1].set_title("from the side")
axes[1].legend(loc="lower left", fontsize="small")
axes[2].imshow(frames[int(1.4 * 20)][:, 368:])
axes[2].set_title("at the wall, 1.4 s")
axes[2].set_axis_off()
figure.savefig("robot_wall.png", dpi=110)
plt.show()

# %%
# The video, with the free run on the left:

# sphinx_gallery_capture_repr = ('_repr_html_',)


class Film:
    """A video that a page can show."""

    def __init__(self, path):
        self.video = base64.b64encode(Path(path).read_bytes()).decode()

    def _repr_html_(self):
        source = f"data:video/mp4;base64,{self.video}"
        return f'<video controls muted style="max-width: 100%" src="{source}"></video>'


imageio.imwrite("robot_wall.mp4", frames, fps=20)
Film("robot_wall.mp4")
