"""
A pose: turning a cup into its saucer
=====================================

For people whose recordings hold orientations, as quaternions from a tracker or a robot, and movements that make
sense relative to an object only. Quaternions change their sign in recordings, and the object stands and is
turned elsewhere each time. Two options say so.
"""

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

import unconstrain as uc

# %%
# Twenty-four simulated movements of a cup to a saucer. Relative to the saucer the cup comes straight, and turns
# as it comes. Each movement is cut in three; in most thirds something holds the cup along one direction of space,
# or about one axis, another one each time.

rng = np.random.default_rng(0)
PARTS, DT, SAMPLES = ("x", "y", "z", "qx", "qy", "qz", "qw"), 0.05, 60


def wanted(p, r):
    """Return the velocity and the angular velocity that the person wants at place p and rotation vector r."""
    return -1.2 * p, -1.0 * r


def move(run):
    """Simulate a movement of 3 s, as a tracker sees it in the room: places to 0.5 mm, a sign that changes."""
    saucer, place = Rotation.from_rotvec(rng.normal(size=3)), rng.normal(size=3)
    p, r = 0.3 * rng.normal(size=3), Rotation.from_rotvec(0.8 * rng.normal(size=3))
    rows = []
    for k in range(SAMPLES):
        if k % 20 == 0:
            across = rng.normal(size=3)
            across /= np.linalg.norm(across)
            holds = rng.choice(["nothing", "velocity", "turning"])
        quaternion = (saucer * r).as_quat() * (-1 if rng.random() < 0.1 else 1)
        seen = place + saucer.apply(p) + 0.0005 * rng.normal(size=3)
        rows.append([*seen, *quaternion, *place, *saucer.as_quat()])
        v, w = wanted(p, r.as_rotvec())
        if holds == "velocity":
            v = v - (across @ v) * across
        elif holds == "turning":
            w = w - (across @ w) * across
        p, r = p + DT * v, Rotation.from_rotvec(DT * w) * r
    names = [f"{what}.{part}" for what in ("cup", "saucer") for part in PARTS]
    return pd.DataFrame(rows, columns=names).assign(run=run, t=DT * np.arange(SAMPLES))


table = pd.concat([move(run) for run in range(24)])

# %%
# ``rotation`` says which columns are a quaternion, ``relative_to`` what the movement is relative to. Six
# movements are held out.

options = {"state": "cup", "rotation": [f"cup.{part}" for part in PARTS[3:]], "time": "t", "episode": "run"}
demos = uc.load(table, relative_to="saucer", **options)
room = uc.load(table, **options)
print(demos.space)


def error(policy, seen):
    """Return the squared errors of velocity and angular velocity on movements held out, as shares of the variance."""
    held_out = seen.select(seen.episodes >= 18)
    p, r = held_out.states[:, :3], Rotation.from_quat(held_out.states[:, 3:]).as_rotvec()
    missed = np.split(policy.predict(held_out.states), 2, axis=1)
    parts = zip(wanted(p, r), missed, strict=True)
    return [uc.metrics.normalized(uc.metrics.unconstrained_policy_error(Pi, P), Pi) for Pi, P in parts]


policy = uc.LocallyLinearPolicy(n_centers=10).fit(demos.select(demos.episodes < 18))
for name, learnt in {"contact inferred": policy, "ordinary regression": policy.ordinary_regression()}.items():
    moves, turns = error(learnt, demos)
    print(f"{name}: nUPE of the velocity {moves:.2g}, of the angular velocity {turns:.2g}")

# %%
# Without ``relative_to`` the same movements, seen in the room, say nothing of where the saucer is.

lost = uc.LocallyLinearPolicy(n_centers=10).fit(room.select(room.episodes < 18))
held_out = room.select(room.episodes >= 18)
score = lost.score(held_out.states, held_out.actions, groups=held_out.episodes)
print(f"in the room {score:.0%} of what movements held out show is explained")

# %%
# Drawn: how far the cup is from its place, and how far it is turned, from the starts of the movements held out.

figure, axes = plt.subplots(1, 2, figsize=(9, 3.8), layout="constrained")
lines = {
    "recorded, bent": (None, "0.6"),
    "policy": (policy, "C0"),
    "ordinary regression": (policy.ordinary_regression(), "C1"),
}
for label, (learnt, color) in lines.items():
    for k in range(18, 24):
        shown = demos.episode(k)
        if learnt is not None:
            shown = learnt.rollout(shown.states[:1], steps=SAMPLES - 1, dt=DT, beyond=np.inf)
        far = np.linalg.norm(shown.states[:, :3], axis=1)
        turned = np.degrees(Rotation.from_quat(shown.states[:, 3:]).magnitude())
        axes[0].plot(shown.time, far, color=color, label=label if k == 18 else None)
        axes[1].plot(shown.time, turned, color=color)
axes[0].set(xlabel="time, s", ylabel="distance from the saucer, m")
axes[1].set(xlabel="time, s", ylabel="turned from the saucer, degrees")
figure.legend(loc="outside upper center", ncols=3)
figure.savefig("rotation.png")
plt.show()
