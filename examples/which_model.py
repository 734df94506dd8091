"""
Which model?
============

For people who do not know which kind of model suits their recordings. `select_policy` fits candidates of all kinds,
holds whole movements out, and compares what each says of them by one measure: where a sample was free the whole action
counts, elsewhere the part along the motion.
"""

import matplotlib.pyplot as plt
from sklearn.ensemble import ExtraTreesRegressor

import unconstrain as uc
from unconstrain.limit_cycle import demonstrate

# %%
# Twenty-five noisy movements around a limit cycle, half of whose stretches are free. A recording does not say which, so
# what the simulation knows is left out.

simulated = demonstrate(25, noise=0.03, free=0.5, random_state=0)
demos = uc.Demonstrations(simulated.states, simulated.actions, episodes=simulated.episodes)
others = demonstrate(20, random_state=1)

candidates = {
    "linear": uc.ParametricPolicy(),
    "RBFs": uc.ParametricPolicy(uc.NormalizedRBF(n_centers=36)),
    "local models": uc.LocallyLinearPolicy(n_centers=16),
    "extra trees": uc.RegressorPolicy(
        ExtraTreesRegressor(10, min_samples_leaf=3, random_state=0), max_fits=20
    ),
}
found = uc.select_policy(candidates, demos)
print(found.table)
print(f"chosen: {found.name}")

# %%
# Here the true policy is known, so the choice can be checked: error held out beside error in truth.


def error(policy):
    """Return the squared error on other movements, as a share of the policy's variance."""
    missed = uc.metrics.unconstrained_policy_error(others.policy, policy.predict(others.states))
    return uc.metrics.normalized(missed, others.policy)


held_out = [found.table[name].error for name in candidates]
true = [error(found.policies[name]) for name in candidates]
for name, value in zip(candidates, true, strict=True):
    print(
        f"{name}: nUPE {value:.3f}, of ordinary regression {error(found.policies[name].ordinary_regression()):.3f}"
    )

figure, ax = plt.subplots(figsize=(6, 4), layout="constrained")
ax.loglog(held_out, true, "o")
for name, x, y in zip(candidates, held_out, true, strict=True):
    ax.annotate(name, (x, y), xytext=(6, 4), textcoords="offset points")
ax.margins(0.25)
ax.set(xlabel="error of held-out movements, by which it is chosen", ylabel="error in truth (nUPE)")
figure.savefig("which_model.png")
plt.show()
