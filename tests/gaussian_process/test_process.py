from dataclasses import replace

import numpy as np
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF

from unconstrain.features.scaling import Scaling
from unconstrain.fitting.global_model import GlobalModel
from unconstrain.fitting.observation import observe
from unconstrain.gaussian_process.held_out import hold_out_exactly
from unconstrain.gaussian_process.inducing import make_features
from unconstrain.gaussian_process.kernels import CurlFree, Separable
from unconstrain.gaussian_process.pairs import every_direction
from unconstrain.gaussian_process.process import condition
from unconstrain.gaussian_process.rows import Rows

RNG = np.random.default_rng(1)
X = RNG.normal(size=(12, 2))
U = RNG.normal(size=(12, 2))
TEST = RNG.normal(size=(5, 2))
SCALING = Scaling(np.zeros(2), np.ones(2))
NOISE, SIZE = 0.1, 1.5
KERNELS = (Separable(RBF(0.7)), CurlFree(0.9))


def test_the_exact_process_is_scikit_learns_with_a_noise_for_each_row():
    weights = RNG.uniform(0.5, 2.0, size=12)
    directions = U / np.linalg.norm(U, axis=1, keepdims=True)
    for kernel in KERNELS:
        rows = Rows.of(X, observe("inconsistency", U), weights)
        process = condition(kernel, rows, SCALING, SIZE, NOISE)
        other = GaussianProcessRegressor(kernel, alpha=NOISE / weights, optimizer=None)
        other.fit(np.hstack([X, directions]), np.linalg.norm(U, axis=1) / SIZE)
        mean, covariance = other.predict(every_direction(TEST, 2), return_cov=True)
        np.testing.assert_allclose(process.evaluate(TEST), SIZE * mean.reshape(5, 2), atol=1e-9)
        own = np.stack([covariance[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] for i in range(5)])
        np.testing.assert_allclose(process.covariance(TEST), SIZE**2 * own, atol=1e-9)


def test_inducing_rows_at_every_state_are_the_exact_process():
    for kernel in KERNELS:
        for risk in ("inconsistency", "direct"):
            observation = observe(risk, U)
            exact = condition(kernel, Rows.of(X, observation), SCALING, SIZE, NOISE)
            features = make_features(kernel, SCALING, X, 2, 100)
            moments = GlobalModel(features, 2, 2).moments(X, observation)
            process = features.process(moments, SIZE, NOISE)
            np.testing.assert_allclose(process.evaluate(TEST), exact.evaluate(TEST), atol=1e-6)
            np.testing.assert_allclose(process.covariance(TEST), exact.covariance(TEST), atol=1e-6)
            assert np.isclose(process.used, exact.used, atol=1e-6)
            assert np.allclose(features.missed(X), 0.0, atol=1e-6)


def test_what_is_left_without_a_fold_is_the_process_of_the_others():
    fold, kernel = np.repeat([0, 1, 2], 4), KERNELS[0]
    rows = Rows.of(X, observe("direct", U))
    process = condition(kernel, rows, SCALING, SIZE, NOISE)
    held = hold_out_exactly(process, rows, fold, np.arange(12) % 4 > 0)
    for k in range(3):
        others = condition(kernel, rows.of_samples(np.flatnonzero(fold != k)), SCALING, SIZE, NOISE)
        np.testing.assert_allclose(held.processes[k].evaluate(TEST), others.evaluate(TEST), atol=1e-8)
    wider = held.widen(process)
    grown = wider.covariance(TEST) - replace(wider, apart=None).covariance(TEST)
    assert np.linalg.eigvalsh(grown).min() > -1e-12
