"""
A door: a constraint that is learnt, and used
=============================================

For people whose robot is to do under a new constraint what a person showed under others. What a person wants
when opening doors is learnt from several doors. How another door moves is learnt from pushing it a little.
Together they say how that door will be opened.
"""

import matplotlib.pyplot as plt
import numpy as np

import unconstrain as uc
from unconstrain.simulation import simulate

# %%
# Seen from above, in m. The hand holds a handle and wants it at its own right side, more slowly the nearer it is.
# Fifteen doors have their hinges elsewhere, and let the handle go round them only. In five more recordings the
# hand holds nothing.

GOAL, DT = np.array([0.4, -0.3]), 0.02


def wanted(X):
    """Return the velocity (m/s) that the person wants."""
    away = X - GOAL
    return -away / np.sqrt(0.3**2 + np.sum(away**2, axis=1, keepdims=True)) * 0.5


def record(hinges, starts, seed):
    """Simulate a movement of 2 s for each hinge, (n, 2); NaN where there is none."""

    def project(k, X, U):
        """Let only what goes round the hinge through."""
        rows = X - np.where(np.isnan(hinges), X, hinges)
        return uc.constraints.projection(rows[:, None])

    moved = simulate(wanted, starts, steps=99, dt=DT, project=project)
    noise = 0.01 * np.random.default_rng(seed).normal(size=moved.actions.shape)
    return uc.Demonstrations(
        moved.states,
        moved.actions + noise,
        moved.episodes,
        policy=moved.policy,
        state_names=("x [m]", "y [m]"),
    )


rng = np.random.default_rng(0)
hinges = np.where(np.arange(20)[:, None] < 15, rng.uniform([-1.2, -0.5], [0.0, 1.5], (20, 2)), np.nan)
demos = record(hinges, rng.uniform([-0.5, 0.2], [0.6, 1.0], (20, 2)), seed=1)
policy = uc.LocallyLinearPolicy().fit(demos)

starts = rng.uniform([-0.5, 0.2], [0.6, 1.0], (40, 2))
others = record(np.full((40, 2), np.nan), starts, seed=2)
for name, learnt in {"contact inferred": policy, "ordinary regression": policy.ordinary_regression()}.items():
    missed = uc.metrics.unconstrained_policy_error(others.policy, learnt.predict(others.states))
    print(f"{name}: nUPE {uc.metrics.normalized(missed, others.policy):.4f}")

# %%
# Another door. Its handle is moved to and fro a little, three times, with 1 mm of noise. Which mechanism that is,
# and where its hinge is, shows in the positions.

HINGE, CLOSED = np.array([-0.7, 0.3]), np.array([0.1, 0.7])
radius = np.linalg.norm(CLOSED - HINGE)
closed = np.arctan2(*(CLOSED - HINGE)[::-1])
angles = np.tile(closed - 0.4 * np.sin(np.linspace(0, np.pi, 100)) ** 2, 3)
seen = HINGE + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1) + 0.001 * rng.normal(size=(300, 2))
velocities = np.gradient(seen, DT, axis=0)
door = uc.MechanismConstraint().fit(seen, velocities, groups=np.repeat(range(3), 100))
print(f"it is a {door.kind_} of radius {door.radius_:.3f} m (true {radius:.3f} m)")

# %%
# The policy under the learnt constraint, which the person never showed, and ordinary regression under it; beside
# them what the person would do.

movements = {
    "the person would": simulate(
        wanted,
        CLOSED,
        200,
        DT,
        project=lambda k, X, U: uc.constraints.projection((X - HINGE)[:, None]),
    ),
    "policy": policy.rollout(CLOSED, 200, DT, constraint=door.rows, beyond=np.inf),
    "ordinary regression": policy.ordinary_regression().rollout(
        CLOSED, 200, DT, constraint=door.rows, beyond=np.inf
    ),
}
for name, movement in movements.items():
    opened = np.degrees(closed - np.arctan2(*(movement.states - HINGE)[[50, -1], ::-1].T))
    print(f"{name}: opened by {opened[0]:.1f}° after 1 s, {opened[1]:.1f}° after 4 s")

figure, axes = plt.subplots(1, 2, figsize=(10, 4.5), layout="constrained")
uc.plot.policy(policy, demos, ax=axes[0])
axes[0].set_title("learnt from fifteen doors and five free movements")
for (name, movement), style in zip(movements.items(), ["k--", "C0", "C1"], strict=True):
    opened = closed - np.arctan2(*(movement.states - HINGE)[:, ::-1].T)
    axes[1].plot(movement.time, np.degrees(opened), style, label=name)
axes[1].set(xlabel="time, s", ylabel="angle of the other door, degrees", title="another door")
axes[1].legend()
figure.savefig("door.png")
plt.show()
