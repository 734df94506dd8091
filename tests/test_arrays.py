"""What is no array of numbers, or one of another shape, is refused in a sentence that says what to do."""

import pickle
import subprocess
import sys

import numpy as np
import pytest

import unconstrain as uc
from unconstrain.arrays import (
    check_actions,
    check_choice,
    check_number,
    check_numbers,
    check_projections,
    check_squarable,
    check_weights,
)

X = np.random.default_rng(0).normal(size=(300, 3))
FITTED = uc.ParametricPolicy(alpha=1e-3).fit(X, -X)


def test_numbers_of_any_kind_become_double_precision():
    for given in ([1, 2], [True, False], np.float32([1, 2]), ["1", "2.5"], [None, 1.0]):
        assert check_numbers(given, "it").dtype == np.float64
    np.testing.assert_array_equal(check_actions([1.0, 2.0]), [[1.0], [2.0]])


def test_projections_that_are_not_known_pass_where_they_may():
    N = np.stack([np.eye(2), np.full((2, 2), np.nan), np.round([[0.642, 0.479], [0.479, 0.358]], 2)])
    np.testing.assert_array_equal(check_projections(N, 3, 2, unknown=True), N)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: check_numbers([[1.0], [1.0, 2.0]], "it"), "it must be an array of numbers, all rows of the"),
        (lambda: check_numbers(["one"], "it"), "it must be an array of numbers"),
        (lambda: check_numbers([10**400], "it"), "it must be an array of numbers"),
        (lambda: check_numbers([1j], "it"), "it must be real numbers, and these are complex"),
        (lambda: check_actions(np.ones((2, 2, 2))), r"got an array of shape \(2, 2, 2\)"),
        (lambda: check_actions([[1.0, np.inf]]), r"an infinite value \(inf\) in row 0, column 1"),
        (lambda: check_squarable("they", np.array([1.0, -1e200])), r"they reach 1e\+200, whose square"),
        (lambda: check_squarable("they", np.array([1e-200])), "they reach 1e-200, whose square"),
        (lambda: check_weights([1.0, 1e308], X[:2]), r"the sample weights reach 1e\+308"),
        (lambda: check_projections(np.full((1, 2, 2), np.nan), 1, 2), "row 0 is NaN, that is, not known"),
        (lambda: check_projections(2 * np.eye(2)[None], 1, 2), "the projection of row 0 is none"),
        (lambda: check_number([1], "alpha", positive=True), "alpha must be a number above zero"),
        (lambda: check_number(10**400, "alpha", positive=True), "alpha must be a number above zero"),
        (lambda: check_number(float("nan"), "alpha", positive=False), "finite number of at least zero"),
        (lambda: check_choice("a", "way", ("b", "c")), "way must be one of 'b', 'c', got 'a'"),
        (lambda: FITTED.predict(X[:3].T @ X[:3] * 1e160), r"the states X reach .*, whose square"),
    ],
)
def test_what_cannot_be_used_is_told(call, sentence):
    with pytest.raises(uc.errors.UnconstrainError, match=sentence) as caught:
        call()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "call",
    [
        lambda: uc.ParametricPolicy().fit(X.T, X),
        lambda: uc.LocallyLinearPolicy().fit(X.T.tolist(), X[:, 0].tolist()),
        lambda: FITTED.predict(X.T),
    ],
)
def test_arrays_the_wrong_way_round_are_recognised(call):
    with pytest.raises(
        uc.errors.DataError, match=r"X has shape \(3, 300\).* did you mean the transpose, X\.T\?"
    ):
        call()


def test_a_small_batch_of_other_states_is_no_transpose():
    with pytest.raises(uc.errors.DataError) as caught:
        FITTED.predict(np.ones((2, 7)))
    assert "transpose" not in str(caught.value)


@pytest.mark.parametrize(
    ("scale", "sentence"), [(1e-200, "actions y reach 1e-200"), (1e160, r"actions y reach 1e\+160")]
)
def test_actions_in_an_impossible_unit_are_not_said_to_be_zero(scale, sentence):
    with pytest.raises(uc.errors.DataError, match=sentence):
        uc.ParametricPolicy().fit(X, scale * np.sign(X))
    among_ones = np.ones_like(X)
    among_ones[7] = 1e300
    with pytest.raises(uc.errors.DataError, match=r"actions y reach 1e\+300"):
        uc.ParametricPolicy().fit(X, among_ones)


def test_metrics_do_without_scikit_learn():
    code = "import sys, unconstrain.metrics; print('sklearn' in sys.modules, 'scipy' in sys.modules)"
    assert subprocess.check_output([sys.executable, "-c", code], text=True).split() == ["False", "False"]


def test_the_place_of_a_mistake_can_be_asked_for_also_after_a_process_has_sent_it():
    with pytest.raises(uc.errors.DataError) as caught:
        check_actions([[1.0, 2.0], [3.0, np.nan]])
    sent = pickle.loads(pickle.dumps(caught.value))
    assert (sent.row, sent.column, str(sent)) == (1, 1, str(caught.value))
    assert uc.errors.DataError("no array").row is None


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: uc.ParametricPolicy().fit({}, X), "X|float"),
        (lambda: uc.ParametricPolicy().fit(X, -1.0), "1 dimension"),
        (lambda: uc.ParametricPolicy().fit(X + 1j, X), "Complex data not supported$"),
        (lambda: uc.ParametricPolicy().fit(X, X, sample_weight=slice(3)), "slice"),
        (
            lambda: uc.ParametricPolicy().fit(X, X, groups=[[1], [1, 2]]),
            "groups must hold one label a sample",
        ),
        (
            lambda: uc.ParametricPolicy().fit(X, X, groups=[1, "a", {}] * 100),
            "cannot be compared with each other",
        ),
        (lambda: uc.LocallyLinearPolicy(n_centers=10**400, centers="grid").fit(X, X), "memory"),
        (lambda: uc.LocallyLinearPolicy(centers={1}).fit(X, X), "centers must be an array of numbers"),
        (lambda: uc.LocallyLinearPolicy(coverage="x", n_centers=3).fit(X, X), "coverage must be a number"),
        (lambda: uc.LocallyLinearPolicy(centers=[[1e6] * 3], width=1.0).fit(X, X), "far from all centres"),
        (lambda: uc.NormalizedRBF(3, random_state="x").fit(X), "random_state must be a whole number"),
        (lambda: uc.constraints.unconstrained(-1), "d must be a whole number of at least 1"),
        (lambda: uc.constraints.unconstrained(10**9), "memory"),
        (lambda: uc.constraints.from_jacobian(np.ones((2, 1, 3)), rows=1.5), "there is no row 1.5"),
        (lambda: uc.constraints.from_forces(X, 0.5, margin="a"), "margin must be a whole number"),
        (lambda: uc.constraints.contact(X, 0.5, release="a"), "release must be above zero"),
        (lambda: uc.constraints.from_forces(X, 0.5, actions=X[None]), "actions must be"),
        (lambda: uc.metrics.normalized(None, X), "the error must be a number"),
        (lambda: uc.constraints.projection([[1 + 1j, 0]]), "must be real numbers"),
        (lambda: uc.identifiability(FITTED, X, X[:, : FITTED.n_actions_] * 1e200), "the actions U reach"),
        (lambda: uc.select_policy(np.array(None), X, X), "candidates must be policies"),
        (lambda: FITTED.save(3.5), "is no path of a file"),
        (lambda: FITTED.save("~nobody-of-that-name/x"), "is no path of a file"),
        (lambda: FITTED.to_onnx(None), "None is no path of a file"),
        (lambda: uc.load_policy(3.5), "is no path of a file"),
    ],
)
def test_values_of_another_kind_are_told_in_one_sentence(call, sentence):
    with pytest.raises(uc.errors.UnconstrainError, match=sentence) as caught:
        call()
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 400


def test_what_is_masked_is_missing_and_no_number():
    X = np.random.default_rng(0).normal(size=(9, 2))
    masked = np.ma.masked_greater(X, 0.5)
    row = int(np.argmax(masked.mask.any(axis=1)))
    for learn in (
        lambda: uc.ParametricPolicy().fit(masked, X),
        lambda: uc.ParametricPolicy().fit(X, masked),
        lambda: uc.ParametricPolicy().fit(X, X).predict(masked),
        lambda: uc.Demonstrations(masked, X),
    ):
        with pytest.raises(uc.errors.DataError, match=rf"row {row}\b"):
            learn()
