"""Policies in files: they come back as they were, small, and say in one sentence what they cannot do."""

import numpy as np
import pytest
from sklearn.compose import make_column_transformer
from sklearn.decomposition import PCA
from sklearn.kernel_approximation import Nystroem, RBFSampler
from sklearn.pipeline import make_pipeline, make_union
from sklearn.preprocessing import (
    FunctionTransformer,
    KBinsDiscretizer,
    PolynomialFeatures,
    PowerTransformer,
    QuantileTransformer,
    SplineTransformer,
    StandardScaler,
)

import unconstrain as uc
from unconstrain import storage

RNG = np.random.default_rng(0)
X = RNG.uniform(0.5, 2.0, size=(300, 3))
U = np.sin(X) @ RNG.normal(size=(3, 3))
GROUPS = np.arange(300) // 25

POLICIES = {
    "linear": uc.ParametricPolicy(),
    "direct": uc.ParametricPolicy(risk="direct", alpha="cv"),
    "rbf": uc.ParametricPolicy(uc.NormalizedRBF(9), alpha="cv"),
    "decoupled": uc.ParametricPolicy(uc.DecoupledFeatures(5)),
    "potential": uc.ParametricPolicy(uc.PotentialFeatures(uc.NormalizedRBF(9))),
    "local": uc.LocallyLinearPolicy(n_centers=5, alpha="cv"),
    "seeded by a generator": uc.LocallyLinearPolicy(
        n_centers=5, centers="kmeans", random_state=np.random.RandomState(3)
    ),
    "splines": uc.ParametricPolicy(SplineTransformer()),
    "periodic splines": uc.ParametricPolicy(SplineTransformer(extrapolation="periodic")),
    "undefined at the origin": uc.ParametricPolicy(SplineTransformer(extrapolation="error")),
    "polynomials": uc.ParametricPolicy(PolynomialFeatures(3)),
    "random features": uc.ParametricPolicy(make_pipeline(StandardScaler(), RBFSampler(n_components=20))),
    "a union": uc.ParametricPolicy(make_union(PolynomialFeatures(1), Nystroem(n_components=10), n_jobs=1)),
    "bins": uc.ParametricPolicy(KBinsDiscretizer(4)),
    "columns": uc.ParametricPolicy(
        make_column_transformer((StandardScaler(), [0, 1]), (PolynomialFeatures(2), slice(2, 3)))
    ),
    "components": uc.ParametricPolicy(PCA(2)),
    "quantiles": uc.ParametricPolicy(QuantileTransformer(n_quantiles=20)),
    "powers": uc.ParametricPolicy(PowerTransformer()),
    "nothing": uc.ParametricPolicy(FunctionTransformer()),
}
for policy in POLICIES.values():
    policy.fit(X, U, groups=GROUPS)


@pytest.mark.parametrize("name", POLICIES)
def test_a_policy_comes_back_as_it_was(name, tmp_path):
    policy = POLICIES[name]
    policy.save(tmp_path / "policy.skops")
    loaded = uc.load_policy(tmp_path / "policy.skops")
    np.testing.assert_array_equal(loaded.predict(X), policy.predict(X))
    assert loaded.get_params().keys() == policy.get_params().keys()
    assert {*vars(policy)} - {*vars(loaded)} <= {"accumulator_"}


@pytest.mark.parametrize("name", POLICIES)
def test_a_resumable_policy_learns_on_as_the_saved_one(name, tmp_path):
    POLICIES[name].save(tmp_path / "policy.skops", resumable=True)
    policy, loaded = (uc.load_policy(tmp_path / "policy.skops") for _ in range(2))
    policy.accumulator_ = POLICIES[name].resume()
    for each in (policy, loaded):
        each.partial_fit(X[::2], -U[::2], groups=GROUPS[::2] + 100)
    np.testing.assert_allclose(loaded.predict(X), policy.predict(X), rtol=1e-9, atol=1e-12)
    deviations = [each.predict(X, return_std=True)[1] for each in (policy, loaded)]
    np.testing.assert_allclose(*deviations, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize(
    "ask",
    [
        lambda policy: policy.partial_fit(X, U, groups=GROUPS),
        lambda policy: policy.predict(X, return_std=True),
        lambda policy: policy.predict(X, return_cov=True),
        lambda policy: policy.posterior(),
        lambda policy: policy.solved(),
        lambda policy: policy.moments_,
        lambda policy: uc.identifiability(policy),
        lambda policy: uc.fit_stream(policy, [(X, U, GROUPS)], partial=True),
    ],
)
@pytest.mark.parametrize("name", ["local", "rbf"])
def test_without_its_moments_a_policy_says_how_to_keep_them(ask, name, tmp_path):
    POLICIES[name].save(tmp_path / "policy.skops")
    loaded = uc.load_policy(tmp_path / "policy.skops")
    with pytest.raises(
        uc.errors.PolicyError, match=r"saved without the sums.*resumable=True|give the recordings"
    ):
        ask(loaded)
    assert isinstance(loaded.fit(X, -U, groups=GROUPS).moments_, list)


def test_fifty_models_of_26_states_take_less_than_ten_megabytes(tmp_path):
    rng = np.random.default_rng(0)
    states = rng.normal(size=(400, 26))
    policy = uc.LocallyLinearPolicy(n_centers=50, alpha=1e-3, risk="inconsistency").fit(
        states, np.tanh(states)
    )
    policy.save(tmp_path / "policy.skops")
    assert (tmp_path / "policy.skops").stat().st_size < 10 * 2**20
    policy.save(tmp_path / "policy.skops", resumable=True)
    P = 26 * 27
    packed = 50 * (P * (P + 1) // 2 + P) * 8
    assert (tmp_path / "policy.skops").stat().st_size < 1.01 * packed + 10 * 2**20


class Doubled(FunctionTransformer):
    """A transformer of the user's own."""


def lifted(states):
    return np.column_stack([states, np.tanh(states)])


def test_what_is_the_users_own_has_to_be_given_again(tmp_path):
    path = tmp_path / "own.skops"
    policy = uc.ParametricPolicy(make_pipeline(Doubled(), FunctionTransformer(lifted))).fit(X, U)
    policy.save(path)
    with pytest.raises(uc.errors.ArchiveError, match=r"load_policy\(path, trusted=\[") as caught:
        uc.load_policy(path)
    for name in (f"{__name__}.Doubled", f"{__name__}.lifted"):
        assert name in str(caught.value)
    with pytest.raises(uc.errors.ArchiveError, match=r"trusted=\[lifted\]"):
        uc.load_policy(path, trusted=[Doubled])
    loaded = uc.load_policy(path, trusted=[Doubled, lifted, np.sin])
    np.testing.assert_array_equal(loaded.predict(X), policy.predict(X))
    with pytest.raises(uc.errors.UnconstrainError, match="import what it names and load it"):
        uc.load_policy(path, trusted=["tests.Doubled"])


def test_a_function_of_numpys_has_to_be_given_again(tmp_path):
    policy = uc.ParametricPolicy(FunctionTransformer(np.tanh)).fit(X, U)
    policy.save(tmp_path / "tanh.skops")
    with pytest.raises(uc.errors.ArchiveError, match=r"numpy\.tanh.*trusted=\[tanh\]"):
        uc.load_policy(tmp_path / "tanh.skops")
    loaded = uc.load_policy(tmp_path / "tanh.skops", trusted=[np.tanh])
    np.testing.assert_array_equal(loaded.predict(X), policy.predict(X))


def test_a_function_of_a_script_is_known_again_where_it_is_imported(tmp_path, monkeypatch):
    monkeypatch.setattr(lifted, "__module__", "__main__")
    uc.ParametricPolicy(FunctionTransformer(lifted)).fit(X, U).save(tmp_path / "own.skops")
    monkeypatch.setattr(lifted, "__module__", "my_script")
    assert uc.load_policy(tmp_path / "own.skops", trusted=[lifted]).features.func is lifted


def test_a_lambda_cannot_be_saved_and_leaves_no_file(tmp_path):
    policy = uc.ParametricPolicy(FunctionTransformer(lambda states: states)).fit(X, U)
    with pytest.raises(uc.errors.UnconstrainError, match=r"cannot save features\.func: a lambda"):
        policy.save(tmp_path / "own.skops")
    assert not list(tmp_path.iterdir())


def test_a_file_does_not_say_on_how_many_processors_it_is_computed(tmp_path):
    union = make_union(PolynomialFeatures(1), PolynomialFeatures(2), n_jobs=2)
    uc.ParametricPolicy(union, risk="direct").fit(X, U).save(tmp_path / "p.skops")
    assert uc.load_policy(tmp_path / "p.skops").features.n_jobs is None


def test_every_kind_of_file_says_what_it_is_where_another_is_wanted(tmp_path):
    path = tmp_path / "wipe.skops"
    uc.ConstantConstraint().fit(X, U * [1.0, 1.0, 0.0]).save(path)
    with pytest.raises(
        uc.errors.ArchiveError,
        match=r"wipe.skops holds a constraint, not a policy: load it with load_constraint$",
    ):
        uc.load_policy(path)
    assert storage.kind_of(path) is storage.Kind.CONSTRAINT


def test_the_same_policy_gives_the_same_bytes(tmp_path):
    for name in ("a", "b"):
        POLICIES["local"].save(tmp_path / name)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_an_interrupted_save_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "policy.skops"
    POLICIES["rbf"].save(path)
    before = path.read_bytes()

    def interrupted(*args, **kwargs):
        raise KeyboardInterrupt

    monkeypatch.setattr("numpy.lib.format.write_array", interrupted)
    with pytest.raises(KeyboardInterrupt):
        POLICIES["rbf"].save(path)
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == [path.name]
