"""Forward-backward is what the definition says, whatever the likelihoods."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from unconstrain.fitting.chain import Chain, Counts, smooth

seeds = st.integers(0, 2**32 - 1)
probabilities = st.floats(1e-3, 1 - 1e-3)
chains = st.builds(Chain, probabilities, probabilities, probabilities)


def by_definition(log_free, log_constrained, starts, chain, log_kept):
    """Sum over all paths of each episode: probabilities, log-likelihood of the whole, counts, kept."""
    N = len(starts)
    free, kept, changes, total = np.zeros(N), np.zeros(N), np.zeros((2, 2)), 0.0
    first, T = (chain.free_share, 1 - chain.free_share), chain.transitions
    for rows in np.split(np.arange(N), np.flatnonzero(starts)[1:]):
        paths = np.array(list(product((0, 1), repeat=len(rows))))
        logs = np.zeros(len(paths))
        for path, states in enumerate(paths):
            for i, (row, state) in enumerate(zip(rows, states, strict=True)):
                logs[path] += (log_free, log_constrained)[state][row]
                logs[path] += np.log(T[states[i - 1], state] if i else first[state])
                if i and state == states[i - 1] == 1:
                    logs[path] += log_kept[row]
        top = logs.max()
        p = np.exp(logs - top)
        total += top + np.log(p.sum())
        p /= p.sum()
        free[rows] = p @ (paths == 0)
        for i in range(1, len(rows)):
            for a, b in product((0, 1), repeat=2):
                changes[a, b] += p @ ((paths[:, i - 1] == a) & (paths[:, i] == b))
            kept[rows[i]] = p @ ((paths[:, i - 1] == 1) & (paths[:, i] == 1))
    return free, total, changes, kept


@given(seeds, st.integers(1, 9), chains, st.sampled_from([0.1, 3.0, 100.0]), st.booleans())
def test_it_is_the_sum_over_all_paths(seed, N, chain, size, has_kept):
    rng = np.random.default_rng(seed)
    log_free, log_constrained = size * rng.normal(size=(2, N))
    starts = rng.random(N) < 0.3
    starts[0] = True
    log_kept = rng.normal(size=N) * min(size, 10) if has_kept else np.zeros(N)
    free, log, counts, kept = smooth(log_free, log_constrained, starts, chain, log_kept if has_kept else None)
    expected = by_definition(log_free, log_constrained, starts, chain, log_kept)
    np.testing.assert_allclose(free, expected[0], atol=1e-10)
    assert log.sum() == pytest.approx(expected[1], abs=1e-9 * (1 + size * N))
    np.testing.assert_allclose(counts.changes, expected[2], atol=1e-9)
    np.testing.assert_allclose(kept, expected[3], atol=1e-10)


@given(seeds, st.integers(1, 2000), chains, st.sampled_from([0.0, 0.01, 0.3, 1.0]))
def test_counts_add_up(seed, N, chain, share):
    rng = np.random.default_rng(seed)
    logs, starts = 5 * rng.normal(size=(2, N)), rng.random(N) < share
    starts[0] = True
    free, _, counts, kept = smooth(*logs, starts, chain, rng.normal(size=N))
    assert np.all((free >= 0) & (free <= 1) & (kept >= 0) & (kept <= 1 + 1e-12))
    np.testing.assert_allclose(counts.states, [free.sum(), N - free.sum()], rtol=1e-9, atol=1e-9)
    assert counts.changes.sum() == pytest.approx(N - starts.sum())
    assert counts.changes[1, 1] == pytest.approx(kept.sum())


@given(seeds, chains)
def test_episodes_do_not_hear_of_each_other(seed, chain):
    rng = np.random.default_rng(seed)
    logs, kept = 5 * rng.normal(size=(2, 60)), rng.normal(size=60)
    starts = np.arange(60) % 20 == 0
    together = smooth(*logs, starts, chain, kept)
    for k in range(3):
        rows = slice(20 * k, 20 * k + 20)
        alone = smooth(*logs[:, rows], starts[rows], chain, kept[rows])
        np.testing.assert_allclose(together[0][rows], alone[0], atol=1e-12)
        np.testing.assert_allclose(together[1][rows], alone[1], rtol=1e-12)


@given(seeds, st.sampled_from([1e3, 1e9, 1e15]))
def test_extreme_likelihoods_are_certain_and_finite(seed, size):
    rng = np.random.default_rng(seed)
    logs, kept = size * rng.normal(size=(2, 500)), size * rng.normal(size=500)
    starts = np.arange(500) % 50 == 0
    for of_kept in (None, kept):
        free, log, counts, _ = smooth(*logs, starts, Chain(), of_kept)
        assert np.isfinite(free).all()
        assert np.isfinite(log).all()
        assert np.isfinite(counts.changes).all()


@given(seeds, st.booleans())
def test_what_is_known_is_certain_against_any_neighbours(seed, is_free):
    rng = np.random.default_rng(seed)
    logs = 1e4 * rng.normal(size=(2, 40))
    logs[1 if is_free else 0, 20] = -np.inf
    free, log, counts, kept = smooth(*logs, np.arange(40) == 0, Chain(), np.full(40, 1e4))
    assert free[20] == float(is_free)
    assert np.isfinite(log).all()
    assert counts.changes.sum() == pytest.approx(39)
    assert kept[20] == 0 or not is_free
    assert smooth(*logs, np.ones(40, dtype=bool), Chain())[0][20] == float(is_free)


@given(seeds)
def test_weights_count_samples_as_often(seed):
    rng = np.random.default_rng(seed)
    logs, weights = rng.normal(size=(2, 30)), rng.integers(0, 4, 30)
    alone = np.ones(30, dtype=bool)
    counts = smooth(*logs, alone, Chain(), weights=weights.astype(float))[2]
    repeated = np.repeat(logs, weights, axis=1)
    expected = smooth(*repeated, np.ones(weights.sum(), dtype=bool), Chain())[2]
    np.testing.assert_allclose(counts.states, expected.states)
    episodes = np.arange(30) % 10 == 0
    ones, twos = (smooth(*logs, episodes, Chain(), weights=np.full(30, w))[2] for w in (1.0, 2.0))
    np.testing.assert_allclose(2 * ones.states, twos.states)
    np.testing.assert_allclose(2 * ones.changes, twos.changes)


def test_probabilities_come_from_counts_and_are_never_certain():
    for states, changes in (
        ((0, 0), np.zeros((2, 2))),
        ((1e6, 0), np.diag([1e6, 0])),
        ((0, 9), np.diag([0, 8])),
    ):
        chain = Counts(np.array(states, dtype=float), np.asarray(changes, dtype=float)).chain()
        assert 0 < chain.free_share < 1
        assert 0 < chain.leave_free < 1
        assert 0 < chain.leave_constrained < 1
        np.testing.assert_allclose(chain.transitions.sum(axis=1), 1)
    many = Counts(np.array([3e6, 1e6]), np.array([[2.7e6, 0.3e6], [0.3e6, 0.7e6]])).chain()
    assert many.free_share == pytest.approx(0.75, rel=1e-4)
    assert many.leave_free == pytest.approx(0.1, rel=1e-3)
    assert many.leave_constrained == pytest.approx(0.3, rel=1e-3)
    assert Chain.held("free").free_share > 0.99 > 0.01 > Chain.held("constrained").free_share
