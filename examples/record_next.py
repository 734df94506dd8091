"""
What is not determined, and what to record next
===============================================

For people who are about to trust a policy, or to record more. Along directions in which no recording could
move, the policy is a guess. This says how much of it is a guess and where, and which recordings would help
most.
"""

import matplotlib.pyplot as plt
import numpy as np

import unconstrain as uc
from unconstrain.limit_cycle import LimitCycle
from unconstrain.simulation import simulate

# %%
# Simulated movements around a circle, each along a wall. On the right all walls stand upright, so that no hand
# could move sideways there; on the left they stand anyhow.


def record(starts, free, seed):
    """Simulate a movement from each start, (n, 2), that can move along one direction of length one, (n, 2), only."""
    N = free[:, :, None] * free[:, None]
    simulated = simulate(LimitCycle(), starts, steps=29, dt=0.02, project=lambda k, X, U: N)
    noise = 0.02 * np.random.default_rng(seed).normal(size=simulated.actions.shape)
    return uc.Demonstrations(simulated.states, simulated.actions + noise, episodes=simulated.episodes)


def along(angles):
    """Return directions of length one."""
    return np.stack([np.cos(angles), np.sin(angles)], axis=1)


rng = np.random.default_rng(0)
starts = np.concatenate([rng.uniform([0.2, -1], [1, 1], (14, 2)), rng.uniform([-1, -1], [-0.2, 1], (14, 2))])
upright = np.full(14, np.pi / 2)
demos = record(starts, along(np.concatenate([upright, rng.uniform(0, np.pi, 14)])), seed=1)


def learn(demos, risk="inconsistency"):
    """Learn from movements of which it is known that all slide along something."""
    return uc.ParametricPolicy(uc.NormalizedRBF(n_centers=16), risk=risk).fit(demos)


policy = learn(demos)
report = uc.identifiability(policy, demos)
print(report)

# %%
# What it would record next: a place to start from, and a direction along which motion has to be possible.

advice = report.next_recordings(4)
for number, one in enumerate(advice, start=1):
    print(
        f"{number}. from {one.state.round(2)}, free along {one.direction.round(2)}: "
        f"lessens the expected squared error by {one.gain:.0%}"
    )

# %%
# Does it help? The four are recorded, and beside them, ten times over, four others that start anywhere and slide
# along anything.

others = uc.Demonstrations(grid := rng.uniform(-0.9, 0.9, (400, 2)), LimitCycle()(grid))


def error(policy):
    """Return the squared error all over the square, as a share of the true policy's variance."""
    missed = uc.metrics.unconstrained_policy_error(others.actions, policy.predict(others.states))
    return uc.metrics.normalized(missed, others.actions)


advised = record(np.array([one.state for one in advice]), np.array([one.direction for one in advice]), seed=2)
after = learn(uc.Demonstrations.concatenate([demos, advised]))
by_chance = []
for seed in range(10):
    chance = record(rng.uniform(-1, 1, (4, 2)), along(rng.uniform(0, np.pi, 4)), seed=3 + seed)
    by_chance.append(error(learn(uc.Demonstrations.concatenate([demos, chance]))))
regression = learn(demos, "direct")
print(f"nUPE of 28 movements {error(policy):.3f}; ordinary regression {error(regression):.3f}")
print(f"with the four that were advised {error(after):.3f}")
print(
    f"with four by chance {np.median(by_chance):.3f} (median; {min(by_chance):.3f} to {max(by_chance):.3f})"
)

# %%
# How far the policy may be from what was learnt, before and after, on one scale.

figure, axes = plt.subplots(1, 2, figsize=(11, 4.6), layout="constrained")
square, levels = [[-1, -1], [1, 1]], [0, 0.05, 0.1, 0.2, 0.4, 0.8, 1.6]
uc.plot.identifiability(report, region=square, levels=levels, worst=0, ax=axes[0])
for one in advice:
    axes[0].annotate(
        "", one.state + 0.25 * one.direction, one.state, arrowprops={"color": "C3", "arrowstyle": "<|-|>"}
    )
known = uc.identifiability(after, uc.Demonstrations.concatenate([demos, advised]))
uc.plot.identifiability(known, region=square, levels=levels, worst=0, ax=axes[1])
axes[0].set_title("28 movements; arrows: record these next")
axes[1].set_title("with these four")
figure.savefig("record_next.png")
plt.show()
