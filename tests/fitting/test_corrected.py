"""The corrected risk: its moments, the noise it finds, and that it is the same policy however samples are added up."""

import warnings
from itertools import pairwise

import numpy as np
import pytest
from sklearn.base import clone

import unconstrain as uc
from tests.problems import rotation
from unconstrain.constraints import projection
from unconstrain.demo import make_policy
from unconstrain.fitting.corrected import CorrectedMoments, add_up
from unconstrain.fitting.correction import Correction
from unconstrain.fitting.observation import observe
from unconstrain.fitting.pencil import Pencil
from unconstrain.limit_cycle import demonstrate
from unconstrain.samples import Samples

POLICIES = {
    "linear": uc.ParametricPolicy(),
    "RBF": uc.ParametricPolicy(uc.NormalizedRBF(9)),
    "decoupled": uc.ParametricPolicy(uc.DecoupledFeatures(4)),
    "potential": uc.ParametricPolicy(uc.PotentialFeatures(uc.NormalizedRBF(9))),
    "local": uc.LocallyLinearPolicy(n_centers=5),
    "local, zero": uc.LocallyLinearPolicy(n_centers=5, prior="zero"),
}
every = pytest.mark.parametrize("name", POLICIES)


def record(N=4000, d=3, noise=0.1, seed=0, k=1):
    """Samples of a linear policy, each under k random rows, with noise as a share of the rms action."""
    rng = np.random.default_rng(seed)
    X = rng.normal(size=(N, d))
    Pi = -X @ np.diag(np.arange(1.0, d + 1)) @ rotation(d, np.random.default_rng(5)) + 0.5
    P = projection(rng.normal(size=(N, k, d)))
    clean = np.einsum("nij,nj->ni", P, Pi)
    sigma = noise * np.sqrt(np.mean(clean**2))
    return X, clean + sigma * rng.normal(size=(N, d)), np.arange(N) // 20, Pi, P, sigma


def learn(name, X, U, groups, alpha="cv", **known):
    policy = clone(POLICIES[name]).set_params(risk="corrected", alpha=alpha)
    return policy.fit(X, U, groups=groups, **known)


def assert_same(a, b, rtol=1e-9):
    np.testing.assert_allclose(a, b, rtol=0, atol=rtol * np.abs(b).max())


@every
def test_without_noise_the_moments_are_those_of_the_inconsistency_weighted_by_squared_lengths(name):
    X, U, groups, _, _, _ = record(200, 2, noise=0.0)
    model = learn(name, X, U, groups).model_
    moments = CorrectedMoments.of(model, Samples(X, U))
    y = np.sum(U**2, axis=1)
    other = model.moments(X, observe("inconsistency", U), y / y.mean())
    found = Pencil.of(moments, float(y.mean())).at(0.0)
    for a, b in ((found.H, other.H), (found.g, other.g), (found.squares, other.squares)):
        assert_same(a, b)


@pytest.mark.parametrize("name", ["linear", "local"])
def test_without_noise_the_policy_is_that_of_the_inconsistency(name):
    X, U, groups, Pi, _, _ = record(400, noise=0.0)
    policy = learn(name, X, U, groups, alpha=1e-10)
    other = clone(POLICIES[name]).set_params(risk="inconsistency", alpha=1e-10).fit(X, U, groups=groups)
    assert policy.noise_ < 1e-6
    assert_same(policy.predict(X), other.predict(X), 1e-5)
    assert_same(policy.predict(X), Pi, 1e-5)


@pytest.mark.parametrize("k", [0, 1, 2])
def test_at_the_true_policy_risk_and_gradient_are_zero_on_average(k):
    """Whatever the rank of the projections; without any constraint, k = 0, too."""
    risks, gradients = [], []
    for seed in range(40):
        X, U, _, Pi, _, sigma = record(2000, seed=seed, k=k, noise=0.3)
        if k == 0:
            U = Pi + sigma * np.random.default_rng(seed + 1000).normal(size=Pi.shape)
        model = learn("linear", X, U, None).model_
        moments = CorrectedMoments.of(model, Samples(X, U)).at(sigma**2, 1.0)
        w = model.solution(fit_truth(model, X, Pi), 1)
        risks.append(float(moments.squares) + float(np.sum(w * (moments.H @ w - 2 * moments.g))))
        gradients.append((moments.g - moments.H @ w)[:, 0])
    assert abs(np.mean(risks)) < 3.5 * np.std(risks) / np.sqrt(len(risks))
    deviation = np.std(gradients, axis=0) / np.sqrt(len(risks))
    assert np.all(np.abs(np.mean(gradients, axis=0)) < 4 * deviation)


def fit_truth(model, X, Pi):
    B = model.features.basis(X)
    return np.linalg.lstsq(B, Pi)[0].T.reshape(-1)


@pytest.mark.parametrize("noise", [0.05, 0.2])
@pytest.mark.parametrize("name", ["linear", "local"])
def test_the_noise_is_found_and_the_policy_with_it(name, noise):
    X, U, groups, Pi, _, sigma = record(noise=noise)
    policy = learn(name, X, U, groups)
    assert policy.noise_ == pytest.approx(sigma, rel=0.04)
    _, deviation = policy.predict(X, return_std=True)
    assert 0.4 < np.sqrt(np.mean(((policy.predict(X) - Pi) / deviation) ** 2)) < 2.5


def test_more_samples_help_as_they_do_not_the_inconsistency():
    test = demonstrate(40, random_state=1)
    errors = {}
    for risk in ("corrected", "inconsistency"):
        for movements in (20, 400):
            demos = demonstrate(movements, noise=0.1, random_state=0)
            policy = make_policy(risk).fit(demos.states, demos.actions, groups=demos.episodes)
            errors[risk, movements] = np.mean((policy.predict(test.states) - test.policy) ** 2)
    assert errors["corrected", 400] < errors["corrected", 20] / 10
    assert errors["corrected", 400] < errors["inconsistency", 400] / 50


@every
def test_known_projections_are_learnt_from_without_a_correction(name):
    X, U, groups, _, P, sigma = record(600, 2)
    seen = np.einsum("nij,nj->ni", P, U)
    policy = learn(name, X, seen, groups, alpha=1e-3, projections=P)
    other = clone(POLICIES[name]).set_params(risk="inconsistency", alpha=1e-3)
    other.fit(X, seen, groups=groups, projections=P)
    assert_same(policy.predict(X), other.predict(X), 1e-6)
    if name == "linear":
        assert policy.noise_ == pytest.approx(sigma, rel=0.05)
    known = np.where((np.arange(len(X)) % 2)[:, None, None], np.nan, P)
    seen = np.where((np.arange(len(X)) % 2)[:, None], U, seen)
    some = learn(name, X, seen, groups, projections=known)
    assert some.n_known_constraints_ == 300
    if name == "linear":
        assert some.noise_ == pytest.approx(sigma, rel=0.05)


def test_what_no_sample_shows_stays_small():
    """All samples on one table: noise alone is recorded along its normal."""
    rng = np.random.default_rng(0)
    X = rng.normal(size=(3000, 3))
    U = np.column_stack([-X[:, :2], np.zeros(len(X))]) + 0.1 * rng.normal(size=X.shape)
    for name in ("linear", "local"):
        policy = learn(name, X, U, np.arange(len(X)) // 20)
        assert policy.noise_ == pytest.approx(0.1, rel=0.04)
        assert np.abs(policy.predict(X)[:, 2]).max() < 0.6
        assert np.abs(policy.predict(X)[:, :2] + X[:, :2]).mean() < 0.06


@every
@pytest.mark.parametrize("alpha", [1e-3, "cv"])
def test_in_pieces_it_is_the_same_policy(name, alpha, tmp_path):
    X, U, groups, _, _, _ = record(600, 2)
    whole = learn(name, X, U, groups, alpha)
    pieces = [slice(a, b) for a, b in pairwise([0, 100, 340, 600])]
    batches = [(X[piece], U[piece], groups[piece]) for piece in pieces]
    stream = clone(POLICIES[name]).set_params(risk="corrected", alpha=alpha)
    uc.fit_stream(stream, iter(batches), checkpoint=tmp_path / "run")
    assert_same(stream.predict(X), whole.predict(X))
    assert stream.noise_ == pytest.approx(whole.noise_, rel=1e-9)
    again = clone(stream)
    uc.fit_stream(again, batches, checkpoint=tmp_path / "run")
    np.testing.assert_array_equal(again.predict(X), stream.predict(X))
    if name == "linear":
        policy = clone(POLICIES[name]).set_params(risk="corrected", alpha=alpha)
        for piece in pieces:
            policy.partial_fit(X[piece], U[piece], groups=groups[piece])
        assert_same(policy.predict(X), whole.predict(X))
        assert policy.n_samples_seen_ == len(X)


@every
def test_a_policy_is_saved_with_its_noise_and_its_sums(name, tmp_path):
    X, U, groups, _, _, _ = record(600, 2)
    policy = learn(name, X, U, groups)
    policy.save(tmp_path / "small")
    assert uc.load_policy(tmp_path / "small").noise_ == policy.noise_
    policy.save(tmp_path / "large", resumable=True)
    again = uc.load_policy(tmp_path / "large")
    for a, b in zip(
        again.predict(X[:9], return_std=True), policy.predict(X[:9], return_std=True), strict=True
    ):
        np.testing.assert_array_equal(a, b)
    np.testing.assert_array_equal(again.solved().predict(X), policy.predict(X))
    again.partial_fit(X, U, groups=groups)
    assert again.noise_ == pytest.approx(policy.noise_, rel=1e-3)
    assert 0.5 < policy.score(X, U) <= 1.0
    assert uc.identifiability(policy, X, U).determined_share > 0
    total = add_up([part for part in policy.moments_ if part is not None])
    uc.moments.save(total, tmp_path / "moments")
    np.testing.assert_array_equal(uc.moments.load(tmp_path / "moments").H, total.H)


@every
def test_the_unit_of_the_weights_does_not_matter(name):
    X, U, groups, _, _, _ = record(400, 2)
    before = learn(name, X, U, groups)
    heavy = learn(name, X, U, groups, sample_weight=np.full(len(X), 7.0))
    assert_same(heavy.predict(X), before.predict(X), 1e-6)
    assert heavy.noise_ == pytest.approx(before.noise_, rel=1e-6)


def test_candidates_of_the_risk_are_judged_by_it():
    demos = demonstrate(20, noise=0.1, random_state=0)
    found = uc.select_policy(
        {
            "fine": uc.ParametricPolicy(uc.NormalizedRBF(36), risk="corrected"),
            "coarse": uc.ParametricPolicy(risk="corrected"),
        },
        demos.states,
        demos.actions,
        demos.episodes,
    )
    assert found.name == "fine"
    assert found.table.measure == "held-out inconsistency, corrected for noise"


def test_what_is_not_plausible_is_said():
    rng = np.random.default_rng(0)
    X = rng.normal(size=(400, 2))
    with pytest.warns(UserWarning, match="of the mean squared action is taken for noise"):
        uc.ParametricPolicy(risk="corrected").fit(X, rng.normal(size=X.shape))
    with pytest.warns(UserWarning, match="no amount of noise explains"):
        uc.ParametricPolicy(risk="corrected").fit(X, rng.standard_t(1.5, size=X.shape))
    for noise in (0.0, 0.1):
        free = demonstrate(10, noise=noise, constrained=False, random_state=0)
        with pytest.warns(UserWarning, match="nothing was in the way, or what the model misses"):
            make_policy("corrected").fit(free.states, free.actions, groups=free.episodes)
    with pytest.raises(uc.errors.DataError, match="corrected risk needs are no numbers any more"):
        uc.ParametricPolicy(risk="corrected").fit(X, 1e100 * X)
    correction = Correction(0.0, 1.0, is_root=True)
    assert correction.doubt(2, 2.8) == ""
    assert correction.doubt(2, 2.9).startswith("the policy learnt by the corrected risk is 2.9 times larger")
    with pytest.raises(AttributeError, match='risk="adaptive" or risk="corrected"'):
        _ = uc.ParametricPolicy(risk="direct").fit(X, X).noise_


@pytest.mark.parametrize("noise", [0.0, 0.1])
def test_no_doubt_is_said_where_there_is_none(noise):
    X, U, groups, _, _, _ = record(noise=noise)
    some = demonstrate(20, noise=noise, free=0.5, random_state=0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        learn("linear", X, U, groups)
        learn("local", X, U, groups)
        make_policy("corrected").fit(some.states, some.actions, groups=some.episodes)


@pytest.mark.parametrize("spoil", ["total", "d", "numbers"])
def test_damaged_sums_are_refused(spoil, tmp_path):
    X, U, groups, _, _, _ = record(100, 2)
    policy = learn("linear", X, U, groups, alpha=1e-3)
    (part,) = policy.accumulator_.total.moments
    name, value = {
        "total": ("total_weight", "many"),
        "d": ("n_actions", 3),
        "numbers": ("n_numbers", np.zeros(2)),
    }[spoil]
    object.__setattr__(part, name, value)
    policy.save(tmp_path / "policy", resumable=True)
    with pytest.raises(uc.errors.ArchiveError, match="damaged"):
        uc.load_policy(tmp_path / "policy")
