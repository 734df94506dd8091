"""
Any regressor
=============

For people who trust a regressor already, such as trees, boosting or nearest neighbours, and have demonstrations in
which something was in the way at times. Fitted to such recordings as they are, it learns a policy that nobody
showed. `RegressorPolicy` fits the same regressor to actions that it completes, and finds out by itself which samples
were free.
"""

import matplotlib.pyplot as plt
import numpy as np
from sklearn.ensemble import ExtraTreesRegressor, HistGradientBoostingRegressor
from sklearn.neighbors import KNeighborsRegressor

import unconstrain as uc
from unconstrain.limit_cycle import LimitCycle, demonstrate

# %%
# Forty movements around a limit cycle, with 3 % noise. Forty percent of their stretches are free; in each of the
# others one direction is taken away, another one each time. A recording does not say where, so what the simulation
# knows is left out.

simulated = demonstrate(40, noise=0.03, free=0.4, random_state=0)
demos = uc.Demonstrations(simulated.states, simulated.actions, episodes=simulated.episodes)
others = demonstrate(40, random_state=1)

# %%
# Each regressor is fitted twice: to the actions as recorded (`risk="direct"`), and wrapped.

regressors = {
    "extra trees": ExtraTreesRegressor(20, min_samples_leaf=3, random_state=0),
    "boosting": HistGradientBoostingRegressor(max_iter=20, learning_rate=0.3, random_state=0),
    "neighbours": KNeighborsRegressor(10, weights="distance"),
}
policies = {}
for name, regressor in regressors.items():
    for risk in ("direct", "adaptive"):
        policies[name, risk] = uc.RegressorPolicy(regressor, risk=risk, max_fits=30).fit(demos)


def error(policy):
    """Return the squared error on other movements, as a share of the policy's variance."""
    missed = uc.metrics.unconstrained_policy_error(others.policy, policy.predict(others.states))
    return uc.metrics.normalized(missed, others.policy)


for name in regressors:
    wrapped = policies[name, "adaptive"]
    print(
        f"{name}: direct {error(policies[name, 'direct']):.3f}, wrapped {error(wrapped):.3f} "
        f"after {wrapped.n_fits_} fits, {wrapped.free_share_:.0%} found free"
    )

# %%
# Drawn: the true policy, and what each has learnt.

figure, axes = plt.subplots(2, 4, figsize=(13, 6.5), layout="constrained")
square, full_speed = [[-1, -1], [1, 1]], np.linalg.norm(LimitCycle()(np.array([[0.8, 0.8]])))
for row, risk in zip(axes, ("direct", "adaptive"), strict=True):
    uc.plot.policy(LimitCycle(), region=square, full_speed=full_speed, label=None, ax=row[0])
    row[0].set_title("true policy")
    for ax, name in zip(row[1:], regressors, strict=True):
        uc.plot.policy(policies[name, risk], region=square, full_speed=full_speed, label=None, ax=ax)
        ax.set_title(f"{name}, {'as recorded' if risk == 'direct' else 'wrapped'}")
for ax in axes.flat:
    ax.set_aspect("equal", adjustable="box")
    ax.set(xlim=(-1.2, 1.2), ylim=(-1.2, 1.2), xlabel="", ylabel="")
figure.savefig("any_regressor.png")
plt.show()
