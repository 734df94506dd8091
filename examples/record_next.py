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
# What it would record next, if the policy matters all over the square: a place to start from, and a direction
# along which motion has to be possible.

square = np.stack(np.meshgrid(*2 * [np.linspace(-0.9, 0.9, 13)]), axis=-1).reshape(-1, 2)
advice = report.next_recordings(6, candidates=square)
for number, one in enumerate(advice, start=1):
    print(
        f"{number}. from {one.state.round(2)}, free along {one.direction.round(2)}: "
        f"lessens the expected squared error by {one.gain:.0%}"
    )

# %%
# Does it help? The six are recorded, and beside them, ten times over, six others that start anywhere and slide
# along anything.

truth = LimitCycle()(square)


def error(policy):
    """Return the squared error all over the square, as a share of the true policy's variance."""
    missed = uc.metrics.unconstrained_policy_error(truth, policy.predict(square))
    return uc.metrics.normalized(missed, truth)


advised = record(np.array([one.state for one in advice]), np.array([one.direction for one in advice]), seed=2)
after = learn(uc.Demonstrations.concatenate([demos, advised]))
by_chance = []
for seed in range(10):
    chance = record(rng.uniform(-1, 1, (6, 2)), along(rng.uniform(0, np.pi, 6)), seed=3 + seed)
    by_chance.append(error(learn(uc.Demonstrations.concatenate([demos, chance]))))
regression = learn(demos, "direct")
print(f"nUPE of 28 movements {error(policy):.3f}; ordinary regression {error(regression):.3f}")
print(f"with the six that were advised {error(after):.3f}")
print(f"with six by chance {np.median(by_chance):.3f} (median; {min(by_chance):.3f} to {max(by_chance):.3f})")

# %%
# How far the policy may be from what was learnt, before and after, on one scale.

figure, axes = plt.subplots(1, 2, figsize=(11, 4.6), layout="constrained")
corners, levels = [[-1, -1], [1, 1]], [0.02, 0.05, 0.1, 0.2, 0.4, 0.8, 1.6]
uc.plot.identifiability(report, region=corners, levels=levels, worst=0, ax=axes[0])
for one in advice:
    ends = one.state - 0.12 * one.direction, one.state + 0.12 * one.direction
    axes[0].annotate("", *ends, arrowprops={"color": "red", "arrowstyle": "<|-|>", "linewidth": 2})
known = uc.identifiability(after, uc.Demonstrations.concatenate([demos, advised]))
uc.plot.identifiability(known, region=corners, levels=levels, worst=0, ax=axes[1])
for ax in axes:
    ax.set_xticks([-1, -0.5, 0, 0.5, 1])
axes[0].set_title("28 movements; arrows: record these next")
axes[1].set_title("with these six")
figure.savefig("record_next.png")
plt.show()
