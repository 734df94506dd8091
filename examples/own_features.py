"""
A feature map of your own
=========================

For people who know something of the policy, such as that it goes round, or that height is a matter of its own.
What is known goes into a class with three methods; then few numbers are left to learn, and few recordings do.
"""

import matplotlib.pyplot as plt
import numpy as np
from sklearn.preprocessing import PolynomialFeatures

import unconstrain as uc

# %%
# Of the hand that wipes boards (recordings that ship with the package, simulated) suppose it is known: it turns
# about the z axis, its radius has a limit, and its height is nobody else's business. These are five motions, and
# the policy is a sum of them.


class Wiping:
    """π(x) = w₀ (x, y, 0) + w₁ r² (x, y, 0) + w₂ (y, -x, 0) + w₃ (0, 0, z) + w₄ (0, 0, 1)."""

    def fit(self, X, d):
        """Nothing depends on data."""
        return self

    def fields(self, X):
        """Return the five motions at each state, (N, 3, 5)."""
        (x, y, z), o = X.T, np.zeros(len(X))
        r2 = x**2 + y**2
        motions = [(x, y, o), (r2 * x, r2 * y, o), (y, -x, o), (o, o, z), (o, o, o + 1)]
        return np.stack([np.stack(motion, axis=1) for motion in motions], axis=2)

    def along(self, X, directions):
        """Return the five motions along a direction at each state, (N, 5)."""
        return np.einsum("nd,ndp->np", directions, self.fields(X))

    def evaluate(self, X, w):
        """Return the action of each state, (N, 3)."""
        return self.fields(X) @ w


demos = uc.datasets.load_wiping()
others = demos.select(demos.episodes >= 12)


def error(policy):
    """Return the squared error on the recordings held out, as a share of the true policy's variance."""
    missed = uc.metrics.unconstrained_policy_error(others.policy, policy.predict(others.states))
    return uc.metrics.normalized(missed, others.policy)


# %%
# Learnt from 1 to 12 recordings, beside cubic polynomials, which know nothing and have 60 parameters.

numbers = [1, 2, 3, 4, 6, 8, 12]
errors = {"own features": [], "cubic": [], "own features, ordinary regression": []}
for number in numbers:
    training = demos.select(demos.episodes < number)
    own = uc.ParametricPolicy(Wiping()).fit(training)
    errors["own features"].append(error(own))
    errors["own features, ordinary regression"].append(error(own.ordinary_regression()))
    errors["cubic"].append(error(uc.ParametricPolicy(PolynomialFeatures(3)).fit(training)))
for name, row in errors.items():
    print(f"{name:34}", *(f"{value:.5f}" for value in row))

# %%
# Its parameters mean something. The true ones are 1.5, -104, 2.5, -0.8 and -0.096, in s and m.

print("parameters:", own.solution_.w.round(3))

figure, ax = plt.subplots(figsize=(6, 4), layout="constrained")
for (name, row), style in zip(errors.items(), ["o-", "^-", "s--"], strict=True):
    ax.semilogy(numbers, row, style, label=name)
ax.set(xlabel="recordings learnt from", ylabel="error of the policy (nUPE)", xticks=numbers)
ax.legend()
figure.savefig("own_features.png")
plt.show()
