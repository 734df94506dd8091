import builtins

import numpy as np
import pytest

import unconstrain as uc

pytest.importorskip("onnx")
onnxruntime = pytest.importorskip("onnxruntime")

RNG = np.random.default_rng(0)
X = RNG.uniform(-1.5, 1.5, size=(400, 4))
U = -np.sign(X[:, :3]) * np.abs(X[:, :3]) ** 0.5
POLICIES = [
    uc.ParametricPolicy(),
    uc.ParametricPolicy(uc.NormalizedRBF(36)),
    uc.LocallyLinearPolicy(n_centers=30),
    uc.LocallyLinearPolicy(n_centers=1),
]


def run(path, states):
    session = onnxruntime.InferenceSession(path, providers=["CPUExecutionProvider"])
    return session.run(None, {"x": states})[0]


@pytest.mark.parametrize("policy", POLICIES)
@pytest.mark.parametrize("n_states", [1, 2, 400])
def test_the_runtime_agrees_with_predict_for_any_number_of_states(policy, n_states, tmp_path):
    policy.fit(X, U).to_onnx(tmp_path / "policy.onnx")
    actions = run(tmp_path / "policy.onnx", X[:n_states])
    expected = policy.predict(X[:n_states])
    assert actions.shape == expected.shape
    np.testing.assert_allclose(actions, expected, rtol=0, atol=1e-12 * max(1.0, np.abs(expected).max()))


@pytest.mark.parametrize("policy", POLICIES)
def test_finite_far_from_all_centres(policy, tmp_path):
    policy.fit(X, U).to_onnx(tmp_path / "policy.onnx")
    assert np.isfinite(run(tmp_path / "policy.onnx", 1e8 * X[:5])).all()


def test_scalar_actions_are_a_column(tmp_path):
    policy = uc.ParametricPolicy(uc.NormalizedRBF(9)).fit(X, U[:, 0])
    policy.to_onnx(tmp_path / "policy.onnx")
    np.testing.assert_allclose(run(tmp_path / "policy.onnx", X)[:, 0], policy.predict(X), atol=1e-12)


def test_other_policies_are_refused_in_one_sentence(tmp_path):
    policy = uc.ParametricPolicy(uc.DecoupledFeatures()).fit(X[:, :3], U)
    with pytest.raises(
        uc.errors.PolicyError, match=r"can be written as ONNX, this one is additive.*compile\(\)"
    ):
        policy.to_onnx(tmp_path / "policy.onnx")
    assert not list(tmp_path.iterdir())


def test_without_the_package_the_sentence_says_what_to_install(tmp_path, monkeypatch):
    policy, real = uc.ParametricPolicy().fit(X, U), builtins.__import__

    def missing(name, *args, **kwargs):
        if name == "onnx":
            raise ImportError(name)
        return real(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", missing)
    with pytest.raises(uc.errors.PolicyError, match=r"pip install 'unconstrain\[onnx\]'"):
        policy.to_onnx(tmp_path / "policy.onnx")
    assert not list(tmp_path.iterdir())
