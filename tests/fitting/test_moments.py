import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.preprocessing import PolynomialFeatures

from tests.problems import problems
from unconstrain.features import FullFeatures
from unconstrain.fitting.kernels import local, parametric, reference
from unconstrain.fitting.moments import Moments
from unconstrain.fitting.observation import RISKS, observe
from unconstrain.receptive import activations

CASES = st.sampled_from([*RISKS, "known"])
"""A risk, or the inconsistency with all projections known."""


class Rows:
    """The same full features, without the capability `basis`, so that moments are summed row by row."""

    def __init__(self, full):
        self.full = full

    def fit(self, X, d):
        self.full.fit(X, d)

    def along(self, X, directions):
        return self.full.along(X, directions)

    def evaluate(self, X, w):
        return self.full.evaluate(X, w)


def observation_of(case, U, N):
    return observe("direct" if case == "direct" else "inconsistency", U, N if case == "known" else None)


def assert_same_moments(moments, expected):
    for field in ("H", "g", "squares", "weight"):
        a, b = getattr(moments, field), getattr(expected, field)
        np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-12 * np.abs(b).max())


@settings(deadline=None)
@given(problems(), st.sampled_from(["inconsistency", "known"]))
def test_moments_are_the_sums_they_are_defined_as(problem, case):
    X, _, N, U, rng = problem
    features = FullFeatures(PolynomialFeatures(2)).fit(X, U.shape[1])
    observation, weights = observation_of(case, U, N), rng.random(len(X))
    expected = reference.moments(features, X, observation, weights)
    for way in (parametric.of_products, parametric.of_rows):
        assert_same_moments(way(features, X, observation, weights), expected)
    assert_same_moments(parametric.moments(features, X, observation, weights), expected)
    assert_same_moments(parametric.moments(Rows(features), X, observation, weights), expected)


@settings(deadline=None)
@given(problems(), CASES, st.sampled_from([None, PolynomialFeatures(2)]), st.booleans())
def test_local_moments_are_parametric_moments_weighted(problem, case, transformer, with_basis):
    X, _, N, U, rng = problem
    full = FullFeatures(transformer).fit(X, U.shape[1])
    features = full if with_basis else Rows(full)
    centers, width = X[rng.integers(len(X), size=3)], float(np.std(X))
    observation, weights = observation_of(case, U, N), rng.random(len(X))
    together = local.moments(features, centers, width, X, observation, weights)
    for m, center in enumerate(centers):
        receptive = np.exp(-np.sum((X - center) ** 2, axis=1) / (2 * width**2))
        alone = parametric.moments(features, X, observation, weights * receptive)
        np.testing.assert_allclose(together.H[m], alone.H, rtol=1e-9, atol=1e-12 * abs(alone.H).max())
        np.testing.assert_allclose(together.g[m], alone.g, rtol=1e-9, atol=1e-12 * abs(alone.g).max())
        np.testing.assert_allclose(together.squares[m], alone.squares, rtol=1e-9)
        np.testing.assert_allclose(together.weight[m], alone.weight, rtol=1e-9)


def test_models_far_from_a_block_are_left_out_of_it_and_nothing_changes(monkeypatch):
    rng, N = np.random.default_rng(0), 20_000  # several blocks
    X = np.linspace(0, 400, N)[:, None] + rng.normal(size=(N, 2))  # one long movement
    U, centers = rng.normal(size=(N, 2)), X[::1000].copy()
    observation, linear = observe("inconsistency", U), FullFeatures().fit(X, 2)
    together = local.moments(linear, centers, 1.0, X, observation)
    for m, center in enumerate(centers):
        receptive = np.exp(-np.sum((X - center) ** 2, axis=1) / 2)
        H = reference.moments(linear, X, observation, receptive).H
        np.testing.assert_allclose(together.H[m], H, rtol=1e-12, atol=1e-14 * abs(H).max())
    near = activations(X[: N // 4], centers, 1.0).max(axis=0) > local.NEGLIGIBLE
    assert 0 < np.count_nonzero(near) < len(centers)
    monkeypatch.setattr(local, "NEGLIGIBLE", 2.0)  # which leaves out every model
    assert not local.moments(linear, centers, 1.0, X, observation).H.any()


@settings(deadline=None)
@given(problems(min_samples=4), CASES, st.floats(0.1, 0.9))
def test_moments_of_two_parts_add_to_those_of_the_whole(problem, case, share):
    X, _, N, U, rng = problem
    features = FullFeatures().fit(X, U.shape[1])
    observation, weights = observation_of(case, U, N), rng.random(len(X))
    cut = max(1, int(share * len(X)))
    parts = [
        parametric.moments(features, X[s], observation[s], weights[s]) for s in (slice(cut), slice(cut, None))
    ]
    total, whole = Moments.sum(parts), parametric.moments(features, X, observation, weights)
    assert_same_moments(total, whole)
    assert total.n_samples == whole.n_samples


@settings(deadline=None)
@given(problems(), CASES)
def test_risk_from_moments_is_the_risk_on_the_samples(problem, case):
    X, _, N, U, rng = problem
    features = FullFeatures(PolynomialFeatures(2)).fit(X, U.shape[1])
    observation, weights = observation_of(case, U, N), rng.random(len(X))
    moments = parametric.moments(features, X, observation, weights)
    w = rng.normal(size=(moments.H.shape[0], 3, moments.g.shape[1]))
    for candidate in range(3):
        P = features.evaluate(X, w[:, candidate].T.reshape(-1))
        errors = np.sum((observation.targets - np.einsum("nkd,nd->nk", observation.rows, P)) ** 2, axis=1)
        np.testing.assert_allclose(moments.risk(w)[candidate], weights @ errors, rtol=1e-6)


@given(st.integers(0, 2**32 - 1), st.integers(1, 8), st.integers(1, 8))
def test_solution_is_that_of_least_norm(seed, rank, P):
    rng = np.random.default_rng(seed)
    V = rng.normal(size=(min(rank, P), P))
    r = rng.normal(size=len(V))
    moments = Moments(V.T @ V, (V.T @ r)[:, None], r @ r, np.asarray(float(len(V))))
    w = moments.decompose().solve([0.0])[:, 0, 0]
    np.testing.assert_allclose(w, np.linalg.lstsq(V, r)[0], atol=1e-5 * (1 + np.abs(w).max()))


def test_the_whole_path_of_alphas_solves_the_regularised_equations():
    rng = np.random.default_rng(0)
    V, r = rng.normal(size=(2, 30, 5)), rng.normal(size=(2, 30))
    moments = Moments(
        np.einsum("mnp,mnq->mpq", V, V),
        np.einsum("mnp,mn->mp", V, r)[:, :, None],
        np.sum(r**2, axis=1),
        np.full(2, 30.0),
    )
    alphas = [0.0, 0.1, 10.0]
    w = moments.decompose().solve(alphas)
    for m in range(2):
        for i, alpha in enumerate(alphas):
            expected = np.linalg.solve(moments.H[m] + alpha * np.eye(5), moments.g[m])
            np.testing.assert_allclose(w[m, :, i], expected, rtol=1e-9)


@pytest.mark.parametrize("scale", [0.0, 1e-300])
def test_no_data_at_all_gives_a_policy_that_stays_put(scale):
    moments = Moments(np.eye(3) * scale, np.zeros((3, 1)), np.asarray(0.0), np.asarray(0.0))
    assert np.all(moments.decompose().solve([0.0, 1.0]) == 0)


@given(st.integers(0, 2**32 - 1), st.sampled_from([1e-12, 1e-6, 1.0]))
def test_one_alpha_alone_gives_what_the_path_gives(seed, alpha):
    rng = np.random.default_rng(seed)
    V, r = rng.normal(size=(3, 30, 5)), rng.normal(size=(3, 30))
    V[0, :, 0] = 0.0  # one of the problems says nothing about one parameter
    moments = Moments(
        np.einsum("mnp,mnq->mpq", V, V),
        np.einsum("mnp,mn->mp", V, r)[:, :, None],
        np.sum(r**2, axis=1),
        np.full(3, 30.0),
    )
    path = moments.decompose().solve([alpha])[..., 0, :]
    np.testing.assert_allclose(moments.solve(alpha), path, rtol=1e-6, atol=1e-9)
