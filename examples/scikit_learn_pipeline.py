"""
A pipeline of scikit-learn
==========================

For people whose regressor needs its inputs prepared, and who choose its options by cross-validation. Whatever
scikit-learn can fit goes into a `RegressorPolicy` as it is, a whole pipeline too; and the policy goes into
scikit-learn's own tools, such as a search over its options.
"""

import matplotlib.pyplot as plt
from sklearn.base import clone
from sklearn.kernel_ridge import KernelRidge
from sklearn.model_selection import GridSearchCV, GroupKFold
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

import unconstrain as uc
from unconstrain.limit_cycle import demonstrate

# %%
# Twenty-five noisy movements around a limit cycle, half of them free. The second state is in millimetres, the first in
# metres: a kernel would see nothing but the second, so states are standardised first.

demos = demonstrate(25, noise=0.03, free=0.5, random_state=0)
others = demonstrate(20, random_state=1)
units = [1.0, 1000.0]
X, U, episodes = demos.states * units, demos.actions, demos.episodes

pipeline = make_pipeline(StandardScaler(), KernelRidge(kernel="rbf", alpha=0.01))
policy = uc.RegressorPolicy(pipeline, max_fits=30).fit(X, U, groups=episodes)
print(f"{policy.free_share_:.0%} of the samples were free; {policy.n_fits_} fits")

# %%
# The width of the kernel is chosen by cross-validation over whole movements. The score of a policy is the share of what
# held-out samples show that it explains, which needs no true policy. Options of the regressor are named as scikit-learn
# names them. Inside the search fewer fits are enough.

search = GridSearchCV(
    uc.RegressorPolicy(pipeline, max_fits=20),
    {"regressor__kernelridge__gamma": [0.01, 0.3, 10.0]},
    cv=GroupKFold(3),
)
search.fit(X, U, groups=episodes)
gammas = search.cv_results_["param_regressor__kernelridge__gamma"].data.astype(float)
scores = search.cv_results_["mean_test_score"]
for gamma, score in zip(gammas, scores, strict=True):
    print(f"gamma {gamma:g}: {score:.4f} of what held-out movements show is explained")

# %%
# Here the true policy is known, so the choice can be looked at: the share of the variance that each misses.


def error(policy):
    """Return the squared error on other movements, as a share of the policy's variance."""
    missed = uc.metrics.unconstrained_policy_error(others.policy, policy.predict(others.states * units))
    return uc.metrics.normalized(missed, others.policy)


errors = []
for gamma in gammas:
    candidate = clone(search.estimator).set_params(regressor__kernelridge__gamma=gamma)
    errors.append(error(candidate.fit(X, U, groups=episodes)))
    regression = candidate.set_params(risk="direct").fit(X, U, groups=episodes)
    print(f"gamma {gamma:g}: nUPE {errors[-1]:.3f}, of ordinary regression {error(regression):.3f}")

figure, ax = plt.subplots(figsize=(6, 4), layout="constrained")
ax.loglog(gammas, [1 - score for score in scores], "o-", label="not explained, held out")
ax.loglog(gammas, errors, "s--", label="missed of the true policy")
ax.axvline(search.best_params_["regressor__kernelridge__gamma"], color="grey", linewidth=1)
ax.set(xlabel="gamma of the kernel", ylabel="share")
ax.legend()
figure.savefig("scikit_learn_pipeline.png")
plt.show()
