"""What a belief finds in samples: the expansion adds up like any observation, and its judge has no bias by noise."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.preprocessing import PolynomialFeatures

from tests.fitting.test_moments import Rows, assert_same_moments
from unconstrain.constraints import projection
from unconstrain.features import FullFeatures
from unconstrain.fitting.chain import Chain
from unconstrain.fitting.contact import Belief, infer
from unconstrain.fitting.drift import Drift
from unconstrain.fitting.global_model import GlobalModel
from unconstrain.fitting.kernels import local, parametric, reference
from unconstrain.fitting.kernels.products import pairs
from unconstrain.fitting.noise import Noise
from unconstrain.receptive import activations
from unconstrain.samples import Samples

seeds = st.integers(0, 2**32 - 1)


def model_of(d, n=2):
    features = FullFeatures(PolynomialFeatures(1)).fit(np.zeros((1, n)), d)
    return GlobalModel(features, n, d)


def problem(seed, d, N=40, known=0.3, noise=None, **options):
    """A belief, and samples of which some projections are known."""
    rng = np.random.default_rng(seed)
    model = model_of(d)
    X = rng.normal(size=(N, 2))
    w = rng.normal(size=3 * d)
    Pi = model.evaluate(X, w)
    rank = rng.integers(0, d + 1, N)
    P = projection(rng.normal(size=(N, d, d)) * (np.arange(d)[None, :, None] < rank[:, None, None]))
    U = np.einsum("nij,nj->ni", P, Pi) + 0.05 * rng.normal(size=(N, d))
    told = rng.random(N) < known
    projections = np.where(told[:, None, None], P, np.nan)
    groups = np.arange(N) // 10
    belief = Belief(w + 0.1 * rng.normal(size=w.shape), noise or Noise(0.01), Chain(), **options)
    return model, belief, Samples(X, U, groups, projections, rng.random(N)), told, P


expansions = settings(max_examples=25)


@expansions
@given(seeds, st.integers(1, 5), st.sampled_from([0.0, 0.5, 1.0]), st.booleans())
def test_products_rows_and_pulls_of_an_expansion_agree(seed, d, known, is_judge):
    model, belief, samples, told, _ = problem(seed, d, known=known, noise=Noise(0.01, 0.01))
    found = infer(model, belief, samples)
    seen = found.judge(2.0) if is_judge else found.expand()
    A = np.einsum("nk,nki,nkj->nij", seen.row_weights, seen.rows, seen.rows)
    i, j = pairs(d)
    weights = samples.weights
    np.testing.assert_allclose(seen.products(), A[:, i, j].T, rtol=1e-9, atol=1e-9 * np.abs(A).max())
    np.testing.assert_allclose(seen.products(weights), seen.products() * weights)
    out = np.empty((len(i), len(seen)))
    assert seen.products(weights, out) is out
    np.testing.assert_allclose(out, seen.products(weights))
    assert seen.rows.shape == (len(seen), seen.n_rows, d)
    for index in (slice(3, 17), slice(None, None, 3), np.arange(40) % 3 == 1, np.array([7, 3, 3, 39])):
        part = seen[index]
        assert len(part) == len(told[index]) == len(part.pulls)
        assert len(part.projections) == told[index].sum()
        np.testing.assert_allclose(part.products(), seen.products()[:, index])
        np.testing.assert_array_equal(part.rows, seen.rows[index])
        np.testing.assert_array_equal(part.pulls, seen.pulls[index])
        np.testing.assert_array_equal(part.squares, seen.squares[index])
    if not is_judge:
        E = found.views.P
        error = seen.squares - 2 * np.sum(seen.pulls * E, 1) + np.einsum("ni,nij,nj->n", E, A, E)
        assert np.linalg.eigvalsh(A).min() > -1e-9 * np.abs(A).max()
        # The gradient of the quadratic at the predictions is that of the expected log-likelihood.
        gradient = seen.pulls - np.einsum("nij,nj->ni", A, E)
        views, free = found.views, found.taken_whole[:, None]
        expected = free * views.whole.gradient + (1 - free) * views.constrained.gradient
        np.testing.assert_allclose(
            gradient, belief.noise.action * expected, atol=1e-9 * (1 + np.abs(seen.pulls).max())
        )
        assert np.isfinite(error).all()


@expansions
@given(seeds, st.integers(1, 4), st.sampled_from([0.0, 0.5, 1.0]))
def test_moments_of_an_expansion_are_what_they_are_defined_as(seed, d, known):
    model, belief, samples, _, _ = problem(seed, d, known=known)
    seen, X, weights = infer(model, belief, samples).expand(), samples.states, samples.weights
    features = FullFeatures(PolynomialFeatures(2)).fit(X, d)
    expected = reference.moments(features, X, seen, weights)
    for way in (parametric.of_products, parametric.of_rows, parametric.moments):
        assert_same_moments(way(features, X, seen, weights), expected)
    assert_same_moments(parametric.moments(Rows(features), X, seen, weights), expected)
    centers, width = X[:3], 0.7
    for each in (features, Rows(features)):
        models = local.moments(each, centers, width, X, seen, weights)
        for m, reach in enumerate(activations(X, centers, width).T):
            one = reference.moments(features, X, seen, weights * reach)
            for field in ("H", "g", "squares", "weight"):
                a, b = getattr(models, field)[m], getattr(one, field)
                np.testing.assert_allclose(a, b, rtol=1e-8, atol=1e-9 * np.abs(b).max())


@pytest.mark.parametrize("d", [2, 5])
def test_the_judge_does_not_see_the_noise(d):
    """`E[risk(p') - risk(p'')]` is what it is without noise, where all samples are constrained."""
    rng = np.random.default_rng(d)
    N, s = 400_000, 0.3
    Pi = np.tile(rng.normal(size=d), (N, 1))
    clean = np.einsum("nij,nj->ni", projection(rng.normal(size=(N, 1, d))), Pi)
    model = model_of(d, 1)
    w = np.zeros(2 * d)
    belief = Belief(w, Noise(s**2), held="constrained")
    others = [Pi + 0.3 * rng.normal(size=d), 0.5 * Pi]

    def risks(U, variance=None):
        seen = infer(model, belief, Samples(np.zeros((N, 1)), U)).judge(1.0, variance)
        return [
            seen.squares
            - 2 * np.sum(seen.pulls * P, 1)
            + seen.blunt * np.sum(P**2, 1)
            + seen.towards * np.sum(seen.normal * P, 1) ** 2
            for P in others
        ]

    a, b = risks(clean + s * rng.normal(size=(N, d)))
    true_a, true_b = risks(clean, 0.0)
    difference = (a - b) - (true_a - true_b)
    assert abs(difference.mean()) < 5 * difference.std() / np.sqrt(N)
    np.testing.assert_allclose(true_a, np.sum(clean * (clean - others[0]), 1) ** 2, atol=1e-9)


@given(seeds, st.integers(2, 4), st.floats(-10, 1))
def test_what_is_told_is_certain(seed, d, exponent):
    model, belief, samples, told, P = problem(seed, d, noise=Noise(10.0 ** (2 * exponent)), drift=Drift())
    is_free = np.einsum("nii->n", P) > d - 0.5
    for held in (None, "free", "constrained"):
        held_belief = Belief(belief.w, belief.noise, belief.chain, belief.drift, held=held)
        found = infer(model, held_belief, samples)
        np.testing.assert_array_equal(found.free[told], is_free[told].astype(float))
        if held:
            np.testing.assert_array_equal(found.free[~told], float(held == "free"))
        assert np.isfinite(found.tally.log_likelihood)


@given(seeds, st.integers(1, 3))
def test_tallies_of_episodes_add_up_and_weights_count_samples_as_often(seed, d):
    model, belief, samples, _, _ = problem(seed, d, drift=Drift())
    whole = infer(model, belief, samples).tally
    halves = [infer(model, belief, samples.select(rows)).tally for rows in (np.arange(20), np.arange(20, 40))]
    double = infer(model, belief, samples._replace(weights=2 * samples.weights)).tally
    for other, factor in ((halves[0] + halves[1], 1), (double, 2)):
        assert other.log_likelihood == pytest.approx(factor * whole.log_likelihood)
        np.testing.assert_allclose(other.counts.states, factor * whole.counts.states)
        np.testing.assert_allclose(other.counts.changes, factor * whole.counts.changes, atol=1e-12)
        np.testing.assert_allclose(other.squares.vector, factor * whole.squares.vector)
        assert other.drifts.vector == pytest.approx(factor * whole.drifts.vector)
        assert (other.echo, other.energy) == pytest.approx((factor * whole.echo, factor * whole.energy))
        assert other.n_samples == pytest.approx(factor * whole.n_samples)
        assert other.evidence == pytest.approx(whole.evidence)
