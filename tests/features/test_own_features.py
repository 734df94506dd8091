"""A feature map of the user's own, with the three methods of the protocol and no more, works everywhere."""

import numpy as np
import pytest

import unconstrain as uc
from tests.problems import rotation

rng = np.random.default_rng(0)
R = rotation(3, rng)
X = rng.uniform(-1, 1, size=(240, 3))
PI = np.sin(X @ R.T) @ R  # what the features below can represent
N = uc.constraints.projection(rng.normal(size=(240, 1, 3)))
U = np.einsum("nij,nj->ni", N, PI)
EPISODES = np.repeat(np.arange(12), 20)
HALF = np.where(np.arange(240)[:, None, None] % 2, np.nan, N)


class Waves:
    """`π(x) = Rᵀ (w_1 sin(Rx)_1, w_2 sin(Rx)_2, w_3 sin(Rx)_3)`: no estimator, no basis, no number of parameters."""

    def fit(self, X, d):
        self.d = d

    def along(self, X, directions):
        return np.sin(X @ R.T) * (directions @ R.T)

    def evaluate(self, X, w):
        return (np.sin(X @ R.T) * w) @ R


class Basis:
    """`π(x) = W b(x)` with `b(x) = (sin x, 1)`: the capability `basis`, in a class of one's own."""

    def fit(self, X, d):
        self.d = d

    def basis(self, X):
        return np.column_stack([np.sin(np.asarray(X, dtype=float) @ R.T), np.ones(len(X))])

    def along(self, X, directions):
        return (directions[:, :, None] * self.basis(X)[:, None, :]).reshape(len(X), -1)

    def evaluate(self, X, w):
        return self.basis(X) @ w.reshape(self.d, -1).T


class Slow:
    """`Basis` behind the three methods alone."""

    def __init__(self):
        self.inner = Basis()

    def fit(self, X, d):
        self.inner.fit(X, d)

    def along(self, X, directions):
        return self.inner.along(X, directions)

    def evaluate(self, X, w):
        return self.inner.evaluate(X, w)


def policies(features, **options):
    centers, width = X[::60].copy(), 1.5
    return [
        uc.ParametricPolicy(features, **options),
        uc.LocallyLinearPolicy(features, centers=centers, width=width, **options),
    ]


@pytest.mark.parametrize("alpha", ["cv", 1e-9])
@pytest.mark.parametrize("known", [None, HALF, N])
def test_three_methods_learn_the_policy_under_every_risk(alpha, known):
    for policy in policies(Waves(), alpha=alpha, risk="inconsistency"):
        policy.fit(X, U, groups=EPISODES, projections=known)
        np.testing.assert_allclose(policy.predict(X), PI, atol=1e-6)
    # Single samples that are nearly free pass for free, by which the policy is off, and that passes for noise.
    for policy in policies(Waves(), alpha=alpha):
        policy.fit(X, U, groups=EPISODES, projections=known)
        np.testing.assert_allclose(policy.predict(X), PI, atol=0.02)
    for policy in policies(Waves(), alpha=alpha, risk="direct"):
        np.testing.assert_allclose(policy.fit(X, PI, groups=EPISODES).predict(X), PI, atol=1e-6)


def test_streams_pieces_uncertainty_and_choice_know_them():
    for policy in policies(Waves(), risk="inconsistency"):
        whole = policy.fit(X, U, groups=EPISODES)
        options = policy.get_params(deep=False)
        streamed = uc.fit_stream(type(policy)(**options), [(X, U, EPISODES)], batch_rows=50)
        np.testing.assert_allclose(streamed.predict(X), whole.predict(X), rtol=1e-8, atol=1e-10)
        pieces = type(policy)(**options)
        for part in (slice(0, 110), slice(110, None)):
            pieces.partial_fit(X[part], U[part], groups=EPISODES[part])
        np.testing.assert_allclose(pieces.predict(X), whole.predict(X), rtol=1e-6, atol=1e-8)
        noisy = type(policy)(**options).fit(X, U + 0.05 * rng.normal(size=U.shape), groups=EPISODES)
        P, deviation = noisy.predict(X, return_std=True)
        assert deviation.shape == P.shape == X.shape
        assert np.mean(np.abs(P - PI) <= 4 * deviation) > 0.9
        report = uc.identifiability(noisy, X, U, groups=EPISODES)
        assert report.determined_share == 1.0
        report.next_recordings(1)
        report.contributions()
    best = uc.select_policy(
        {"waves": uc.ParametricPolicy(Waves()), "line": uc.ParametricPolicy()}, X, U, EPISODES
    )
    assert best.name == "waves"


def test_the_constraint_can_be_learnt_in_them():
    found = uc.FeatureConstraint(Waves()).fit(X, np.cross(np.sin(X @ R.T) @ R, rng.normal(size=X.shape)))
    assert found.predict(X).shape == (240, 3, 3)


def test_a_basis_is_added_up_fast_and_gives_the_same():
    noisy = U + 0.1 * rng.normal(size=U.shape)
    for fast, slow in zip(policies(Basis(), alpha=1e-3), policies(Slow(), alpha=1e-3), strict=True):
        fast.fit(X, noisy, projections=HALF)
        slow.fit(X, noisy, projections=HALF)
        np.testing.assert_allclose(fast.predict(X), slow.predict(X), rtol=1e-7, atol=1e-9)
        for a, b in zip(fast.predict(X, return_cov=True), slow.predict(X, return_cov=True), strict=True):
            np.testing.assert_allclose(a, b, rtol=1e-5, atol=1e-8)


def test_they_are_compiled_where_they_say_how_and_else_one_sentence_says_so(tmp_path):
    policy = uc.ParametricPolicy(Waves()).fit(X, U)
    with pytest.raises(uc.errors.PolicyError, match="Waves"):
        policy.compile()
    policy.save(tmp_path / "waves.skops")
    with pytest.raises(uc.errors.UnconstrainError, match="Waves"):
        uc.load_policy(tmp_path / "waves.skops")
    loaded = uc.load_policy(tmp_path / "waves.skops", trusted=[Waves])
    np.testing.assert_array_equal(loaded.predict(X), policy.predict(X))
