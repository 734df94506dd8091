"""
What is not determined, and what to record next
===============================================

For people who are about to trust a policy, or to record more. Along directions in which no recording could move, the policy is
a guess. Before the robot moves, this says how much of it is a guess, where, and what should be recorded there.
"""

import matplotlib.pyplot as plt
import numpy as np

import unconstrain as uc
from unconstrain.limit_cycle import LimitCycle
from unconstrain.simulation import simulate

# %%
# Eight simulated movements around a circle. Those on the right half slide along walls that all run the same way, those on the
# left half along walls of all directions. So on the right one direction was never seen.


def record(starts, walls, seed):
    """Simulate a movement from each start, along a wall whose normal has the angle that is given."""
    normals = np.stack([np.cos(walls), np.sin(walls)], axis=1)[:, None]
    N = uc.constraints.projection(normals)
    simulated = simulate(LimitCycle(), starts, steps=29, dt=0.02, project=lambda k, X, U: N)
    noise = 0.02 * np.random.default_rng(seed).normal(size=simulated.actions.shape)
    return uc.Demonstrations(simulated.states, simulated.actions + noise, episodes=simulated.episodes)


rng = np.random.default_rng(0)
right = rng.uniform([0.3, -1], [1, 1], (14, 2))
left = rng.uniform([-1, -1], [-0.1, 1], (14, 2))
walls = np.concatenate([np.zeros(14), rng.uniform(0, np.pi, 14)])
demos = record(np.concatenate([right, left]), walls, seed=1)

policy = uc.ParametricPolicy(uc.NormalizedRBF(n_centers=16), risk="inconsistency").fit(demos)
report = uc.identifiability(policy, demos)
print(report)

# %%
# What it would record next: a place, and the direction that has to be free there.

advice = report.next_recordings(4)
print(*advice, sep="\n")
