"""Laws of the errors, whatever the policy, the constraints and the unit."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import unconstrain as uc
from tests.problems import problems
from unconstrain import metrics as risk
from unconstrain.fitting.observation import observe
from unconstrain.motion import moving


@given(problems(), st.floats(-3, 3))
def test_inconsistency_is_below_cpe_is_below_upe(problem, exponent):
    _, Pi, N, U, rng = problem
    P = Pi + rng.normal(size=Pi.shape) * 10.0**exponent
    scale = np.mean(Pi**2) + np.mean(P**2)
    e_i, cpe, upe = (
        risk.inconsistency(U, P),
        risk.constrained_policy_error(Pi, P, N),
        risk.unconstrained_policy_error(Pi, P),
    )
    assert e_i <= cpe + 1e-12 * scale
    assert cpe <= upe + 1e-12 * scale


@given(st.integers(0, 2**32 - 1))
def test_in_the_plane_with_one_constraint_inconsistency_equals_cpe(seed):
    rng = np.random.default_rng(seed)
    Pi, P = rng.normal(size=(2, 50, 2))
    N = uc.constraints.projection(rng.normal(size=(50, 1, 2)))
    U = np.einsum("nij,nj->ni", N, Pi)
    np.testing.assert_allclose(risk.inconsistency(U, P), risk.constrained_policy_error(Pi, P, N), rtol=1e-9)


@given(problems())
def test_the_true_policy_has_no_inconsistency(problem):
    _, Pi, _, U, _ = problem
    assert risk.inconsistency(U, Pi) <= 1e-20 * np.sum(Pi**2)


@given(problems())
def test_every_risk_is_the_error_of_its_observation(problem):
    _, Pi, _, U, rng = problem
    P = Pi + rng.normal(size=Pi.shape)
    expected = {
        "inconsistency": risk.inconsistency(U, P),
        "direct": risk.direct(U, P),
    }
    for name in expected:
        seen = observe(name, U)
        error = np.mean(np.sum((seen.targets - np.einsum("nkd,nd->nk", seen.rows, P)) ** 2, axis=1))
        np.testing.assert_allclose(error, expected[name], rtol=1e-7, atol=1e-12 * np.mean(P**2))


def test_blocked_samples_have_no_direction_even_where_rounding_leaves_one():
    U = np.array([[1.0, 0.0], [0.0, 0.0], [1e-17, -1e-17]])
    assert moving(U).tolist() == [True, False, False]
    assert risk.inconsistency(U, np.array([[1.0, 5.0], [7.0, 7.0], [7.0, 7.0]])) == 0.0


def test_normalised_by_the_variance_of_the_true_policy():
    Pi = np.array([[0.0, 0.0], [2.0, 4.0]])
    assert risk.normalized(2.5, Pi) == 0.5  # variances 1 and 4
    with pytest.raises(uc.errors.DataError, match="the same at every sample"):
        risk.normalized(1.0, np.ones((3, 2)))


def test_shapes_that_do_not_match_are_told():
    with pytest.raises(uc.errors.DataError, match=r"actions \(3, 2\) and predictions \(4, 2\)"):
        risk.inconsistency(np.ones((3, 2)), np.ones((4, 2)))
    with pytest.raises(uc.errors.DataError, match=r"projections must have shape \(3, 2, 2\)"):
        risk.constrained_policy_error(np.ones((3, 2)), np.ones((3, 2)), np.eye(2))


@given(problems(), st.floats(-3, 3), st.floats(0, 1))
def test_knowing_projections_judges_more_of_a_policy_but_never_more_than_cpe(problem, exponent, share):
    _, Pi, N, U, rng = problem
    P = Pi + rng.normal(size=Pi.shape) * 10.0**exponent
    slack = 1e-12 * (np.mean(Pi**2) + np.mean(P**2))
    laws = [
        risk.inconsistency(U, P),
        risk.inconsistency(U, P, np.where(rng.random((len(N), 1, 1)) < share, np.nan, N)),
        risk.constrained_policy_error(Pi, P, N),
        risk.unconstrained_policy_error(Pi, P),
    ]
    assert all(a <= b + slack for a, b in pairwise(laws))


@given(problems(), st.floats(0, 1))
def test_projections_not_known_leave_the_inconsistency_as_it_is(problem, share):
    _, Pi, N, U, rng = problem
    P = Pi + rng.normal(size=Pi.shape)
    plain = risk.inconsistency(U, P)
    np.testing.assert_array_equal(risk.inconsistency(U, P, np.full_like(N, np.nan)), plain)
    hidden = rng.random(len(N)) < share
    known = np.where(hidden[:, None, None], np.nan, N)
    by_sample = np.where(
        hidden,
        [risk.inconsistency(u[None], p[None]) for u, p in zip(U, P, strict=True)],
        [risk.constrained_policy_error(u[None], p[None], n[None]) for u, p, n in zip(U, P, N, strict=True)],
    )
    # One by one a sample has no longest action beside it, so rounding left by a projection would count as motion.
    by_sample[hidden & ~moving(U)] = 0.0
    np.testing.assert_allclose(risk.inconsistency(U, P, known), by_sample.mean(), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("scale", [1e-300, 1e-200, 1.0, 1e160, 1e300])
def test_the_share_explained_does_not_depend_on_the_unit(scale):
    rng = np.random.default_rng(0)
    U = rng.normal(size=(50, 2))
    P = U + 0.1 * rng.normal(size=(50, 2))
    assert uc.metrics.explained(scale * U, scale * P) == pytest.approx(uc.metrics.explained(U, P))
    assert uc.metrics.explained(scale * U, scale * U) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: risk.explained(np.zeros((3, 2)), np.ones((3, 2))), "all actions are zero"),
        (
            lambda: risk.explained(1e-200 * np.ones((3, 2)), np.ones((3, 2))),
            "so much larger than the actions",
        ),
        (
            lambda: risk.direct(1e160 * np.ones((3, 2)), np.ones((3, 2))),
            "actions and predictions reach 1e\\+160",
        ),
        (lambda: risk.normalized(1.0, 1e-200 * np.eye(2)), "true policy's actions reach 1e-200"),
        (lambda: risk.inconsistency(np.empty((0, 2)), np.empty((0, 2))), "no samples"),
        (lambda: risk.direct(np.ones((9, 2)), np.ones((2, 9))), r"same shape: did you mean the transpose\?"),
    ],
)
def test_what_cannot_be_measured_is_told(call, sentence):
    with pytest.raises(uc.errors.DataError, match=sentence):
        call()
