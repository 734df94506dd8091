import copy
import json
import pickle
import sys
import threading
import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.base import BaseEstimator, TransformerMixin
from sklearn.preprocessing import PolynomialFeatures, SplineTransformer

import unconstrain as uc
from unconstrain import storage
from unconstrain.deploy.compiled import Linear
from unconstrain.deploy.compiled.loading import KINDS

RNG = np.random.default_rng(0)
X = RNG.uniform(-1.5, 1.5, size=(400, 3))
U = -np.sign(X) * np.abs(X) ** 0.5 + 0.3 * np.sin(X[:, ::-1])

POLICIES = {
    "linear": uc.ParametricPolicy(),
    "rbf": uc.ParametricPolicy(uc.NormalizedRBF(36)),
    "local": uc.LocallyLinearPolicy(n_centers=20),
    "decoupled": uc.ParametricPolicy(uc.DecoupledFeatures()),
    "decoupled, flat outside": uc.ParametricPolicy(
        uc.DecoupledFeatures(5, degree=2, extrapolation="constant")
    ),
    "decoupled, on outside": uc.ParametricPolicy(uc.DecoupledFeatures(5, degree=1, extrapolation="continue")),
    "splines": uc.ParametricPolicy(SplineTransformer(extrapolation="linear")),
    "splines at quantiles": uc.ParametricPolicy(SplineTransformer(knots="quantile", include_bias=False)),
    "steps": uc.ParametricPolicy(SplineTransformer(degree=0, extrapolation="continue")),
    "potential": uc.ParametricPolicy(uc.PotentialFeatures(uc.NormalizedRBF(30))),
    "additive potential": uc.ParametricPolicy(
        uc.PotentialFeatures(SplineTransformer(extrapolation="linear"))
    ),
    "flat potential": uc.ParametricPolicy(
        uc.PotentialFeatures(SplineTransformer(degree=2, include_bias=False))
    ),
    "steep potential": uc.ParametricPolicy(uc.PotentialFeatures(SplineTransformer(extrapolation="continue"))),
}
for policy in POLICIES.values():
    policy.fit(X, U)
STEPS = {name: policy.compile() for name, policy in POLICIES.items()}
each = pytest.mark.parametrize("name", POLICIES)


def assert_agrees(step, x, expected):
    tolerance = 1e-12 * max(step.magnitude(np.atleast_2d(x)), np.abs(expected).max())
    np.testing.assert_allclose(step(x), expected, rtol=0, atol=tolerance)


@each
@settings(deadline=None, max_examples=15)
@given(seed=st.integers(0, 2**32 - 1), spread=st.floats(0.0, 3.0))
def test_agrees_with_predict_one_by_one_and_as_a_batch(name, seed, spread):
    states = np.random.default_rng(seed).normal(scale=spread, size=(20, 3))
    expected = POLICIES[name].predict(states)
    assert_agrees(STEPS[name], states, expected)
    for x, u in zip(states, expected, strict=True):
        assert_agrees(STEPS[name], x, u)


@each
def test_agrees_on_the_training_states_the_ends_of_the_range_among_them(name):
    expected = POLICIES[name].predict(X)
    assert_agrees(STEPS[name], X, expected)
    for x, u in zip(X, expected, strict=True):
        assert_agrees(STEPS[name], x, u)


@each
@pytest.mark.parametrize("distance", [1e2, 1e4, 1e8, 1e20, 1e50])
def test_stays_finite_however_far_a_state_is(name, distance):
    far = distance * np.array([1.0, -0.5, 0.2])
    if "outside" in name or name == "steep potential":
        return  # splines told to go on as polynomials do so
    assert np.isfinite(STEPS[name](far)).all()
    assert np.isfinite(STEPS[name](far[None])).all()
    assert_agrees(STEPS[name], far, POLICIES[name].predict(far[None])[0])
    assert_agrees(STEPS[name], far[None], POLICIES[name].predict(far[None]))


def test_where_every_activation_underflows_the_nearest_centre_decides():
    policy = uc.ParametricPolicy(uc.NormalizedRBF(centers=np.array([[-1.0], [1.0]]), width=0.01), alpha=0.0)
    states = np.array([[-1.1], [-1.0], [1.0], [1.2]])
    step = policy.fit(states, np.array([[-5.0], [-5.0], [7.0], [7.0]])).compile()
    for x in (-1e9, -1e100, -50.0, 50.0, 1e100):
        assert step(np.array([x]))[0] == pytest.approx(7.0 if x > 0 else -5.0)


@each
def test_takes_lists_integers_and_strided_states_and_writes_where_told(name):
    step, x = STEPS[name], X[3]
    expected = step(x)
    np.testing.assert_array_equal(step(list(x)), expected)
    np.testing.assert_array_equal(step(np.repeat(x, 2)[::2]), expected)
    np.testing.assert_array_equal(step([1, 0, -1]), step(np.array([1, 0, -1])))
    np.testing.assert_allclose(
        step(x.astype(np.float32)), step(x.astype(np.float32).astype(float)), atol=1e-5
    )
    out = np.empty(3)
    assert step(x, out) is out
    np.testing.assert_array_equal(out, expected)
    batch = np.empty((400, 3))
    assert step(X, out=batch) is batch
    np.testing.assert_array_equal(batch, step(X))


@each
def test_an_action_once_given_does_not_change_with_the_next_call(name):
    first = STEPS[name](X[0])
    kept = first.copy()
    STEPS[name](X[1])
    np.testing.assert_array_equal(first, kept)


@each
def test_threads_do_not_disturb_each_other(name):
    step, wrong = STEPS[name], []
    expected = [step(x) for x in X[:8]]

    def run(i):
        for _ in range(300):
            if not np.array_equal(step(X[i]), expected[i]):
                wrong.append(i)

    threads = [threading.Thread(target=run, args=(i,)) for i in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong


@each
def test_saved_pickled_and_copied_it_is_the_same(name, tmp_path):
    step = STEPS[name]
    step.save(tmp_path / "step.npz")
    for other in (
        uc.load_compiled(tmp_path / "step.npz"),
        pickle.loads(pickle.dumps(step)),
        copy.deepcopy(step),
    ):
        assert type(other) is type(step)
        for x in X[:10]:
            np.testing.assert_array_equal(other(x), step(x))


@each
def test_the_file_is_what_the_documentation_says(name, tmp_path):
    STEPS[name].save(tmp_path / "step")  # whatever its suffix
    with np.load(tmp_path / "step", allow_pickle=False) as archive:
        about = json.loads(archive["unconstrain.json"])
        kind = about["tree"]["kind"]
        assert about == {
            "kind": "compiled policy", "layout": 1, "release": uc.__version__, "arrays": list(KINDS[kind].layout),
            "tree": {"kind": STEPS[name].kind},
        }  # fmt: skip
        assert set(archive.files) == {"unconstrain.json", *KINDS[kind].layout}
        assert all(archive[each].dtype == np.float64 for each in KINDS[kind].layout)


def by_the_documentation(kind, a, x):
    """docs/compiled.md, word for word."""
    if kind == "linear":
        return a["coef"] @ x + a["intercept"]
    if kind == "additive":
        pieces = [np.count_nonzero(breaks <= xj) for breaks, xj in zip(a["breaks"], x, strict=True)]
        order = a["polynomials"].shape[2]
        return sum(
            a["polynomials"][j, k, q] * (x[j] - a["origins"][j, k]) ** q
            for j, k in enumerate(pieces)
            for q in range(order)
        )
    K = np.exp(-np.sum(((x - a["centers"]) / a["width"]) ** 2, axis=1) / 2)
    b = K / K.sum()
    if kind == "rbf":
        return a["weights"] @ b
    if kind == "local":
        return sum(b[m] * (a["coef"][m] @ x + a["intercept"][m]) for m in range(len(b)))
    w, c = a["weights"], a["centers"]
    return ((w @ b) * (b @ c) - (w * b) @ c) / a["width"] ** 2


@each
def test_the_arrays_mean_what_the_documentation_says(name):
    for x in X[:20]:
        expected = by_the_documentation(STEPS[name].kind, STEPS[name].arrays, x)
        assert_agrees(STEPS[name], x, expected)


@each
def test_does_not_change(name):
    step = STEPS[name]
    for array in step.arrays.values():
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0
    with pytest.raises(AttributeError, match="does not change"):
        step.n_states = 4
    with pytest.raises(AttributeError, match="does not change"):
        del step.arrays


def test_of_a_policy_that_learns_on_it_stays_as_it_was():
    policy = uc.ParametricPolicy(uc.NormalizedRBF(9)).fit(X, U)
    step = policy.compile()
    before = step(X)
    policy.partial_fit(X, -U)
    np.testing.assert_array_equal(step(X), before)


class Turning(BaseEstimator):
    """Features of one's own, `π(x) = w (x_2, -x_1)`."""

    def fit(self, X, d):
        self.n_parameters_ = 1
        return self

    def along(self, X, directions):
        return (directions[:, :1] * X[:, 1:2] - directions[:, 1:2] * X[:, :1]).reshape(-1, 1)

    def evaluate(self, X, w):
        return w * np.column_stack([X[:, 1], -X[:, 0]])

    def compile(self, w):
        return Linear(coef=float(w[0]) * np.array([[0.0, 1.0], [-1.0, 0.0]]), intercept=np.zeros(2))


class Waves(TransformerMixin, BaseEstimator):
    """A transformer of one's own, with what potentials and control loops ask for."""

    def fit(self, X, y=None):
        self.n_features_in_ = X.shape[1]
        return self

    def transform(self, X):
        return np.sin(X)

    def slopes(self, X, directions):
        return np.cos(X) * directions

    def gradient(self, X, w):
        return np.cos(X) * w

    def compile(self, W):
        return Linear(coef=W, intercept=np.zeros(len(W)))

    def compile_descent(self, w):
        return Linear(coef=np.zeros((len(w), len(w))), intercept=-w)


def test_features_of_ones_own_are_compiled_by_their_method():
    policy = uc.ParametricPolicy(Turning()).fit(X[:, :2], X[:, 1::-1] * [0.5, -0.5])
    np.testing.assert_allclose(policy.compile()(X[0, :2]), policy.predict(X[:1, :2])[0], atol=1e-12)
    with pytest.raises(uc.errors.PolicyError, match="cannot be compiled"):
        uc.ParametricPolicy(type("Mute", (Turning,), {"compile": None})()).fit(X[:, :2], X[:, :2]).compile()


def test_transformers_of_ones_own_are_compiled_and_differentiated_by_their_methods():
    smooth = uc.ParametricPolicy(uc.PotentialFeatures(Waves())).fit(X, -np.cos(X) * [1.0, 2.0, 3.0])
    np.testing.assert_allclose(smooth.predict(X), -np.cos(X) * [1.0, 2.0, 3.0], atol=1e-6)
    for features in (Waves(), uc.PotentialFeatures(Waves())):  # which claim to be linear, and are found out
        with pytest.raises(uc.errors.PolicyError, match="from predict"):
            uc.ParametricPolicy(features).fit(X, U).compile()


def test_scalar_actions_keep_their_dimension():
    step = uc.ParametricPolicy().fit(X, U[:, 0]).compile()
    assert step(X[0]).shape == (1,)
    assert step(X).shape == (400, 1)


def test_compilation_notices_where_the_two_differ():
    wrong = Linear(coef=np.zeros((3, 3)), intercept=np.ones(3))
    with pytest.raises(uc.errors.PolicyError, match="from predict"):
        wrong.check_agreement(POLICIES["linear"].predict)


def written(tmp_path, tree, **changes):
    path = tmp_path / "step.npz"
    arrays = {"coef": np.eye(3), "intercept": np.zeros(3)} | changes
    kept = {name: array for name, array in arrays.items() if array is not None}
    storage.write(path, storage.Kind.COMPILED_POLICY, tree, kept)
    return path


LINEAR = {"kind": "linear"}


@pytest.mark.parametrize(
    ("tree", "changes", "sentence"),
    [
        (None, {}, "damaged"),
        ({}, {}, "damaged"),
        ({"kind": "neural"}, {}, "damaged"),
        ({"kind": ["linear"]}, {}, "damaged"),
        (LINEAR, {"coef": np.full((3, 3), np.nan)}, "damaged"),
        (LINEAR, {"coef": np.array([["a"]])}, "damaged"),
        (LINEAR, {"intercept": np.zeros(2)}, r"damaged \(intercept .* must have shape \(3,\)"),
        (LINEAR, {"intercept": None}, "damaged"),
        (LINEAR, {"self": np.zeros(2)}, "damaged"),
    ],
)
def test_files_that_are_not_right_are_told_in_one_sentence(tree, changes, sentence, tmp_path):
    with pytest.raises(uc.errors.ArchiveError, match=sentence) as caught:
        uc.load_compiled(written(tmp_path, tree, **changes))
    assert "\n" not in str(caught.value)


def test_files_cut_or_foreign_or_missing(tmp_path):
    path = written(tmp_path, LINEAR)
    path.write_bytes(path.read_bytes()[:300])
    with pytest.raises(uc.errors.ArchiveError, match="damaged"):
        uc.load_compiled(path)
    (tmp_path / "notes.txt").write_text("hello")
    with pytest.raises(uc.errors.ArchiveError, match="holds no compiled policy saved by unconstrain"):
        uc.load_compiled(tmp_path / "notes.txt")
    POLICIES["linear"].save(tmp_path / "policy.skops")
    with pytest.raises(
        uc.errors.ArchiveError, match="holds a policy, not a compiled policy: load it with load_policy"
    ):
        uc.load_compiled(tmp_path / "policy.skops")
    with pytest.raises(uc.errors.ArchiveError, match="no such"):
        uc.load_compiled(tmp_path / "nothing.npz")


def fitted(features):
    return uc.ParametricPolicy(features).fit(X, U)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        *[
            (lambda step=step, x=x: step(x), r"takes states of 3 dimensions")
            for step in STEPS.values()
            for x in (np.ones(2), np.ones(1), np.ones((5, 4)), 1.0, np.ones((2, 2, 3)))
        ],
        *[
            (lambda step=step, out=out: step(X[0], out), "out must be a contiguous float64 array")
            for step in STEPS.values()
            for out in (np.empty(2), np.empty(3, dtype=int))
        ],
        (lambda: STEPS["rbf"](X, np.empty((3, 3))), "out must be"),
        (lambda: fitted(PolynomialFeatures(2)).compile(), r"one with PolynomialFeatures\(\) cannot"),
        (
            lambda: fitted(uc.PotentialFeatures(PolynomialFeatures(2))).compile(),
            r"one with PolynomialFeatures\(\) cannot",
        ),
        (
            lambda: fitted(SplineTransformer(extrapolation="periodic")).compile(),
            r"extrapolation='periodic'\) cannot",
        ),
        (lambda: fitted(SplineTransformer(degree=1, extrapolation="linear")).compile(), "degree 2 or more"),
        (lambda: Linear(coef=np.eye(2), intercept=np.zeros(3)), r"intercept .* must have shape \(2,\)"),
        (lambda: Linear(coef=[[np.inf]], intercept=[0.0]), "coef .* must be finite"),
    ],
)
def test_mistakes_are_told_in_one_sentence(call, sentence):
    with pytest.raises(uc.errors.PolicyError, match=sentence) as caught:
        call()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["linear", "rbf", "local"])
def test_a_step_allocates_nothing(name):
    step, x, out = STEPS[name], X[0].copy(), np.empty(3)

    def run():
        for _ in range(1000):
            step(x, out)

    run()
    blocks = sys.getallocatedblocks()
    run()
    assert sys.getallocatedblocks() - blocks < 10  # of a thousand steps
    tracemalloc.start()
    try:
        before = tracemalloc.get_traced_memory()[0]
        run()
        # Names and numbers of the one call that runs; a single array of any size, with what holds it, is more.
        assert tracemalloc.get_traced_memory()[1] - before < 1000
    finally:
        tracemalloc.stop()
