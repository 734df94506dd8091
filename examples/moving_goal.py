"""
A goal that stands elsewhere each time
======================================

For people who recorded reaching for something that is never at the same place twice. In the room such movements
have no policy: the same place is passed in all directions. Relative to the goal they have one, and one option
says so.
"""

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import unconstrain as uc

# %%
# Twenty simulated reaches on a table, in m. The person swings in from the side. In three of four reaches a ruler
# lies in the way, along which the hand slides for the middle third.

rng = np.random.default_rng(0)
DT, SAMPLES = 0.02, 120


def wanted(away):
    """Return the velocity that the person wants, from where the hand is relative to the goal."""
    towards = -1.5 * away + 1.0 * np.stack([away[..., 1], -away[..., 0]], axis=-1)
    return towards / np.sqrt(1 + np.sum(away**2, axis=-1, keepdims=True) / 0.3**2)  # nobody is fast far away


def reach(run):
    """Simulate a reach of 2.4 s."""
    goal = rng.uniform(-1, 1, 2)
    x = goal + 0.5 * rng.normal(size=2)
    across = rng.normal(size=2)
    across /= np.linalg.norm(across)
    blocked, rows = rng.random() < 0.75, []
    for k in range(SAMPLES):
        rows.append([*(x + 0.0005 * rng.normal(size=2)), *goal])
        u = wanted(x - goal) + 0.02 * rng.normal(size=2)
        if blocked and 40 <= k < 80:
            u = u - (across @ u) * across
        x = x + DT * u
    return pd.DataFrame(rows, columns=["x", "y", "cup_x", "cup_y"]).assign(run=run, t=DT * np.arange(SAMPLES))


table = pd.concat([reach(run) for run in range(20)])

# %%
# ``relative_to`` takes the columns that say where the goal is. ``relative_to="goal"`` would take where each
# episode ends.

options = {"state": ["x", "y"], "time": "t", "episode": "run"}
demos = uc.load(table, relative_to=["cup_x", "cup_y"], **options)
room = uc.load(table, **options)
candidates = {
    "local models": uc.LocallyLinearPolicy(),
    "25 RBFs": uc.ParametricPolicy(uc.NormalizedRBF(n_centers=25)),
    "64 RBFs": uc.ParametricPolicy(uc.NormalizedRBF(n_centers=64)),
}
policies = {}
for name, seen in {"relative to the goal": demos, "in the room": room}.items():
    chosen = uc.select_policy(candidates, seen.select(seen.episodes < 15))
    policies[name] = chosen.policies[chosen.name]
    held_out = seen.select(seen.episodes >= 15)
    score = policies[name].score(held_out.states, held_out.actions, groups=held_out.episodes)
    print(f"{name}, {chosen.name}: {score:.1%} of what reaches held out show is explained")

# %%
# Here the truth is known: what is learnt relative to the goal against ordinary regression, by the same model.

policy = policies["relative to the goal"]
held_out = demos.select(demos.episodes >= 15)
truth = wanted(held_out.states)
for name, learnt in {"contact inferred": policy, "ordinary regression": policy.ordinary_regression()}.items():
    missed = uc.metrics.unconstrained_policy_error(truth, learnt.predict(held_out.states))
    print(f"{name}: nUPE {uc.metrics.normalized(missed, truth):.4f}")

# %%
# Relative to the goal, the policy is followed from the starts of the reaches held out, with nothing in the way.

figure, axes = plt.subplots(1, 2, figsize=(9, 3.9), layout="constrained")
for episode in range(15, 20):
    axes[0].plot(*room.episode(episode).states.T, color="0.6", label="recorded" if episode == 15 else None)
    goal = table[table.run == episode][["cup_x", "cup_y"]].iloc[0]
    axes[0].plot(*goal, "kx", label="goal" if episode == 15 else None)
    recorded = demos.episode(episode)
    movement = policy.rollout(recorded.states[0], steps=2 * SAMPLES, dt=DT, beyond=np.inf)
    axes[1].plot(*recorded.states.T, color="0.6", label="recorded" if episode == 15 else None)
    axes[1].plot(*movement.states.T, color="C0", label="policy" if episode == 15 else None)
axes[1].plot(0, 0, "kx", label="goal")
axes[0].set(xlabel="x, m", ylabel="y, m", title="In the room", aspect="equal")
axes[1].set(
    xlabel="x from the goal, m", ylabel="y from the goal, m", title="Relative to the goal", aspect="equal"
)
for ax in axes:
    ax.legend()
figure.savefig("moving_goal.png")
plt.show()
