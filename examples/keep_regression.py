"""
When not to use this
====================

For people who want to know whether they need any of this. Where nothing was in the way, or always the same
thing, or where the state does not explain the motion, keep ordinary regression, or record something else.
`evaluate` ends with a verdict that says so.
"""

import textwrap

import matplotlib.pyplot as plt
import numpy as np

import unconstrain as uc
from unconstrain.limit_cycle import LimitCycle, demonstrate
from unconstrain.simulation import simulate

# %%
# Four kinds of recordings of one policy, thirty to learn from and thirty others.


def free(seed):
    """Nothing was in the way."""
    return demonstrate(30, noise=0.03, constrained=False, random_state=seed)


def varying(seed):
    """Something was in the way of most movements, another thing each time: what the library is for."""
    return demonstrate(30, noise=0.03, free=0.3, random_state=seed)


def one_table(seed):
    """The same table was in the way of all of them."""
    rng = np.random.default_rng(seed)
    N = np.tile([[1.0, 0.0], [0.0, 0.0]], (30, 1, 1))
    return simulate(LimitCycle(), rng.uniform(-1, 1, (30, 2)), 39, 0.02, project=lambda k, X, U: N)


def unexplained(seed):
    """Movements go round this way or that way, and the place does not say which."""
    ways = [
        demonstrate(15, noise=0.03, free=0.3, policy=LimitCycle(omega=way), random_state=seed + 10 * k)
        for k, way in enumerate((1.0, -1.0))
    ]
    return uc.Demonstrations.concatenate(ways)


kinds = {
    "nothing in the way": free,
    "varying constraints": varying,
    "always one table": one_table,
    "state does not explain": unexplained,
}

# %%
# Each is learnt, and evaluated on the other recordings. The truth is left out of what is given to the library.

truth, errors = LimitCycle(), {"policy": [], "ordinary regression": []}
grid = np.random.default_rng(2).uniform(-1, 1, (500, 2))
for name, record in kinds.items():
    demos, others = (
        uc.Demonstrations(made.states, made.actions, made.episodes, time=made.time)
        for made in (record(0), record(1))
    )
    policy = uc.ParametricPolicy(uc.NormalizedRBF(n_centers=25)).fit(demos)
    print(textwrap.fill(f"{name}: {uc.evaluate(policy, others).verdict}", 100), end="\n\n")
    for row, learnt in zip(errors.values(), (policy, policy.ordinary_regression()), strict=True):
        missed = uc.metrics.unconstrained_policy_error(truth(grid), learnt.predict(grid))
        row.append(uc.metrics.normalized(missed, truth(grid)))

for name, ours, direct in zip(kinds, *errors.values(), strict=True):
    print(f"{name}: nUPE {ours:.3g}, of ordinary regression {direct:.3g}")

# %%
# Only where constraints varied is anything gained. Always the same table leaves half of the policy unknown, and
# no method can help: the verdict names the direction. Where nothing was in the way, a few samples are taken for
# bent all the same, since what the model misses looks like contact; that makes the policy a little worse, and the
# verdict shows that nothing speaks for it: ordinary regression explains as much. Then take ``risk="direct"``.
# Movements that go either way have no policy of the place; the verdict says that too.

figure, ax = plt.subplots(figsize=(7.5, 4), layout="constrained")
for shift, (name, row) in zip((-0.2, 0.2), errors.items(), strict=True):
    ax.bar(np.arange(len(kinds)) + shift, row, 0.4, label=name)
ax.set_xticks(range(len(kinds)), [name.replace(" ", "\n", 1) for name in kinds])
ax.set(ylabel="error of the policy (nUPE)", yscale="log")
ax.legend()
figure.savefig("keep_regression.png")
plt.show()
