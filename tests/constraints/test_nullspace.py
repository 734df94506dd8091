"""Laws of the nullspace projection, whatever the constraint."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from unconstrain.constraints import combine, projection, unconstrained
from unconstrain.errors import DataError

# Small integers make zero rows, repeated rows and exact dependence common, as contacts do.
matrices = st.tuples(st.integers(0, 5), st.integers(1, 4)).flatmap(
    lambda shape: arrays(np.float64, shape, elements=st.integers(-3, 3).map(float))
)
batches = st.tuples(st.integers(1, 4), st.integers(0, 5), st.integers(1, 4)).flatmap(
    lambda shape: arrays(np.float64, shape, elements=st.integers(-3, 3).map(float))
)


@given(matrices)
def test_is_the_projection_onto_the_nullspace(A):
    N = projection(A)
    np.testing.assert_allclose(N, N.T, atol=1e-12)
    np.testing.assert_allclose(N @ N, N, atol=1e-12)
    np.testing.assert_allclose(A @ N, 0, atol=1e-11)
    rank = np.linalg.matrix_rank(A) if A.size else 0
    assert np.trace(N) == pytest.approx(A.shape[1] - rank)


@given(matrices, st.lists(st.floats(1e-6, 1e6), min_size=5, max_size=5), st.sampled_from([-1.0, 1.0]))
def test_length_and_sign_of_rows_do_not_matter(A, scales, sign):
    scaled = sign * np.array(scales)[: len(A), None] * A
    np.testing.assert_allclose(projection(scaled), projection(A), atol=1e-9)


@given(matrices.filter(len), st.integers(0, 2**32 - 1))
def test_rows_that_follow_from_others_do_not_matter(A, seed):
    mix = np.random.default_rng(seed).integers(-2, 3, (3, len(A))).astype(float)
    np.testing.assert_allclose(projection(combine(A, mix @ A)), projection(A), atol=1e-9)


@given(batches)
def test_a_batch_is_its_members(A):
    np.testing.assert_array_equal(projection(A).shape, (len(A), A.shape[2], A.shape[2]))
    for one, N in zip(A, projection(A), strict=True):
        np.testing.assert_allclose(N, projection(one), atol=1e-12)


@pytest.mark.parametrize("scale", [1e-200, 1e-160, 1e160, 1e200])
def test_rows_of_extreme_length_keep_their_direction(scale):
    np.testing.assert_allclose(projection([[3 * scale, 4 * scale]]), [[0.64, -0.48], [-0.48, 0.36]])


def test_nothing_and_everything_constrained():
    np.testing.assert_array_equal(projection(np.empty((0, 3))), unconstrained(3))
    np.testing.assert_array_equal(projection(np.zeros((2, 3))), unconstrained(3))
    np.testing.assert_array_equal(projection(np.empty((4, 0, 3))), unconstrained(3, samples=4))
    np.testing.assert_allclose(projection(np.eye(3)), 0, atol=1e-12)


def test_a_row_of_rounding_errors_constrains_nothing():
    np.testing.assert_allclose(projection([[1.0, 0.0], [0.0, 6e-17]]), projection([[1.0, 0.0]]))


def test_combining_a_single_constraint_with_one_per_sample():
    A, B = np.ones((1, 3)), np.arange(12.0).reshape(2, 2, 3)
    both = combine(A, B)
    assert both.shape == (2, 3, 3)
    np.testing.assert_array_equal(both[:, 0], np.ones((2, 3)))


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: projection([1.0, 2.0]), r"not \(2,\); write a single row as"),
        (lambda: projection([[1.0, np.nan]]), r"NaN or infinity at index \(0, 1\)"),
        (lambda: projection([[1.0], [1.0, 2.0]]), "pad samples"),
        (lambda: combine(), "at least one"),
        (lambda: combine(np.eye(2), np.eye(3)), "over 2 and 3 actions"),
        (lambda: combine(np.ones((2, 1, 3)), np.ones((4, 1, 3))), "of 2 and 4 samples"),
    ],
)
def test_mistakes_are_told_in_a_sentence(call, sentence):
    with pytest.raises(DataError, match=sentence):
        call()
