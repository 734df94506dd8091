"""Contact and noise are found, passes climb, and odd data give a right answer or one sentence."""

from itertools import pairwise

import numpy as np
import pytest
from sklearn.base import clone
from sklearn.preprocessing import PolynomialFeatures

import unconstrain as uc
from unconstrain import limit_cycle
from unconstrain.fitting.posterior import Posterior

NINETY = 1.6448536269514722


def cycle(free=0.5, noise=0.05, seed=0, **options):
    """Demonstrations, the deviation of their noise, and which samples were free."""
    demos = limit_cycle.demonstrate(noise=noise, free=free, random_state=seed, **options)
    clean = limit_cycle.demonstrate(free=free, random_state=seed, **options)
    sigma = noise * np.sqrt(np.mean(clean.actions.std(axis=0) ** 2))
    return demos, sigma, np.einsum("nii->n", demos.projections) > 1.5


def cubic(**options):
    """A policy that can represent the limit cycle."""
    return uc.ParametricPolicy(PolynomialFeatures(3), **({"alpha": "cv"} | options))


def error(policy, demos):
    return uc.metrics.normalized(
        uc.metrics.unconstrained_policy_error(demos.policy, policy.predict(demos.states)), demos.policy
    )


@pytest.mark.parametrize("free", [0.0, 0.5, 1.0])
def test_contact_and_noise_are_found_on_the_limit_cycle(free):
    for seed in range(2):
        demos, sigma, was_free = cycle(free, seed=seed)
        policy = cubic().fit(demos)
        assert policy.noise_ == pytest.approx(sigma, rel=0.1)
        assert policy.free_share_ == pytest.approx(was_free.mean(), abs=0.05)
        assert np.mean((policy.free_probability(demos) > 0.5) == was_free) >= 0.95
        assert error(policy, demos) < 1e-3
        assert (
            policy.score(demos.states, demos.actions, groups=demos.episodes) > 0.8
        )  # short actions are mostly noise


@pytest.mark.parametrize("alpha", [1e-6, "cv"])
@pytest.mark.parametrize("free", [0.0, 0.6])
def test_the_likelihood_never_falls_once_what_weighs_it_is_fixed(free, alpha):
    n_compared = 0
    for seed, noise in ((0, 0.05), (1, 0.2)):
        demos, _, _ = cycle(free, noise, seed, n_episodes=12)
        for features in (PolynomialFeatures(3), uc.NormalizedRBF(9)):
            history = uc.ParametricPolicy(features, alpha=alpha).fit(demos).history_
            for name in {entry["run"] for entry in history}:
                climbing = [
                    entry["log_likelihood"]
                    for entry in history
                    if entry["run"] == name and entry["comparable"] and entry["accepted"]
                ]
                n_compared += max(len(climbing) - 1, 0)
                assert all(b >= a for a, b in pairwise(climbing))
    assert n_compared > 5


def test_known_projections_are_used_and_certain():
    demos, _, was_free = cycle(0.3, n_episodes=20)
    told = np.arange(len(demos)) % 3 == 0
    projections = np.where(told[:, None, None], demos.projections, np.nan)
    arrays = demos.states, demos.actions
    some = cubic().fit(*arrays, groups=demos.episodes, projections=projections)
    none, every = (
        cubic().fit(*arrays, groups=demos.episodes, projections=given) for given in (None, demos.projections)
    )
    assert some.n_known_constraints_ == told.sum()
    free = some.free_probability(*arrays, groups=demos.episodes, projections=projections)
    np.testing.assert_array_equal(free[told], was_free[told].astype(float))
    assert np.mean((free > 0.5) == was_free) >= 0.98
    assert error(every, demos) < 1.5 * error(some, demos)
    assert error(some, demos) < 1.5 * error(none, demos)
    assert every.free_share_ == pytest.approx(was_free.mean())


def test_where_nothing_is_told_of_a_projection_nothing_changes():
    demos, _, _ = cycle(n_episodes=8)
    arrays, hidden = (demos.states, demos.actions), np.full((len(demos), 2, 2), np.nan)
    plain = cubic(alpha=1e-6).fit(*arrays, groups=demos.episodes)
    unknown = cubic(alpha=1e-6).fit(*arrays, groups=demos.episodes, projections=hidden)
    np.testing.assert_allclose(unknown.predict(demos.states), plain.predict(demos.states), atol=1e-6)


def test_the_order_of_episodes_does_not_matter_but_that_of_their_samples_does():
    demos, _, _ = cycle(n_episodes=12)
    rng = np.random.default_rng(0)
    policy = cubic(alpha=1e-6).fit(demos.states, demos.actions, groups=demos.episodes)
    P = policy.predict(demos.states)
    order = np.argsort(rng.permutation(12)[demos.episodes], kind="stable")
    other = cubic(alpha=1e-6).fit(demos.states[order], demos.actions[order], groups=demos.episodes[order])
    np.testing.assert_allclose(other.predict(demos.states), P, atol=1e-6)
    mixed = np.lexsort((rng.random(len(demos)), demos.episodes))
    mixed_up = cubic(alpha=1e-6).fit(demos.states[mixed], demos.actions[mixed], groups=demos.episodes)
    assert np.abs(mixed_up.predict(demos.states) - P).max() > 1e-5
    # Without groups the order says nothing.
    alone, shuffled = (
        cubic(alpha=1e-6).fit(demos.states[rows], demos.actions[rows]) for rows in (slice(None), mixed)
    )
    np.testing.assert_allclose(alone.predict(demos.states), shuffled.predict(demos.states), atol=1e-6)
    free = alone.free_probability(demos.states, demos.actions)
    one = alone.free_probability(demos.states[7:8], demos.actions[7:8])
    np.testing.assert_allclose(one, free[7:8])


def test_a_weight_of_zero_leaves_out_and_one_of_two_repeats():
    """To 1e-6 of the actions: EM makes the same passes, and only sums are rounded otherwise."""
    demos, _, _ = cycle(n_episodes=10)
    X, U, groups = demos.states, demos.actions, demos.episodes
    rng = np.random.default_rng(0)
    left_out = rng.random(len(X)) < 0.3
    for labels in (None, groups):
        zero = cubic(alpha=1e-6).fit(X, U, groups=labels, sample_weight=np.where(left_out, 0.0, 1.0))
        kept = ~left_out
        without = cubic(alpha=1e-6).fit(X[kept], U[kept], groups=None if labels is None else labels[kept])
        np.testing.assert_allclose(zero.predict(X), without.predict(X), atol=1e-6)
        assert zero.noise_ == pytest.approx(without.noise_, rel=1e-5)
        assert zero.free_share_ == pytest.approx(without.free_share_, rel=1e-5)
    times = rng.integers(1, 3, len(X))
    weighted = cubic(alpha=1e-6).fit(X, U, sample_weight=times.astype(float))
    repeated = cubic(alpha=1e-6).fit(np.repeat(X, times, axis=0), np.repeat(U, times, axis=0))
    np.testing.assert_allclose(weighted.predict(X), repeated.predict(X), atol=1e-6)
    assert weighted.noise_ == pytest.approx(repeated.noise_, rel=1e-5)


RNG = np.random.default_rng(0)
DEMOS, _, WAS_FREE = cycle(n_episodes=8)
X, U, G = DEMOS.states, DEMOS.actions, np.asarray(DEMOS.episodes)
ODD = {
    "one episode": (X[:40], U[:40], G[:40]),
    "an episode of one sample": (X[:81], U[:81], G[:81]),
    "all free": (X, DEMOS.policy, G),
    "all constrained": (X[~WAS_FREE], U[~WAS_FREE], G[~WAS_FREE]),
    "all at rest": (X, 0 * U, G),
    "all at rest but one": (X, U * (np.arange(len(U)) == 5)[:, None], G),
    "one action": (X, U[:, :1], G),
    "noise larger than motion": (X, U + 10 * RNG.normal(size=U.shape), G),
    "two samples": (X[:2], U[:2], None),
    "two episodes of one sample": (X[:2], U[:2], [0, 1]),
    "duplicated samples": (np.repeat(X[:3], 60, axis=0), np.repeat(U[:3], 60, axis=0), np.arange(180) // 20),
    "constant states": (np.ones_like(X), U, G),
    "constant actions": (X, np.ones_like(U), G),
    "fewer samples than parameters": (X[:7], U[:7], np.arange(7) // 3),
    "tiny actions": (X, 1e-160 * U, G),
    "small actions": (X, 1e-50 * U, G),
    "large actions": (X, 1e50 * U, G),
    "actions whose fourth power is no number": (X, 1e100 * U, G),
    "huge actions": (X, 1e160 * U, G),
    "one outlier": (X, U * np.where(np.arange(len(U)) == 5, 1e6, 1.0)[:, None], G),
    "many actions": (X, RNG.normal(size=(len(X), 40)), G),
}


REFUSED = {"all at rest", "tiny actions", "huge actions", "actions whose fourth power is no number"}
REFUSED_WITHOUT_FOLDS = {"one episode", "all at rest but one"}  # all motion lies in one fold


@pytest.mark.parametrize("alpha", [1e-3, "cv"])
@pytest.mark.parametrize("name", ODD)
@pytest.mark.parametrize("local", [False, True])
def test_odd_data_give_an_answer_or_one_sentence(name, alpha, local):
    X, U, groups = ODD[name]
    policy = uc.LocallyLinearPolicy(n_centers=2, alpha=alpha) if local else cubic(alpha=alpha)
    try:
        policy.fit(X, U, groups=groups)
    except uc.errors.UnconstrainError as refused:
        sentence = str(refused)
    else:
        sentence = None
    if sentence is not None:
        assert "\n" not in sentence
        assert name in REFUSED or (name in REFUSED_WITHOUT_FOLDS and alpha == "cv")
        return
    P, deviation = policy.predict(X, return_std=True)
    assert np.isfinite(P).all()
    assert np.isfinite(deviation).all()
    free = policy.free_probability(X, U, groups=groups)
    assert np.all((free >= 0) & (free <= 1))
    assert np.isfinite([policy.noise_, policy.free_share_, policy.log_likelihood_]).all()
    assert isinstance(policy.posterior(), Posterior)
    if name == "all free" and not local:
        np.testing.assert_allclose(P, U, atol=1e-2 if alpha == "cv" else 0.05)
        assert policy.free_share_ > 0.99
    if name in ("small actions", "large actions"):
        unit = float(name == "large actions") * 1e50 or 1e-50
        plain = (uc.LocallyLinearPolicy(n_centers=2, alpha=alpha) if local else cubic(alpha=alpha)).fit(
            X, DEMOS.actions, groups=groups
        )
        np.testing.assert_allclose(P / unit, plain.predict(X), atol=1e-4)


@pytest.mark.parametrize("resumable", [False, True])
def test_what_was_inferred_comes_back_from_a_file(tmp_path, resumable):
    policy = cubic().fit(DEMOS)
    policy.save(tmp_path / "policy.skops", resumable=resumable)
    loaded = uc.load_policy(tmp_path / "policy.skops")
    np.testing.assert_array_equal(loaded.predict(X), policy.predict(X))
    np.testing.assert_array_equal(loaded.free_probability(DEMOS), policy.free_probability(DEMOS))
    for name in ("noise_", "speed_noise_", "free_share_", "log_likelihoods_", "alpha_"):
        assert getattr(loaded, name) == getattr(policy, name)
    assert len(loaded.history_) == len(policy.history_)
    if resumable:
        for a, b in zip(loaded.predict(X, return_std=True), policy.predict(X, return_std=True), strict=True):
            np.testing.assert_array_equal(a, b)
        policy.partial_fit(X, U, groups=G)
        loaded.partial_fit(X, U, groups=G)
        np.testing.assert_allclose(loaded.predict(X), policy.predict(X), rtol=1e-12)


def test_ninety_percent_of_the_truth_lies_in_the_interval_under_noise():
    inside = []
    for seed in range(10):
        demos, _, _ = cycle(seed=100 + seed)
        P, deviation = cubic().fit(demos).predict(demos.states[::7], return_std=True)
        inside.append(np.mean(np.abs(P - demos.policy[::7]) <= NINETY * deviation))
    assert 0.85 <= np.mean(inside) <= 0.99


def test_one_recording_is_inferred_along_its_time_as_the_program_and_streams_do():
    several = limit_cycle.demonstrate(10, noise=0.05, free=0.5, random_state=0)
    one = uc.Demonstrations(several.states, several.actions)
    policy = uc.ParametricPolicy(uc.NormalizedRBF(25))
    whole = clone(policy).fit(one)
    blocks = clone(policy).fit(one.states, one.actions, groups=one.blocks(5))
    np.testing.assert_array_equal(whole.predict(one.states), blocks.predict(one.states))
    assert whole.free_share_ != clone(policy).fit(one.states, one.actions).free_share_
