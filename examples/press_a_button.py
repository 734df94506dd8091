"""
Movements that dwell, or come back the way they went
====================================================

For people who recorded a hand that goes somewhere, waits there and comes back. At each place there are two
velocities, and neither the place nor the velocity says which is next. How far the movement has come does: its
phase, which one option adds to the state.
"""

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import unconstrain as uc

# %%
# Twelve simulated presses of a button, in m, with 1 mm of noise: down to it, a second on it, back up. Each takes
# another time. Nothing is in the way here; what counts is what a state is.

rng = np.random.default_rng(0)
button, parts = np.array([0.3, 0.1, 0.0]), []
for run in range(12):
    t = np.arange(0, 4 * rng.uniform(0.9, 1.1), 0.04)
    gone = np.interp(t / t[-1], [0, 0.35, 0.6, 1], [0, 1, 1, 0])[:, None]
    start = [0, 0, 0.25] + 0.02 * rng.normal(size=3)
    hand = start + gone**2 * (3 - 2 * gone) * (button - start) + 0.001 * rng.normal(size=(len(t), 3))
    parts.append(pd.DataFrame(hand, columns=["x", "y", "z"]).assign(run=run, t=t))
table = pd.concat(parts)

# %%
# Four recordings are held out.

kinds = {"place": {}, "place and velocity": {"order": 2}, "place and phase": {"phase": True}}
policies, recordings = {}, {}
for name, options in kinds.items():
    demos = uc.load(table, state=["x", "y", "z"], time="t", episode="run", **options)
    training, held_out = demos.select(demos.episodes < 8), demos.select(demos.episodes >= 8)
    policy = uc.LocallyLinearPolicy().fit(training)
    policies[name], recordings[name] = policy, held_out
    for kind, learnt in {"": policy, ", ordinary regression": policy.ordinary_regression()}.items():
        score = learnt.score(held_out.states, held_out.actions, groups=held_out.episodes)
        print(f"{name}{kind}: {score:.1%} of what recordings held out show is explained")

# %%
# A phase binds the policy to a clock, and the clock does not wait: a robot that is held up turns round before it
# has reached the button. Both movements below begin at the start; the second has lost a quarter of its time.

policy, recorded = policies["place and phase"], recordings["place and phase"].episode(0)
figure, ax = plt.subplots(figsize=(7, 4), layout="constrained")
ax.plot(recorded.time, np.linalg.norm(recorded.states[:, :3] - button, axis=1), "k:", label="recorded")
for phase, label in ((0.0, "policy"), (0.25, "policy, held up for a second")):
    start = np.append(recorded.states[0, :3], phase)
    movement = policy.rollout(start, 400, 0.01, beyond=np.inf, stop_when=lambda X: X[:, -1] >= 1)
    away = np.linalg.norm(movement.states[:, :3] - button, axis=1)
    ax.plot(movement.time + 4 * phase, away, label=label)
    print(f"{label}: comes within {1000 * away.min():.0f} mm of the button")
ax.set(xlabel="time, s", ylabel="distance from the button, m")
ax.legend()
figure.savefig("press_a_button.png")
plt.show()
