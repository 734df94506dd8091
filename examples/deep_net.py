"""
A deep net behind constrained movements
=======================================

For people whose policy no linear model fits, or who train networks anyway: `uc.TorchPolicy` learns a network from
recordings in which something was in the way, without being told what or when. It says how noisy the actions are, which
samples were free, how sure it is, and whether any of that is worth it. It needs the extra `torch`.
"""

# %%
# Forty movements of which most are bent: each is cut in three, and each third is free or has a constraint of its own.

import sys

import matplotlib
import numpy as np

import unconstrain as uc
from unconstrain.limit_cycle import demonstrate

demos = demonstrate(40, free=0.4, random_state=0)
noise = 0.05 * np.sqrt(np.mean(demos.actions**2))
actions = demos.actions + noise * np.random.default_rng(1).normal(size=demos.actions.shape)
new = demonstrate(40, random_state=1)

# %%
# Two networks, each of which does without another fifth of the movements. ``module=`` takes any network of your
# own. With ``progress=True`` a bar shows how far it is, and with ``checkpoint=path`` an interrupted fit goes on.

policy = uc.TorchPolicy(n_ensemble=2, random_state=0)
policy.fit(demos.states, actions, groups=demos.episodes)
print(f"noise {policy.noise_:.3f} (true {noise:.3f}), free {policy.free_share_:.0%}")
print(
    "log-likelihood of a held-out sample:", {name: round(v, 2) for name, v in policy.log_likelihoods_.items()}
)

# %%
# Ordinary regression by the same network was the first of its runs, so comparing costs nothing.

regression = policy.ordinary_regression()
for name, learnt in {"ordinary regression": regression, "TorchPolicy": policy}.items():
    error = uc.metrics.unconstrained_policy_error(new.policy, learnt.predict(new.states))
    print(f"{name}: nUPE {uc.metrics.normalized(error, new.policy):.3g}")

# %%
# For the robot: a few NumPy calls without PyTorch, and ONNX for everyone else.

step = policy.compile()
print(step, step(np.array([0.5, 0.0])))

# %%
# The picture: what either learnt, where each leads, and how far the networks are from each other.

if not sys.flags.interactive and "sphinx_gallery" not in sys.modules:
    matplotlib.use("agg")
import matplotlib.pyplot as plt  # noqa: E402

grid = np.stack(np.meshgrid(*2 * [np.linspace(-1.2, 1.2, 17)]), axis=-1).reshape(-1, 2)
_, spread = policy.predict(grid, return_std=True)
figure, axes = plt.subplots(1, 2, figsize=(9, 4.4), layout="constrained", sharex=True, sharey=True)
for ax, (name, learnt) in zip(
    axes, {"ordinary regression": regression, "TorchPolicy": policy}.items(), strict=True
):
    ax.quiver(*grid.T, *learnt.predict(grid).T, color="0.5")
    movement = learnt.rollout(new.states[:1], steps=300, dt=0.02, beyond=np.inf)
    ax.plot(*movement.states.T, label="where it leads")
    ax.set(title=name, aspect="equal")
shown = axes[1].tricontourf(*grid.T, np.linalg.norm(spread, axis=1), alpha=0.4)
figure.colorbar(shown, ax=axes, label="how far networks are apart")
axes[0].legend()
figure.savefig("deep_net.png", dpi=120)
