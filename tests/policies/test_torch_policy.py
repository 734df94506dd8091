"""Networks as estimators: what they learn, how they go on, and what else may be asked of them."""

import warnings
from functools import partialmethod

import numpy as np
import pytest
from sklearn.base import clone
from sklearn.utils.estimator_checks import parametrize_with_checks

import unconstrain as uc
from unconstrain import limit_cycle as toy
from unconstrain.recordings import Recordings

torch = pytest.importorskip("torch")

QUICK = {"hidden": (32,), "max_epochs": 6, "patience": 2, "random_state": 0}


@pytest.fixture(autouse=True)
def one_thread():
    torch.set_num_threads(1)


class Own(torch.nn.Module):
    """A network of a user's own."""

    def __init__(self, n, d):
        super().__init__()
        self.inner, self.outer = torch.nn.Linear(n, 16), torch.nn.Linear(16, d)

    def forward(self, states):
        return self.outer(torch.tanh(self.inner(states)))


def linear(N=600, noise=0.0, free=0.0, seed=0, d=2):
    """States, actions, labels and projections of a linear policy, each episode under a constraint or none."""
    rng = np.random.default_rng(seed)
    X = rng.normal(size=(N, d))
    Pi = X @ (rng.normal(size=(d, d)) * 0.4 - np.eye(d)).T
    episodes = np.arange(N) // 20
    rows = rng.normal(size=(N // 20, 1, d)) * (rng.random((N // 20, 1, 1)) >= free)
    P = uc.constraints.projection(rows)[episodes]
    U = np.einsum("nij,nj->ni", P, Pi) + noise * rng.normal(size=Pi.shape)
    return X, U, Pi, episodes, P


def error(Pi, P):
    return uc.metrics.normalized(uc.metrics.unconstrained_policy_error(Pi, P), Pi)


@parametrize_with_checks(
    [uc.TorchPolicy(hidden=(16,), max_epochs=40, patience=8, random_state=0, risk="direct")],
    expected_failed_checks=lambda estimator: {
        "check_sample_weight_equivalence_on_dense_data": "descent on repeated samples takes other steps"
    },
)
def test_scikit_learn_estimator_checks(estimator, check):
    check(estimator)


def test_contact_and_noise_are_inferred_and_a_policy_learnt_that_is_as_good_as_told():
    X, U, Pi, episodes, P = linear(2000, noise=0.05, free=0.4)
    options = {**QUICK, "max_epochs": 40, "patience": 4}
    policy = uc.TorchPolicy(**options).fit(X, U, groups=episodes)
    told = clone(policy).set_params(risk="inconsistency").fit(X, U, groups=episodes, projections=P)
    direct = policy.ordinary_regression()
    found = error(Pi, policy.predict(X))
    assert found < 2 * error(Pi, told.predict(X)) + 1e-4
    assert found < 0.05 * error(Pi, direct.predict(X))
    assert policy.noise_ == pytest.approx(0.05, rel=0.2)
    free = np.einsum("nii->n", P) > 1.5
    assert np.mean((policy.free_probability(X, U, groups=episodes) > 0.5) == free) > 0.97
    assert policy.free_share_ == pytest.approx(free.mean(), abs=0.05)
    assert next(iter(policy.log_likelihoods_)) != "all free"
    assert {"run", "noise", "log_likelihood", "free_share"} <= set(policy.history_[0])
    assert policy.score(X, U, groups=episodes) > 0.9


def test_where_nothing_is_in_the_way_it_is_ordinary_regression_by_the_network_or_by_its_linear_part():
    X, U, _, episodes, _ = linear(600, free=1.0)
    options = {**QUICK, "max_epochs": 30}
    policy = uc.TorchPolicy(**options).fit(X, U, groups=episodes)
    assert next(iter(policy.log_likelihoods_)) == "all free"
    assert policy.free_share_ == pytest.approx(1.0)
    linear_too = uc.ParametricPolicy().fit(X, U, groups=episodes)
    np.testing.assert_allclose(policy.predict(X), linear_too.predict(X), atol=1e-9)
    bent = U + np.sin(3 * X) + 0.1 * np.random.default_rng(1).normal(size=U.shape)
    policy = uc.TorchPolicy(**options).fit(X, bent, groups=episodes)
    assert next(iter(policy.log_likelihoods_)) == "all free"
    np.testing.assert_array_equal(policy.predict(X), policy.ordinary_regression().predict(X))


def test_projections_that_are_known_are_used():
    X, U, Pi, episodes, P = linear(1000)
    known = P.copy()
    known[::2] = np.nan
    options = {**QUICK, "max_epochs": 30, "risk": "inconsistency"}
    told = uc.TorchPolicy(**options).fit(X, U, groups=episodes, projections=P)
    assert error(Pi, told.predict(X)) < 1e-3
    assert uc.TorchPolicy(**QUICK).fit(X, U, groups=episodes, projections=known).n_known_constraints_ == 500
    with pytest.raises(uc.errors.PolicyError, match="projections= are for the other risks"):
        uc.TorchPolicy(risk="direct").fit(X, U, projections=P)


def test_what_is_saved_compiled_or_written_as_onnx_says_the_same(tmp_path):
    X, U, _, episodes, _ = linear(300)
    policy = uc.TorchPolicy(**{**QUICK, "hidden": (16, 8)}, n_ensemble=2).fit(X, U, groups=episodes)
    said = policy.predict(X)
    policy.save(tmp_path / "net.skops")
    loaded = uc.load_policy(tmp_path / "net.skops")
    np.testing.assert_array_equal(loaded.predict(X), said)
    np.testing.assert_array_equal(
        loaded.free_probability(X, U, groups=episodes), policy.free_probability(X, U, groups=episodes)
    )
    step = policy.compile()
    np.testing.assert_allclose(step(X), said, atol=1e-12)
    np.testing.assert_allclose(step(X[0]), said[0], atol=1e-12)
    step.save(tmp_path / "step.npz")
    np.testing.assert_array_equal(uc.load_compiled(tmp_path / "step.npz")(X), step(X))
    policy.to_onnx(tmp_path / "net.onnx")
    session = pytest.importorskip("onnxruntime").InferenceSession(tmp_path / "net.onnx")
    np.testing.assert_allclose(session.run(None, {"x": X})[0], said, atol=1e-12)
    _, spread = policy.predict(X, return_std=True)
    assert (spread > 0).all()
    assert (loaded.rollout(X[0], steps=5, beyond=np.inf).states.shape) == (6, 2)


def test_a_network_of_ones_own_is_made_by_what_is_trusted(tmp_path):
    X, U, Pi, episodes, P = linear(600)
    options = {**QUICK, "risk": "inconsistency", "max_epochs": 40, "patience": 6}
    policy = uc.TorchPolicy(Own, **options).fit(X, U, groups=episodes, projections=P)
    assert error(Pi, policy.predict(X)) < 0.05
    policy.save(tmp_path / "own.skops")
    with pytest.raises(uc.errors.ArchiveError, match=r"trusted=\[Own\]"):
        uc.load_policy(tmp_path / "own.skops")
    loaded = uc.load_policy(tmp_path / "own.skops", trusted=[Own])
    np.testing.assert_array_equal(loaded.predict(X), policy.predict(X))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        policy.to_onnx(tmp_path / "own.onnx")
    session = pytest.importorskip("onnxruntime").InferenceSession(tmp_path / "own.onnx")
    written = session.run(None, {"x": X.astype(np.float32)})[0]
    np.testing.assert_allclose(written, policy.predict(X), atol=1e-5)
    with pytest.raises(uc.errors.PolicyError, match="to_onnx"):
        policy.compile()
    given = uc.TorchPolicy(Own(2, 2), **{**options, "max_epochs": 1}).fit(X, U)
    with pytest.raises(uc.errors.UnconstrainError, match="give the class, or a function"):
        given.save(tmp_path / "given.skops")


def test_a_fit_that_was_interrupted_ends_the_same(tmp_path):
    X, U, _, episodes, _ = linear(200, free=0.5)
    path = tmp_path / "fit.checkpoint"

    class Interrupted(Exception):
        pass

    def stop(epochs, total):
        if epochs > 20:
            raise Interrupted

    policy = uc.TorchPolicy(**QUICK)
    with pytest.raises(Interrupted):
        policy.fit(X, U, groups=episodes, checkpoint=path, progress=stop)
    assert not hasattr(policy, "solution_")
    seen = []
    policy.fit(X, U, groups=episodes, checkpoint=path, progress=lambda done, total: seen.append(done))
    whole = uc.TorchPolicy(**QUICK)
    total = []
    whole.fit(X, U, groups=episodes, progress=lambda done, total_: total.append(done))
    np.testing.assert_array_equal(policy.predict(X), whole.predict(X))
    assert len(seen) < len(total)
    with pytest.raises(uc.errors.ArchiveError, match="other data"):
        policy.fit(X, 2 * U, groups=episodes, checkpoint=path)
    with pytest.raises(uc.errors.PolicyError, match="random_state"):
        uc.TorchPolicy().fit(X, U, checkpoint=path)


def test_recordings_are_read_block_by_block(tmp_path, monkeypatch):
    demos = toy.demonstrate(10, free=0.5, random_state=0)
    table = np.column_stack([demos.episodes, demos.states, demos.actions])
    np.savetxt(tmp_path / "all.csv", table, delimiter=",", header="episode,x,y,u,v", comments="")
    opened = uc.open(tmp_path / "all.csv", state=["x", "y"], action=["u", "v"], episode="episode")
    assert isinstance(opened, Recordings)
    policy = uc.TorchPolicy(**QUICK).fit(opened)
    assert policy.n_samples_seen_ == len(demos.states)
    memory = uc.TorchPolicy(**QUICK).fit(opened.load())
    with monkeypatch.context() as patched:
        patched.setattr(Recordings, "blocks", partialmethod(Recordings.blocks, 100))
        pieces = uc.TorchPolicy(**QUICK).fit(opened)
    assert pieces.n_samples_seen_ == len(demos.states)
    np.testing.assert_allclose(pieces.model_.center, policy.model_.center)
    np.testing.assert_allclose(pieces.model_.unit, policy.model_.unit)
    assert error(demos.policy, pieces.predict(demos.states)) < 1
    # Passes of a stream descend once, those of samples in memory twice; the regression is the same.
    one, other = policy.ordinary_regression(), memory.ordinary_regression()
    np.testing.assert_allclose(one.predict(demos.states), other.predict(demos.states), atol=1e-5)
    with pytest.raises(uc.errors.DataError, match="give them alone"):
        policy.fit(opened, demos.actions)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"hidden": ()}, "hidden must be the units"),
        ({"n_ensemble": 0}, "n_ensemble"),
        ({"risk": "corrected"}, "risk"),
        ({"device": "abacus"}, "device must be"),
        ({"module": 3}, "module must be a torch"),
        ({"module": lambda n, d: None}, "module made NoneType"),
        ({"module": lambda n, d: torch.nn.Linear(n, d + 1)}, "the network must return actions"),
    ],
)
def test_mistakes_are_one_sentence(options, sentence):
    X, U, *_ = linear(40)
    with pytest.raises(uc.errors.UnconstrainError, match=sentence):
        uc.TorchPolicy(**{**QUICK, "max_epochs": 1, **options}).fit(X, U)


def test_one_network_does_not_say_how_sure_it_is():
    X, U, *_ = linear(40)
    policy = uc.TorchPolicy(**{**QUICK, "risk": "direct"}).fit(X, U)
    with pytest.raises(uc.errors.PolicyError, match="n_ensemble=5"):
        policy.predict(X, return_std=True)
