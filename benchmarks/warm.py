"""A fit after one more episode that goes on from the policy at hand, beside a fit anew."""

from collections.abc import Callable

import numpy as np

import unconstrain as uc
from benchmarks.ratio import Ratio, medians
from unconstrain.fitting.gains import NOTICEABLE
from unconstrain.limit_cycle import demonstrate

MOVEMENTS = 100


def warm_fit_linear() -> Ratio:
    """The linear policy."""
    return _ratio("warm-fit-linear", "linear", uc.ParametricPolicy)


def warm_fit_rbf() -> Ratio:
    """36 RBFs."""
    return _ratio("warm-fit-rbf", "36 RBFs", lambda: uc.ParametricPolicy(uc.NormalizedRBF(n_centers=36)))


def warm_fit_local() -> Ratio:
    """50 local models."""
    return _ratio("warm-fit-local", "50 local models", lambda: uc.LocallyLinearPolicy(n_centers=50))


def _ratio(name: str, kind: str, make: Callable) -> Ratio:
    demos = demonstrate(MOVEMENTS, noise=0.05, free=0.5, random_state=0)
    X, U, groups = demos.states, demos.actions, demos.episodes  # nothing is known of the constraints
    old = groups != groups[-1]
    before = make().fit(X[old], U[old], groups=groups[old])
    anew, warm = make().fit(X, U, groups=groups), make().fit(X, U, groups=groups, start=before)
    assert not np.array_equal(anew.predict(X), warm.predict(X)), "it was fitted anew"
    assert warm.log_likelihood_ > anew.log_likelihood_ - NOTICEABLE
    ours, theirs = medians(
        lambda: make().fit(X, U, groups=groups, start=before),
        lambda: make().fit(X, U, groups=groups),
        repeats=7,
    )
    work = f"{kind}, limit cycle, movement {MOVEMENTS}, from the policy of {MOVEMENTS - 1}"
    return Ratio(name, work, "the fit anew", ours / theirs, 0.3, ours, theirs)


BENCHMARKS: dict[str, Callable[[], Ratio]] = {
    "warm-fit-linear": warm_fit_linear,
    "warm-fit-rbf": warm_fit_rbf,
    "warm-fit-local": warm_fit_local,
}
