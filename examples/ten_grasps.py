"""
A policy from ten grasps
========================

For people who have time for ten movements and not for a hundred, and need to know how far to trust what is
learnt from them. A Gaussian process learns from few movements, and says how sure it is of each action.
"""

import matplotlib.pyplot as plt
import numpy as np
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, DotProduct

import unconstrain as uc
from unconstrain.simulation import simulate

# %%
# Simulated grasps of a cup at the origin: the hand comes from in front, and sinks onto it late. Every grasp is
# obstructed by a board of its own along which the hand slides for half of the way. Velocities have 3 % noise.


def wanted(X):
    """Return the velocity (m/s) that the person wants at positions X (m)."""
    far = np.hypot(X[:, 0], X[:, 1])
    above = 0.15 * (1 - np.exp(-((far / 0.15) ** 2)))
    return np.stack([-1.2 * X[:, 0], -1.2 * X[:, 1], -2.0 * (X[:, 2] - above)], axis=1)


def record(n, seed, noise=0.03):
    """Simulate n grasps of 1.6 s."""
    rng = np.random.default_rng(seed)
    start = np.column_stack([rng.uniform(0.2, 0.5, n), rng.uniform(-0.3, 0.3, n), rng.uniform(0.0, 0.4, n)])
    boards = uc.constraints.projection(rng.normal(size=(n, 1, 3)))
    begin = rng.integers(0, 20, n)

    def project(k, X, U):
        """Let the board of each grasp take motion away while the hand slides along it."""
        slides = (begin <= k) & (k < begin + 20)
        return np.where(slides[:, None, None], boards, np.eye(3))

    grasps = simulate(wanted, start, steps=39, dt=0.04, project=project)
    actions = grasps.actions + noise * grasps.actions.std(axis=0) * rng.normal(size=grasps.actions.shape)
    return uc.Demonstrations(grasps.states, actions, episodes=grasps.episodes, policy=grasps.policy)


ten, others = record(10, seed=0), record(40, seed=1)

# %%
# The kernel says that the policy is smooth, and about linear; its widths and the noise are those of largest
# marginal likelihood. Local models, the default, and ordinary regression by the same process stand beside it.


def error(policy):
    """Return the squared error on forty other grasps, as a share of the policy's variance."""
    missed = uc.metrics.unconstrained_policy_error(others.policy, policy.predict(others.states))
    return uc.metrics.normalized(missed, others.policy)


separable = uc.kernels.Separable
kernel = ConstantKernel() * separable(RBF()) + ConstantKernel() * separable(DotProduct(1.0, "fixed"))
process = uc.GaussianProcessPolicy(kernel).fit(ten)
local = uc.LocallyLinearPolicy().fit(ten)
print(f"{len(ten)} samples; {process.free_share_:.0%} seem free")
print(f"Gaussian process:                   nUPE {error(process):.4f}")
print(f"ordinary regression by a process:   nUPE {error(process.ordinary_regression()):.4f}")
print(f"local models:                       nUPE {error(local):.4f}")
print(f"ordinary regression by such models: nUPE {error(local.ordinary_regression()):.4f}")

# %%
# How sure it is: of forty other grasps, the true action lies within two standard deviations as often as printed.
# It should be 95 %; from ten movements the process is a little too sure.

predicted, deviation = process.predict(others.states, return_std=True)
missed = np.abs(predicted - others.policy)
print(f"within two standard deviations: {np.mean(missed < 2 * deviation):.0%}")

# %%
# A grasp that was not recorded: what the process expects along the way, and how sure it is.

way = others.episode(0)
predicted, deviation = process.predict(way.states, return_std=True)
regression = process.ordinary_regression().predict(way.states)
figure, axes = plt.subplots(1, 3, figsize=(11, 3.6), layout="constrained", sharex=True)
time = 0.04 * np.arange(len(way))
for ax, axis, k in zip(axes, "xyz", range(3), strict=True):
    ax.fill_between(
        time, *(predicted[:, k] + s * deviation[:, k] for s in (-2, 2)), alpha=0.3, label="± 2 std. dev."
    )
    ax.plot(time, predicted[:, k], label="process")
    ax.plot(time, regression[:, k], color="C1", label="ordinary regression")
    ax.plot(time, way.policy[:, k], "k--", label="true policy")
    ax.set(xlabel="time, s", ylabel=f"velocity along {axis}, m/s")
axes[0].legend()
figure.savefig("ten_grasps.png")
plt.show()
