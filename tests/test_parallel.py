from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

import unconstrain as uc
from unconstrain.parallel import cut_blocks, map_shares


def test_blocks_cover_every_sample_once():
    assert [list(range(10))[block] for block in cut_blocks(10, 4)] == [[0, 1, 2, 3], [4, 5, 6, 7], [8, 9]]
    assert cut_blocks(0, 4) == []


def test_every_piece_is_worked_on_once_whatever_the_threads():
    for threads in (1, 2, 4):
        with threadpool_limits(threads):
            shares = map_shares(list, list(range(11)))
        assert sorted(piece for share in shares for piece in share) == list(range(11))


def test_what_goes_wrong_in_a_thread_reaches_the_caller():
    def fail(pieces):
        raise ValueError("broken piece")

    with pytest.raises(ValueError, match="broken piece"):
        map_shares(fail, [1, 2, 3])


@pytest.mark.parametrize(
    "policy",
    [
        uc.ParametricPolicy(uc.NormalizedRBF(20), risk="inconsistency", alpha=0.1),
        uc.LocallyLinearPolicy(n_centers=9, risk="inconsistency", alpha=0.1),
    ],
)
def test_a_fit_is_the_same_in_one_thread_in_many_and_side_by_side(policy):
    rng = np.random.default_rng(0)
    X = rng.uniform(-1, 1, size=(20_000, 2))
    U = np.sin(3 * X) * rng.random((len(X), 1))

    def fitted(_=None):
        return type(policy)(**policy.get_params(deep=False)).fit(X, U).predict(X[:100])

    with threadpool_limits(1):
        alone = fitted()
    np.testing.assert_allclose(fitted(), alone, rtol=1e-7, atol=1e-9)
    np.testing.assert_array_equal(fitted(), fitted())
    with ThreadPoolExecutor(3) as pool:
        for each in pool.map(fitted, range(6)):
            np.testing.assert_allclose(each, alone, rtol=1e-7, atol=1e-9)


def test_actions_and_contact_do_not_hang_on_threads():
    rng = np.random.default_rng(0)
    X = rng.normal(size=(70_000, 2))
    policy = uc.LocallyLinearPolicy(n_centers=5).fit(X[:300], np.sin(X[:300]), groups=np.arange(300) // 30)
    demos = uc.Demonstrations(X, np.sin(X), np.arange(70_000) // 100)
    found = []
    for threads in (1, 2):
        with threadpool_limits(threads):
            found.append((policy.predict(X), policy.free_probability(demos)))
    for one, other in zip(*found, strict=True):
        np.testing.assert_allclose(other, one, rtol=1e-12, atol=1e-14)
