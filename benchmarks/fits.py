"""How fast moments are added up and solved."""

import numpy as np

import unconstrain as uc
from benchmarks import yardsticks
from benchmarks.ratio import Ratio, medians


def _data(n_samples: int, n: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """States, and actions of a nonlinear policy behind random projections of rank one less than n."""
    rng = np.random.default_rng(seed)
    X = rng.uniform(-1.5, 1.5, size=(n_samples, n))
    Pi = -np.sign(X) * np.abs(X) ** 0.5
    a = rng.standard_normal((n_samples, n))
    a /= np.linalg.norm(a, axis=1, keepdims=True)
    return X, Pi - a * np.sum(a * Pi, axis=1, keepdims=True)


def draw_half_free(n_samples: int, n: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """States, noisy actions and episodes of movements, half of which nothing is in the way of."""
    rng = np.random.default_rng(seed)
    episodes = n_samples // 100
    X = (
        rng.standard_normal((episodes, 1, n))
        + np.cumsum(0.05 * rng.standard_normal((episodes, 100, n)), axis=1)
    ).reshape(-1, n)
    Pi = np.sin(X) - 2.0 * X
    a = np.repeat(rng.standard_normal((episodes, n)), 100, axis=0)
    a /= np.linalg.norm(a, axis=1, keepdims=True)
    bent = np.repeat(rng.random(episodes) < 0.5, 100)[:, None]
    U = Pi - bent * a * np.sum(a * Pi, axis=1, keepdims=True)
    noise = 0.05 * np.sqrt(np.mean(U**2)) * rng.standard_normal(U.shape)
    return X, U + noise, np.repeat(np.arange(episodes), 100)


def local_fit() -> Ratio:
    """M = 50 local models on 10,000 samples in 7 dimensions."""
    X, U = _data(10_000, 7)
    policy = uc.LocallyLinearPolicy(centers=X[:50].copy(), width=3**0.5, alpha=1e-6, risk="inconsistency")
    reference = yardsticks.dgemm(50, 10_000, 36 * 28)
    ours, blas = medians(lambda: policy.fit(X, U), reference, repeats=15)
    return Ratio(
        "local-fit", "N=10,000, n=d=7, M=50, fit", "dgemm 50x10,000x1,008", ours / blas, 2.5, ours, blas
    )


def parametric_fit() -> Ratio:
    """100 RBFs on 200,000 samples in 7 dimensions, their evaluation included."""
    X, U = _data(200_000, 7)
    policy = uc.ParametricPolicy(
        uc.NormalizedRBF(centers=X[:100].copy(), width=2.0), alpha=1e-6, risk="inconsistency"
    )
    reference = yardsticks.dsyrk_in_blocks(700, 200_000)
    ours, blas = medians(lambda: policy.fit(X, U), reference, repeats=3)
    return Ratio(
        "parametric-fit", "N=200,000, d=7, 100 RBFs, fit", "dsyrk 700x200,000", ours / blas, 1.3, ours, blas
    )


def wide_fit() -> Ratio:
    """The linear policy on 200,000 samples in 27 dimensions."""
    X, U = _data(200_000, 27)
    policy = uc.ParametricPolicy(alpha=1e-6, risk="inconsistency")
    reference = yardsticks.dsyrk_in_blocks(756, 200_000)
    ours, blas = medians(lambda: policy.fit(X, U), reference, repeats=3)
    return Ratio(
        "wide-fit", "N=200,000, linear, n=d=27, fit", "dsyrk 756x200,000", ours / blas, 0.8, ours, blas
    )


def lambda_path() -> Ratio:
    """Cross-validation over 25 λ and 5 folds, of the parametric fit."""
    X, U = _data(200_000, 7)
    groups = np.arange(len(X)) // 100
    features = uc.NormalizedRBF(centers=X[:100].copy(), width=2.0)
    chosen, given = (
        uc.ParametricPolicy(features, alpha="cv", risk="inconsistency"),
        uc.ParametricPolicy(features, alpha=1e-3, risk="inconsistency"),
    )
    ours, one = medians(lambda: chosen.fit(X, U, groups=groups), lambda: given.fit(X, U), repeats=3)
    return Ratio(
        "lambda-path", "parametric-fit with 25 λ x 5 folds", "the same with one λ", ours / one, 2.0, ours, one
    )


def lambda_path_local() -> Ratio:
    """The same for local models, whose one fit is so cheap that the decompositions show."""
    X, U = _data(10_000, 7)
    groups = np.arange(len(X)) // 100
    place = {"centers": X[:50].copy(), "width": 3**0.5}
    chosen, given = (
        uc.LocallyLinearPolicy(**place, alpha="cv", risk="inconsistency"),
        uc.LocallyLinearPolicy(**place, alpha=1e-3, risk="inconsistency"),
    )
    ours, one = medians(lambda: chosen.fit(X, U, groups=groups), lambda: given.fit(X, U), repeats=7)
    return Ratio(
        "lambda-path-local",
        "local-fit with 25 λ x 5 folds",
        "the same with one λ",
        ours / one,
        2.0,
        ours,
        one,
    )


def adaptive_fit() -> Ratio:
    """Inference of contact with all its starts, beside one fit by inconsistency, both with λ chosen."""
    X, U, groups = draw_half_free(10_000, 7)
    ours, one = medians(
        lambda: uc.LocallyLinearPolicy(n_centers=50).fit(X, U, groups=groups),
        lambda: uc.LocallyLinearPolicy(n_centers=50, risk="inconsistency").fit(X, U, groups=groups),
        repeats=5,
    )
    return Ratio(
        "adaptive-fit",
        "N=10,000, n=d=7, M=50, half free, 5 % noise",
        "by inconsistency",
        ours / one,
        40.0,
        ours,
        one,
    )


def loop() -> Ratio:
    """Local-fit against the published algorithm, run on a twentieth of the data and scaled."""
    X, U = _data(10_000, 7)
    centers, width = X[:50].copy(), 3**0.5
    part = len(X) // 20
    policy = uc.LocallyLinearPolicy(centers=centers, width=width, alpha=1e-6, risk="inconsistency")
    w = yardsticks.published_local_fit(X[:part], U[:part], centers[:2], width, policy.alpha)
    policy.fit(X[:part], U[:part])
    ours_w = np.concatenate([policy.coef_, policy.intercept_[:, :, None]], axis=2)[:2].reshape(2, -1)
    np.testing.assert_allclose(ours_w, w, rtol=1e-4, atol=1e-6)
    ours, published = medians(
        lambda: policy.fit(X, U),
        lambda: yardsticks.published_local_fit(X[:part], U[:part], centers, width, policy.alpha),
        repeats=3,
    )
    return Ratio(
        "loop",
        "local-fit",
        "loop over samples, 1/20 x 20",
        20 * published / ours,
        200.0,
        ours,
        20 * published,
        True,
    )


def growth() -> Ratio:
    """Parametric-fit on ten times the data."""
    X, U = _data(200_000, 7)
    policy = uc.ParametricPolicy(
        uc.NormalizedRBF(centers=X[:100].copy(), width=2.0), alpha=1e-6, risk="inconsistency"
    )
    part = len(X) // 10
    whole, tenth = medians(lambda: policy.fit(X, U), lambda: policy.fit(X[:part], U[:part]), repeats=3)
    return Ratio(
        "growth", "parametric-fit at N = 200,000", "at N = 20,000", whole / tenth, 10.5, whole, tenth
    )
