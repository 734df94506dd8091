"""
An angle among the states
=========================

For people whose state has a heading, a yaw or a joint that turns round. Recorded angles jump from π to -π, and
a policy that takes them for numbers differs on both sides of the jump. Say that it is an angle, and it does
not.
"""

import matplotlib.pyplot as plt
import numpy as np

import unconstrain as uc

# %%
# A trolley is pushed to its dock, which it has to face backwards, at π: just where recorded headings jump. A wall
# or a jammed castor bends most of the recordings. They ship with the package, and are simulated.

columns = {"state": ["x", "y", "yaw"], "time": "t", "episode": "run"}
demos = uc.load(uc.datasets.path("trolley.csv"), angle="yaw", **columns)
print(demos.space, *demos.notes, sep="\n")
training, others = demos.select(demos.episodes < 13), demos.select(demos.episodes >= 13)
truth = uc.datasets.trolley_policy(others.states)

# %%
# One policy is learnt with the angle, another from the same motion with the heading between -π and π for a
# number.


def as_numbers(X):
    """Return states with the heading as it was recorded, between -π and π."""
    return np.column_stack([X[:, :2], (X[:, 2] + np.pi) % (2 * np.pi) - np.pi])


features = uc.NormalizedRBF(n_centers=40)
policy = uc.ParametricPolicy(features).fit(training)
number = uc.ParametricPolicy(features).fit(
    as_numbers(training.states), training.actions, groups=training.episodes
)


def error(predicted):
    """Return the squared error, as a share of the true policy's variance."""
    return uc.metrics.normalized(uc.metrics.unconstrained_policy_error(truth, predicted), truth)


print(f"as an angle:         nUPE {error(policy.predict(others.states)):.3f}")
print(f"as a number:         nUPE {error(number.predict(as_numbers(others.states))):.3f}")
print(f"ordinary regression: nUPE {error(policy.ordinary_regression().predict(others.states)):.3f}")

# %%
# How the trolley turns at a place beside the dock, over the heading.

yaw = np.linspace(-np.pi, np.pi, 181)
X = np.column_stack([np.full_like(yaw, 0.5), np.full_like(yaw, 0.2), yaw])
figure, ax = plt.subplots(figsize=(6.5, 4), layout="constrained")
ax.plot(np.degrees(yaw), uc.datasets.trolley_policy(X)[:, 2], "k--", label="true policy")
ax.plot(np.degrees(yaw), policy.predict(X)[:, 2], label="as an angle")
ax.plot(np.degrees(yaw), number.predict(X)[:, 2], label="as a number")
ax.plot(
    np.degrees(yaw), policy.ordinary_regression().predict(X)[:, 2], label="ordinary regression", color="0.6"
)
ax.set(xlabel="heading, degrees", ylabel="angular velocity, rad/s", xticks=range(-180, 181, 90))
ax.legend()
figure.savefig("an_angle.png")
plt.show()
