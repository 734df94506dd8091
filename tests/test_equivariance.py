"""Laws: what a policy may not depend on, for every estimator, feature map and risk.

The policy learnt from the same recordings in other words is the same policy, to rounding. Other words are

- *states* counted from another origin (up to 1e6 times their spread away) and *each in another unit* (1e-6 to 1e6 times
  as large). This holds for linear features and local models of them, for `NormalizedRBF` and receptive fields whose
  width is not given, for splines, for polynomials with a constant, and for `DecoupledFeatures`, each joint in its own
  unit. Where a width is given it is in the states' unit, so it is scaled along, and all states by one factor;
- for `PotentialFeatures` all states are scaled by one factor. Other units of one state alone make another class of
  policies of it: action and state go together in a gradient, and actions stay as they were;
- *actions* in another unit: the policy is in that unit;
- *axes of the actions* turned, with known projections: the policy turns along. It holds where every action has weights
  of its own; decoupled and potential features tie action j to state j;
- *episodes in another order*, at a given λ. With `alpha="cv"` the first of them decide the folds, so λ may be another;
- under the adaptive and the corrected risk all of these but pieces, to the rounding that passes add up, on a few data
  sets each: the former chooses among ends of passes, and where two of them are equally good, rounding may choose;
- *files*: the recordings in pieces, in a stream; in `partial_fit` where nothing but the standardisation is placed by
  the first piece.

A transformer of the user's own gets the states as they are, and may make of them what it likes.
"""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.base import clone
from sklearn.preprocessing import PolynomialFeatures, SplineTransformer

import unconstrain as uc
from tests.problems import rotation

SHIFTS, EXPONENTS = st.integers(-(10**6), 10**6), st.floats(-6.0, 6.0)
RISKS = ("inconsistency", "direct", "partly known")
ALPHAS = (1e-3, "cv")

FULL = {
    "linear": uc.ParametricPolicy(),
    "RBF": uc.ParametricPolicy(uc.NormalizedRBF(9)),
    "RBF, grid": uc.ParametricPolicy(uc.NormalizedRBF(9, centers="grid")),
    "RBF, coverage": uc.ParametricPolicy(uc.NormalizedRBF(9, centers="coverage")),
    "splines": uc.ParametricPolicy(SplineTransformer(n_knots=3, extrapolation="linear")),
    "polynomials": uc.ParametricPolicy(PolynomialFeatures(2)),
    "local": uc.LocallyLinearPolicy(n_centers=5),
    "local, zero": uc.LocallyLinearPolicy(n_centers=5, prior="zero"),
    "local, kmeans": uc.LocallyLinearPolicy(n_centers=5, centers="kmeans"),
    "local RBF": uc.LocallyLinearPolicy(uc.NormalizedRBF(4), n_centers=3),
    "local polynomials": uc.LocallyLinearPolicy(PolynomialFeatures(2), n_centers=3),
}
PAIRED = {"decoupled": uc.ParametricPolicy(uc.DecoupledFeatures(4))}
POTENTIAL = {
    "potential": uc.ParametricPolicy(uc.PotentialFeatures(uc.NormalizedRBF(9))),
    "potential of polynomials": uc.ParametricPolicy(uc.PotentialFeatures(PolynomialFeatures(3))),
    "potential of splines": uc.ParametricPolicy(uc.PotentialFeatures(SplineTransformer(n_knots=3))),
}
POLICIES = FULL | PAIRED | POTENTIAL


class Problem:
    """Recordings with noise: without it the risk is rounding, and so is the λ that is chosen by it.

    States are multiples of 2^-16, so that moving them costs no digit, and what is compared is not other data.
    """

    def __init__(self, seed, N=120, n=2):
        rng = np.random.default_rng(seed)
        self.rng = rng
        self.X = np.round(rng.normal(size=(N, n)) * 2**16) / 2**16
        Pi = np.sin(self.X @ rng.normal(size=(n, n))) + 0.3 * rng.normal(size=n)
        P = uc.constraints.projection(rng.normal(size=(N, 1, n)))
        self.known = np.where((np.arange(N) % 2)[:, None, None], np.nan, P)
        self.U = np.einsum("nij,nj->ni", P, Pi) + 0.02 * rng.normal(size=(N, n))
        self.groups = np.arange(N) // 10
        self.test = np.round(rng.normal(size=(30, n)) * 2**16) / 2**16


def learn(policy, risk, alpha, X, U, groups, known):
    """Fit a copy by a risk; those that only partly know the projections have the default one."""
    policy = clone(policy).set_params(risk="direct" if risk == "direct" else "inconsistency", alpha=alpha)
    return policy.fit(X, U, groups=groups, projections=known if risk == "partly known" else None)


def assert_same(a, b, rtol=1e-6):
    np.testing.assert_allclose(a, b, rtol=0, atol=rtol * np.abs(b).max())


every = pytest.mark.parametrize("name", POLICIES)
examples = settings(deadline=None, max_examples=8)
problems, risks, alphas = st.integers(0, 2**32 - 1), st.sampled_from(RISKS), st.sampled_from(ALPHAS)


@every
@examples
@given(
    problems,
    risks,
    alphas,
    st.lists(SHIFTS, min_size=2, max_size=2),
    st.lists(EXPONENTS, min_size=2, max_size=2),
)
def test_origin_and_units_of_the_states_do_not_matter(name, seed, risk, alpha, shift, exponents):
    p = Problem(seed)
    unit = 10.0 ** np.array(exponents)
    if name in POTENTIAL:
        unit[:] = unit[0]
    same = (lambda X: X + shift), (lambda X: X * unit), (lambda X: (X + shift) * unit)
    before = learn(POLICIES[name], risk, alpha, p.X, p.U, p.groups, p.known).predict(p.test)
    for other in same:
        policy = learn(POLICIES[name], risk, alpha, other(p.X), p.U, p.groups, p.known)
        assert_same(policy.predict(other(p.test)), before)


@examples
@given(problems, risks, st.lists(SHIFTS, min_size=2, max_size=2), EXPONENTS)
def test_a_given_width_is_in_the_states_unit(seed, risk, shift, exponent):
    p, unit = Problem(seed), 10.0**exponent
    for make in (
        lambda width: uc.ParametricPolicy(uc.NormalizedRBF(9, width=width)),
        lambda width: uc.ParametricPolicy(uc.PotentialFeatures(uc.NormalizedRBF(9, width=width))),
        lambda width: uc.LocallyLinearPolicy(width=width),
        lambda width: uc.LocallyLinearPolicy(width=[width, width]),
    ):
        before = learn(make(1.0), risk, 1e-3, p.X, p.U, p.groups, p.known).predict(p.test)
        policy = learn(make(unit), risk, 1e-3, (p.X + shift) * unit, p.U, p.groups, p.known)
        assert_same(policy.predict((p.test + shift) * unit), before)


@every
@examples
@given(problems, risks, alphas, EXPONENTS)
def test_a_policy_is_in_the_unit_of_the_actions(name, seed, risk, alpha, exponent):
    p, unit = Problem(seed), 10.0**exponent
    before = learn(POLICIES[name], risk, alpha, p.X, p.U, p.groups, p.known).predict(p.test)
    policy = learn(POLICIES[name], risk, alpha, p.X, p.U * unit, p.groups, p.known)
    assert_same(policy.predict(p.test), before * unit)


@pytest.mark.parametrize("name", FULL)
@examples
@given(problems, risks, alphas)
def test_a_policy_turns_with_the_axes_of_the_actions(name, seed, risk, alpha):
    p = Problem(seed)
    R = rotation(2, p.rng)
    before = learn(FULL[name], risk, alpha, p.X, p.U, p.groups, p.known).predict(p.test)
    policy = learn(FULL[name], risk, alpha, p.X, p.U @ R, p.groups, R.T @ p.known @ R)
    assert_same(policy.predict(p.test), before @ R)


@every
@examples
@given(problems, risks)
def test_the_order_of_episodes_does_not_matter(name, seed, risk):
    p = Problem(seed)
    order = np.argsort(p.rng.permutation(p.groups.max() + 1)[p.groups], kind="stable")
    before = learn(POLICIES[name], risk, 1e-3, p.X, p.U, p.groups, p.known).predict(p.test)
    policy = learn(POLICIES[name], risk, 1e-3, p.X[order], p.U[order], p.groups[order], p.known[order])
    assert_same(policy.predict(p.test), before)


@pytest.mark.parametrize("risk", ["adaptive", "corrected"])
@pytest.mark.parametrize("alpha", ALPHAS)
@every
def test_risks_that_find_the_noise_obey_the_same_laws(name, alpha, risk):
    def policy(X, U, groups):
        return clone(POLICIES[name]).set_params(risk=risk, alpha=alpha).fit(X, U, groups=groups)

    p = Problem(1)
    shift, unit = np.array([1000, -5]), np.array([1e3, 1e3 if name in POTENTIAL else 1e-2])
    before = policy(p.X, p.U, p.groups).predict(p.test)
    assert_same(policy((p.X + shift) * unit, p.U, p.groups).predict((p.test + shift) * unit), before)
    assert_same(policy(p.X, 1e4 * p.U, p.groups).predict(p.test), 1e4 * before)
    if name in FULL:
        R = rotation(2, p.rng)
        assert_same(policy(p.X, p.U @ R, p.groups).predict(p.test), before @ R)
    if alpha != "cv":
        order = np.argsort(p.rng.permutation(p.groups.max() + 1)[p.groups], kind="stable")
        assert_same(policy(p.X[order], p.U[order], p.groups[order]).predict(p.test), before)


@every
@examples
@given(
    problems,
    st.sampled_from(RISKS[:2]),
    alphas,
    st.lists(st.integers(1, 11), min_size=1, max_size=3, unique=True),
)
def test_recordings_may_come_in_pieces(name, seed, risk, alpha, cuts):
    p = Problem(seed)
    before = learn(POLICIES[name], risk, alpha, p.X, p.U, p.groups, p.known).predict(p.test)
    ends = [0, *sorted(10 * cut for cut in cuts), len(p.X)]
    pieces = [slice(a, b) for a, b in pairwise(ends)]
    policy = clone(POLICIES[name]).set_params(risk=risk, alpha=alpha)
    batches = [(p.X[piece], p.U[piece], p.groups[piece]) for piece in pieces]
    assert_same(uc.fit_stream(clone(policy), batches).predict(p.test), before)
    if name == "linear" and alpha != "cv":  # which has no folds yet where the first piece is one episode
        for X, U, groups in batches:
            policy.partial_fit(X, U, groups=groups)
        assert_same(policy.predict(p.test), before)


@every
@examples
@given(
    problems, st.lists(SHIFTS, min_size=2, max_size=2), st.lists(EXPONENTS, min_size=2, max_size=2), EXPONENTS
)
def test_what_data_determine_does_not_hang_on_units(name, seed, shift, exponents, exponent):
    p = Problem(seed, N=80)
    unit, of_actions = 10.0 ** np.array(exponents), 10.0**exponent
    if name in POTENTIAL:
        unit[:] = unit[0]
    report, other = (
        uc.identifiability(
            learn(POLICIES[name], "partly known", 1e-3, X, U, p.groups, p.known),
            X,
            U,
            groups=p.groups,
            projections=p.known,
        )
        for X, U in ((p.X, p.U), ((p.X + shift) * unit, p.U * of_actions))
    )
    at, there = p.test, (p.test + shift) * unit
    np.testing.assert_allclose(other.spectrum, report.spectrum, atol=1e-5)
    assert other.determined_share == report.determined_share
    assert other.bound == pytest.approx(report.bound * of_actions**2, rel=1e-3)
    assert_same(other.covariance(there), report.covariance(at) * of_actions**2, rtol=2e-3)
    assert_same(other.unseen_directions(there).shares, report.unseen_directions(at).shares)
    for a, b in zip(other.worst_regions(), report.worst_regions(), strict=True):
        assert_same(a.state / unit - shift, b.state, rtol=1e-5)
        assert_same(a.direction, b.direction, rtol=1e-5)
        assert a.deviation == pytest.approx(b.deviation * of_actions, rel=1e-3)
    for a, b in zip(other.next_recordings(2), report.next_recordings(2), strict=True):
        assert_same(a.state / unit - shift, b.state, rtol=1e-5)
        assert a.gain == pytest.approx(b.gain, rel=1e-3)
    for a, b in zip(other.contributions(), report.contributions(), strict=True):
        assert a.episode == b.episode
        assert a.directions == pytest.approx(b.directions, rel=1e-3)
