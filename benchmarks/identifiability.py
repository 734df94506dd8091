"""What it costs to know how far a fit is determined, and how sure it is."""

import unconstrain as uc
from benchmarks.fits import _data
from benchmarks.ratio import Ratio, medians


def report() -> Ratio:
    """Share and bound of 50 local models on 10,000 samples in 7 dimensions, from the recordings."""
    X, U = _data(10_000, 7)
    policy = uc.LocallyLinearPolicy(centers=X[:50].copy(), width=3**0.5, alpha=1e-6, risk="inconsistency")

    def told():
        found = uc.identifiability(policy, X, U)
        return found.determined_share, found.bound

    fit, ours = medians(lambda: policy.fit(X, U), told)
    return Ratio("report", "share and bound, N=10,000, n=d=7, M=50", "local-fit", ours / fit, 5.0, ours, fit)


def report_of_moments() -> Ratio:
    """The same of 100 RBFs, from the moments of 200,000 samples that the fit leaves behind."""
    X, U = _data(200_000, 7)
    policy = uc.ParametricPolicy(
        uc.NormalizedRBF(centers=X[:100].copy(), width=2.0), alpha=1e-6, risk="inconsistency"
    )
    fit, ours = medians(
        lambda: policy.fit(X, U), lambda: uc.identifiability(policy).determined_share, repeats=3
    )
    return Ratio(
        "report-of-moments",
        "share, 700 parameters, from moments",
        "parametric-fit",
        ours / fit,
        1.0,
        ours,
        fit,
    )


def deviations() -> Ratio:
    """Standard deviations of 50 local models at all states they were fitted to."""
    X, U = _data(10_000, 7)
    policy = uc.LocallyLinearPolicy(centers=X[:50].copy(), width=3**0.5, alpha=1e-6, risk="inconsistency")
    fit, ours = medians(lambda: policy.fit(X, U), lambda: policy.predict(X, return_std=True))
    return Ratio("deviations", "predict(return_std=True), N=10,000", "local-fit", ours / fit, 5.0, ours, fit)
