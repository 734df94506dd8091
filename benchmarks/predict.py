"""How fast a policy acts in a million states, and tells where nothing was in the way, beside bare products."""

from collections.abc import Callable

import numpy as np

import unconstrain as uc
from benchmarks.fits import draw_half_free
from benchmarks.ratio import Ratio, medians
from benchmarks.step import KINDS, draw_samples

STATES, BLOCK, LENGTH = 1_000_000, 4096, 100


def predict_linear() -> Ratio:
    """The linear policy in 7 dimensions."""
    return _parametric("predict-linear", "linear")


def predict_rbf() -> Ratio:
    """36 RBFs in the plane, of which the basis is there already in what it is measured against."""
    return _parametric("predict-rbf", "rbf")


def predict_local() -> Ratio:
    """50 local models in 7 dimensions, beside all of them in each state, not blended."""
    work, policy, n = KINDS["local"]()
    policy.fit(*draw_samples(n))
    X = _states(n)
    V, W = np.column_stack([X[:BLOCK], np.ones(BLOCK)]), np.random.default_rng(0).normal(size=(n + 1, 50 * n))
    each = np.empty((BLOCK, 50 * n))

    def product():
        for _ in range(0, STATES, BLOCK):
            np.matmul(V, W, out=each)

    ours, theirs = medians(lambda: policy.predict(X), product, repeats=5)
    against = f"V @ W, 10^6 x {n + 1} x {50 * n}, in blocks"
    return Ratio("predict-local", f"{work}, 10^6 states", against, ours / theirs, 2.0, ours, theirs)


def free_probability_local() -> Ratio:
    """Contact of a million samples, by 50 local models in 7 dimensions."""
    X, U, groups = draw_half_free(10_000, 7)
    policy = uc.LocallyLinearPolicy(n_centers=50).fit(X, U, groups=groups)
    assert 0.1 < policy.free_share_ < 0.9
    X, U, groups = np.tile(X, (100, 1)), np.tile(U, (100, 1)), np.arange(STATES) // LENGTH
    ours, theirs = medians(
        lambda: policy.free_probability(X, U, groups=groups), lambda: policy.predict(X), repeats=3
    )
    work = "50 local models, n=d=7, free_probability of 10^6 samples"
    return Ratio("free-probability-local", work, "predict", ours / theirs, 3.0, ours, theirs)


def _parametric(name: str, kind: str) -> Ratio:
    work, policy, n = KINDS[kind]()
    policy.fit(*draw_samples(n))
    X = _states(n)
    V = np.random.default_rng(0).normal(size=(STATES, len(policy.weights_) // n))
    W = policy.weights_.reshape(n, -1).T.copy()
    ours, theirs = medians(lambda: policy.predict(X), lambda: V @ W, repeats=5)
    against = f"V @ W, 10^6 x {V.shape[1]} x {n}"
    return Ratio(name, f"{work}, 10^6 states", against, ours / theirs, 2.0, ours, theirs)


def _states(n: int) -> np.ndarray:
    return np.random.default_rng(1).uniform(-1.5, 1.5, size=(STATES, n))


BENCHMARKS: dict[str, Callable[[], Ratio]] = {
    "predict-linear": predict_linear,
    "predict-rbf": predict_rbf,
    "predict-local": predict_local,
    "free-probability-local": free_probability_local,
}
