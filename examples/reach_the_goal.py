"""
A movement that ends at its goal, from everywhere
=================================================

For people who let a robot follow a learnt policy to an end. Where nobody was recorded a policy says anything,
and may come to rest beside the goal, or run past it. `stabilized` changes it as little as it takes to end at
the goal from everywhere, also under a constraint that leaves a way.
"""

import matplotlib.pyplot as plt
import numpy as np

import unconstrain as uc
from unconstrain.simulation import simulate

# %%
# Twenty-four simulated reaches to a goal in bows, in m. In the first half of each a ruler lies in the way,
# another way each time.

GOAL, DT = np.array([0.2, 0.1]), 0.02


def wanted(X):
    """Return the velocity (m/s) that the person wants."""
    away = X - GOAL
    bow = np.stack([-away[:, 1], away[:, 0]], axis=1) * np.tanh(3 * away[:, :1] + 1)
    way = -away - 0.8 * bow
    return 0.4 * way / np.sqrt(0.25**2 + np.sum(way**2, axis=1, keepdims=True))  # slower near the goal


def record(starts, seed):
    """Simulate a reach of 4 s from each start."""
    rng = np.random.default_rng(seed)
    rulers = uc.constraints.projection(rng.normal(size=(len(starts), 1, 2)))
    moved = simulate(
        wanted,
        starts,
        149,
        DT,
        project=lambda k, X, U: rulers if k < 60 else np.tile(np.eye(2), (len(X), 1, 1)),
    )
    noise = 0.01 * rng.normal(size=moved.actions.shape)
    return uc.Demonstrations(
        moved.states,
        moved.actions + noise,
        moved.episodes,
        moved.time,
        moved.policy,
        state_names=("x [m]", "y [m]"),
    )


rng = np.random.default_rng(0)
starts = rng.uniform([-0.8, -0.5], [-0.3, 0.7], (34, 2))
demos, others = record(starts[:24], seed=1), record(starts[24:], seed=2)
policy = uc.ParametricPolicy(uc.NormalizedRBF(n_centers=25)).fit(demos)
stable = policy.stabilized(GOAL, demos)


def error(policy):
    """Return the squared error on other reaches, as a share of the policy's variance."""
    missed = uc.metrics.unconstrained_policy_error(others.policy, policy.predict(others.states))
    return uc.metrics.normalized(missed, others.policy)


regression = policy.ordinary_regression()
print(
    f"nUPE: policy {error(policy):.4f}, stabilised {error(stable):.4f}, ordinary regression {error(regression):.3f}"
)

# %%
# From a grid of starts, most of them far from what was recorded, for 10 s.

grid = np.stack(np.meshgrid(*2 * [np.linspace(-1.2, 1.2, 9)]), axis=-1).reshape(-1, 2)
movements = {}
for name, learnt in {"plain": policy, "stabilised": stable}.items():
    movements[name] = learnt.rollout(grid, steps=500, dt=DT, beyond=np.inf)
    ends = np.array([movements[name].episode(k).states[-1] for k in range(len(grid))])
    reached = np.linalg.norm(ends - GOAL, axis=1) < 0.01
    print(f"{name}: {np.mean(reached):.0%} of {len(grid)} movements end within 1 cm of the goal")

# %%
# Left, where the stabilised policy leads. Right, how far from the goal either is: the plain policy comes to rest
# 6 cm beside it.

figure, axes = plt.subplots(1, 2, figsize=(10, 4.6), layout="constrained")
uc.plot.rollout(movements["stabilised"], demos, ax=axes[0])
for (name, movement), color in zip(movements.items(), ["C1", "C0"], strict=True):
    far = np.linalg.norm(movement.states - GOAL, axis=1).reshape(len(grid), -1)
    lines = axes[1].semilogy(movement.time[: far.shape[1]], far.T, color=color, linewidth=0.7)
    lines[0].set_label(name)
axes[1].set(xlabel="time, s", ylabel="distance from the goal, m", ylim=(1e-5, None))
axes[1].legend()
figure.savefig("reach_the_goal.png")
plt.show()
