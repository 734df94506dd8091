"""Lengths and directions of actions, whatever their unit."""

import numpy as np
import pytest

from unconstrain.motion import directions, lengths, moving, root_mean_square


def test_lengths_are_right_where_squares_are_not():
    U = np.array([[3e200, 4e200], [3e-200, 4e-200], [3.0, 4.0], [0.0, 0.0]])
    np.testing.assert_allclose(lengths(U), [5e200, 5e-200, 5.0, 0.0], rtol=1e-12)
    np.testing.assert_allclose(lengths(U[1:2]), [5e-200], rtol=1e-12)
    assert moving(np.array([[1.0], [1e300]])).tolist() == [False, True]
    np.testing.assert_allclose(directions(1e-320 * np.ones((1, 1)))[0], [[1.0]])


@pytest.mark.parametrize("scale", [1e-300, 1.0, 1e300])
def test_the_root_mean_square_scales_with_the_actions(scale):
    assert root_mean_square(scale * np.array([[3.0, 4.0], [0.0, 0.0]])) == pytest.approx(
        scale * np.sqrt(12.5)
    )
    assert root_mean_square(np.zeros((3, 2))) == 0.0


def test_single_precision_is_summed_in_double():
    U = np.full((1, 3), 1e30, dtype=np.float32)
    np.testing.assert_allclose(lengths(U), [np.sqrt(3) * 1e30], rtol=1e-6)
    unit, r = directions(U)
    assert unit.dtype == r.dtype == np.float64
