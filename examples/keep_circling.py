"""
Going round and round
=====================

For people who recorded stirring, wiping or polishing, and want a robot to go on. A learnt policy leaves the
circle bit by bit, since errors of each turn add up. `stabilized("cycle")` keeps amplitude and pace, and changes
little else.
"""

import matplotlib.pyplot as plt
import numpy as np

import unconstrain as uc
from unconstrain.simulation import simulate

# %%
# Eight simulated recordings of two turns each, with 3 % noise. Now and then a ruler lies in the way for a while.

RADIUS, TURN, DT = 0.7, 1.5, 0.02
rng = np.random.default_rng(0)


def wanted(X):
    """Return the velocity that the person wants: round the circle at 1.5 rad/s, and hardly back to it."""
    pull = 0.05 * (1 - np.sum(X**2, axis=1, keepdims=True) / RADIUS**2)
    return pull * X + TURN * np.stack([X[:, 1], -X[:, 0]], axis=1)


def record(n):
    """Simulate n recordings of 8 s."""
    rulers = uc.constraints.projection(rng.normal(size=(n, 1, 2)))
    angles, radii = rng.uniform(0, 2 * np.pi, n), RADIUS * rng.uniform(0.9, 1.1, n)
    starts = radii[:, None] * np.stack([np.sin(angles), np.cos(angles)], axis=1)
    begin = rng.integers(0, 3700, n)

    def project(k, X, U):
        """Let the ruler of each recording take motion away for 0.6 s."""
        return np.where(((begin <= k) & (k < begin + 300))[:, None, None], rulers, np.eye(2))

    moved = simulate(wanted, starts, 3990, DT / 10, project=project)
    moved = moved.select(np.round(10 * moved.time / DT) % 10 == 0)
    noise = 0.03 * moved.actions.std(axis=0) * rng.normal(size=moved.actions.shape)
    return uc.Demonstrations(
        moved.states, moved.actions + noise, moved.episodes, time=moved.time, policy=moved.policy
    )


demos, others = record(8), record(8)
policy = uc.ParametricPolicy(uc.NormalizedRBF(n_centers=25)).fit(demos)
policies = {
    "ordinary regression": policy.ordinary_regression(),
    "policy": policy,
    "policy on a cycle": policy.stabilized("cycle", demos),
}

# %%
# Each is followed for thirty turns, with an action every 0.02 s. A ruler in the way leads outwards, so the
# recordings lie a little outside of the circle that the person wants; what is kept is their amplitude.

turn = round(2 * np.pi / TURN / DT)
recorded = np.sqrt(np.mean(np.sum(demos.states**2, axis=1)))
print(f"amplitude that was recorded: {recorded:.3f} m")
figure, ax = plt.subplots(figsize=(6.5, 4), layout="constrained")
for name, learnt in policies.items():
    missed = uc.metrics.unconstrained_policy_error(others.policy, learnt.predict(others.states))
    movement = learnt.rollout([0.1, 0.8], steps=30 * turn, dt=DT, beyond=np.inf)
    turns = movement.states[1:].reshape(30, turn, 2)
    amplitudes = np.sqrt(np.mean(np.sum(turns**2, axis=2), axis=1))
    pace = np.abs(np.diff(np.unwrap(np.arctan2(*turns[-1].T))).mean()) / DT
    print(
        f"{name}: nUPE {uc.metrics.normalized(missed, others.policy):.4f}; last of thirty turns: "
        f"amplitude {amplitudes[-1]:.3f} m, pace {pace:.3f} rad/s"
    )
    ax.plot(range(1, 31), amplitudes, ".-", label=name)
ax.axhline(recorded, color="k", linestyle="--", label="recorded")
ax.set(xlabel="turn", ylabel="amplitude, m", ylim=(0.6, 1.2))
ax.legend()
figure.savefig("keep_circling.png")
plt.show()
