"""
Free and bent movements told apart
==================================

For people who recorded a behaviour that touches things, and have no sensor that says when. The policy is learnt
without being told, and says of every sample how surely nothing was in its way. Here the recordings happen to
have a force sensor, which the policy never sees: it is held against what was inferred.
"""

import matplotlib.pyplot as plt
import numpy as np
from sklearn.preprocessing import PolynomialFeatures

import unconstrain as uc

# %%
# Sixteen recordings of a hand that comes down in spirals and wipes boards, tilted another way each time. They
# ship with the package, and are simulated. Four are held out.

demos = uc.datasets.load_wiping()
training, others = demos.select(demos.episodes < 12), demos.select(demos.episodes >= 12)
print(training)

# %%
# A model that cannot represent the policy takes what it misses for contact. Which kind of model suits is a matter
# of held-out recordings, and needs no truth.

candidates = {
    "local models": uc.LocallyLinearPolicy(),
    "RBFs": uc.ParametricPolicy(uc.NormalizedRBF(n_centers=40)),
    "cubic": uc.ParametricPolicy(PolynomialFeatures(3)),
}
chosen = uc.select_policy(candidates, training)
print(chosen.table)
policy = chosen.policies[chosen.name]
print(f"{policy.free_share_:.0%} of the samples seem free; noise {policy.noise_:.4f} m/s")

# %%
# The force sensor of the recordings that were held out says when the hand pressed on a board.

columns = {"time": "t", "episode": "episode"}
forces = uc.load(uc.datasets.path("wiping.csv"), state=["fx", "fy", "fz"], **columns)
pressed = np.linalg.norm(forces.states[demos.episodes >= 12], axis=1)  # N
touches = pressed > 2.0
for name, candidate in chosen.policies.items():
    free = candidate.free_probability(others) > 0.5
    print(
        f"{name}: of {np.sum(~touches)} samples without contact {np.mean(free[~touches]):.0%} are taken for free, "
        f"of {np.sum(touches)} with contact {np.mean(~free[touches]):.0%} for bent"
    )


def error(policy):
    """Return the squared error on the recordings held out, as a share of the true policy's variance."""
    missed = uc.metrics.unconstrained_policy_error(others.policy, policy.predict(others.states))
    return uc.metrics.normalized(missed, others.policy)


# %%
# Free samples that are taken for bent cost little: of them only the part along the motion is learnt from. Bent
# ones that are taken for free would spoil the policy.

for name, candidate in chosen.policies.items():
    regression = candidate.ordinary_regression()
    print(f"{name}: nUPE {error(candidate):.4f}, of ordinary regression {error(regression):.3f}")

# %%
# The picture: one recording that was held out. The hand of these recordings wanders, and where it wandered for a
# while, it is taken for bent although nothing was in its way.

free = policy.free_probability(others)
shown = others.episode(0)
figure = plt.figure(figsize=(10, 4), layout="constrained")
force = figure.add_subplot(1, 2, 1)
force.plot(shown.time, pressed[others.episodes == 0], color="0.5", label="measured force")
force.set(xlabel="time, s", ylabel="force, N", title="A recording held out")
probability = force.twinx()
probability.plot(shown.time, free[others.episodes == 0], color="C0", label="inferred: free")
probability.set(ylabel="probability that it was free", ylim=(-0.03, 1.03))
figure.legend(loc="outside lower left", ncols=2)
side = uc.plot.contact(policy, shown, coordinates=(0, 2), ax=figure.add_subplot(1, 2, 2))
side.set_title("The same, from the side")
figure.savefig("free_and_bent.png")
plt.show()
