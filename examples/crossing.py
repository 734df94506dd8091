"""
Movements that cross themselves
===============================

For people who recorded figures of eight, letters or knots, where one place is passed in several directions. A
policy that knows the place alone cannot say which. With the velocity as part of the state, and the acceleration
as the action, it can.
"""

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import unconstrain as uc

# %%
# Eight simulated recordings of a figure of eight, in m, of another size and with other beginnings, with 0.2 mm of
# noise. Nothing is in the way here, so regression learns the same; what counts is what a state is.

rng = np.random.default_rng(0)
t = np.arange(600) * 0.02
parts = []
for run in range(8):
    phase, size = t + rng.uniform(0, 6), 0.2 * rng.uniform(0.9, 1.1)
    path = size * np.column_stack([np.sin(phase), np.sin(2 * phase)]) + 0.0002 * rng.normal(size=(600, 2))
    parts.append(pd.DataFrame(path, columns=["x", "y"]).assign(run=run, t=t))
table = pd.concat(parts)

# %%
# ``order=2`` adds the velocity. Two recordings are held out.

policies, recordings = {}, {}
for name, order in {"place alone": 1, "place and velocity": 2}.items():
    demos = uc.load(table, state=["x", "y"], time="t", episode="run", order=order)
    training, held_out = demos.select(demos.episodes < 6), demos.select(demos.episodes >= 6)
    policy = uc.LocallyLinearPolicy().fit(training)
    policies[name], recordings[name] = policy, held_out
    for kind, learnt in {"": policy, ", ordinary regression": policy.ordinary_regression()}.items():
        score = learnt.score(held_out.states, held_out.actions, groups=held_out.episodes)
        print(f"{name}{kind}: {score:.1%} of what recordings held out show is explained")

# %%
# Both are followed from the start of a recording that was held out, for its 12 s. An acceleration that is held
# for a step leads outwards a little, so steps are short: 4 ms. With 20 ms the eight grows by a quarter in that
# time.

figure, axes = plt.subplots(1, 2, figsize=(9, 4.5), layout="constrained")
for ax, (name, policy) in zip(axes, policies.items(), strict=True):
    recorded = recordings[name].episode(0)
    movement = policy.rollout(recorded.states[0], steps=3000, dt=0.004, beyond=np.inf)
    uc.plot.rollout(movement.states[:, :2], recorded.states[:, :2], ax=ax)
    ax.set(title=name, xlabel="x, m", ylabel="y, m")
figure.savefig("crossing.png")
plt.show()
