"""
Wiping with a force sensor
==========================

For people whose robot or tool has a force sensor, and who wonder whether it is worth using. Contact forces say
along which direction a surface took motion away, and so the constraint of these samples is known. How much that
is worth is measured here, over the number of recordings.
"""

import matplotlib.pyplot as plt
import numpy as np
from sklearn.preprocessing import PolynomialFeatures

import unconstrain as uc

# %%
# The same recordings twice: once without the sensor, once with it. A contact begins where the force exceeds 2 N,
# eight times the sensor's noise.

blind = uc.datasets.load_wiping()
sensed = uc.datasets.load_wiping(force_threshold=2.0)
known = ~np.isnan(sensed.projections[:, 0, 0])
bent = np.trace(sensed.projections[known], axis1=1, axis2=2) < 2.5
print(
    f"the sensor tells of {known.mean():.1%} of the samples, and finds {bent.mean():.0%} of these in contact"
)

# %%
# Cubic polynomials are learnt from 2 to 12 of the recordings, and held against the true policy on the last four.

others = blind.select(blind.episodes >= 12)


def error(policy):
    """Return the squared error on the recordings held out, as a share of the true policy's variance."""
    missed = uc.metrics.unconstrained_policy_error(others.policy, policy.predict(others.states))
    return uc.metrics.normalized(missed, others.policy)


numbers = [2, 3, 4, 6, 8, 12]
errors = {"ordinary regression": [], "contact inferred": [], "contact measured": []}
for number in numbers:
    inferred = uc.ParametricPolicy(PolynomialFeatures(3)).fit(blind.select(blind.episodes < number))
    measured = uc.ParametricPolicy(PolynomialFeatures(3)).fit(sensed.select(sensed.episodes < number))
    errors["ordinary regression"].append(error(inferred.ordinary_regression()))
    errors["contact inferred"].append(error(inferred))
    errors["contact measured"].append(error(measured))
print(f"{'recordings learnt from':22}", *(f"{number:6}" for number in numbers))
for name, row in errors.items():
    print(f"{name:22}", *(f"{value:.4f}" for value in row))

# %%
# From two recordings alone no contact can be told, and what is learnt is ordinary regression: there the sensor is
# worth most. From six on nothing is gained by it: that a board took motion away shows in the motion itself.

figure, ax = plt.subplots(figsize=(6, 4), layout="constrained")
for (name, row), style in zip(errors.items(), ["s--", "o-", "^-"], strict=True):
    ax.semilogy(numbers, row, style, label=name)
ax.set(xlabel="recordings learnt from", ylabel="error of the policy (nUPE)", xticks=numbers)
ax.legend()
figure.savefig("force_sensor.png")
plt.show()
