"""
A policy from four movements, and how sure it is
================================================

For whoever has recorded a handful of movements and wants to know where they say something and where they do not. A
Gaussian process learns the policy behind four constrained movements, and shades where it should not be followed.

Four movements of the paper's limit cycle are recorded, each under constraints that change twice on the way, so every
sample shows the policy along one direction only. Ordinary regression takes what was left of each action for the whole.
"""

# %%
# Record
# ------
# Movements start anywhere in the square; the true policy, which nobody shows, goes round a circle.

import matplotlib.pyplot as plt
import numpy as np
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, DotProduct

import unconstrain as uc
from unconstrain.demo import FEW, draw_data, measure_errors

training, test = draw_data(1000)
seen = training.select(training.episodes < FEW)
print(f"{len(seen.states)} samples of {FEW} movements")

# %%
# Learn
# -----
# Kernel, widths and noise are those of largest marginal likelihood. The kernel here says that the policy is smooth, and
# about linear; `kernel="auto"` would try a cubic polynomial too, which the limit cycle happens to be.

separable = uc.kernels.Separable
kernel = ConstantKernel() * separable(RBF()) + ConstantKernel() * separable(DotProduct(1.0, "fixed"))

policies = {
    "ordinary regression": uc.GaussianProcessPolicy(kernel, risk="direct"),
    "inconsistency": uc.GaussianProcessPolicy(kernel, risk="inconsistency"),
}
for name, policy in policies.items():
    policy.fit(seen.states, seen.actions, groups=seen.episodes)
    error = measure_errors(policy, test)["nUPE"]
    print(f"{name}: nUPE {error:.3f}; {policy.approximation_}")
    print(f"    {policy.kernel_}")

# %%
# Where it is known
# -----------------
# The standard deviation, as a share of the usual speed, is small where the movements were, and grows away from them.

axis = np.linspace(-1.2, 1.2, 49)
grid = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
policy = policies["inconsistency"]
_, covariance = policy.predict(grid, return_cov=True)
share = np.sqrt(np.einsum("njj->n", covariance)) / policy.usual_speed()

figure, ax = plt.subplots(figsize=(5.5, 5), layout="constrained")
levels = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5]
shades = ax.contourf(
    axis, axis, share.reshape(49, 49), levels=levels, extend="both", cmap="Greys", norm="log"
)
figure.colorbar(shades, ax=ax, label="standard deviation / usual speed", ticks=levels, format="%g")
uc.plot.policy(policy, seen, region=[[-1, -1], [1, 1]], ax=ax)
ax.set(aspect="equal", xlim=(-1.2, 1.2), ylim=(-1.2, 1.2), title="learnt from four movements")
plt.show()
