"""Centres that would not fit, and widths whose squares double precision does not hold."""

import numpy as np
import pytest

import unconstrain as uc
from unconstrain.features.centers import farthest_first

X = np.random.default_rng(0).uniform(size=(60, 2))


@pytest.mark.parametrize("n_centers", [10**13, 10**400])
def test_a_grid_that_does_not_fit_is_refused_in_a_sentence(n_centers):
    with pytest.raises(uc.errors.DataError, match=r"would take .* of memory") as caught:
        uc.NormalizedRBF(n_centers, centers="grid").fit(X)
    assert "\n" not in str(caught.value)


def test_centers_that_nothing_can_be_solved_for_are_refused_in_a_sentence():
    centers = np.random.default_rng(0).uniform(size=(200_000, 2))
    with pytest.raises(uc.errors.DataError, match=r"so many parameters would take .* of memory"):
        uc.ParametricPolicy(uc.NormalizedRBF(centers=centers, width=0.1), risk="corrected", alpha=1e-6).fit(
            X, X
        )


@pytest.mark.parametrize("placement", ["kmeans", "coverage"])
def test_more_centers_than_states_are_as_many_as_states(placement):
    assert len(uc.NormalizedRBF(10**9, centers=placement).fit(X).centers_) <= len(X)


@pytest.mark.parametrize(("width", "n_centers"), [(1e-200, len(X)), (1e200, 1)])
def test_widths_may_be_of_any_size(width, n_centers):
    with np.errstate(all="raise", under="ignore"):
        basis = uc.NormalizedRBF(centers="coverage", width=width).fit(X)
        B = basis.transform(X)
    assert len(basis.centers_) == n_centers
    np.testing.assert_allclose(B.sum(axis=1), 1.0)


def test_radii_of_any_size_are_compared():
    assert len(farthest_first(X, radius=1e-200)[0]) == len(X)
    assert len(farthest_first(X, radius=1e200)[0]) == 1
