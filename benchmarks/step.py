"""How long one step of a control loop takes: one state in, one action out.

The yardstick is scikit-learn's `Ridge.predict` on one sample of the same dimensions, which is as simple as a policy
gets and pays for scikit-learn's checks. ONNX Runtime runs on buffers bound beforehand, on one thread, as a loop would.
"""

import tempfile
from collections.abc import Callable
from pathlib import Path
from timeit import Timer

import numpy as np
from sklearn.linear_model import Ridge

import unconstrain as uc
from benchmarks.ratio import Ratio, medians

CALLS, CALLS_AGAINST = 2000, 200


def step_linear() -> Ratio:
    """The linear policy in 7 dimensions."""
    return _ratio("step-linear", *_linear(), 0.04, _compiled)


def step_rbf() -> Ratio:
    """36 RBFs in the plane."""
    return _ratio("step-rbf", *_rbf(), 0.1, _compiled)


def step_local() -> Ratio:
    """50 local models in 7 dimensions."""
    return _ratio("step-local", *_local(), 0.15, _compiled)


def step_stable() -> Ratio:
    """50 local models in 7 dimensions, made to end at a goal."""
    return _ratio("step-stable", *_local(), 0.3, _stable)


def step_onnx_linear() -> Ratio:
    """The linear policy in ONNX Runtime."""
    return _ratio("step-onnx-linear", *_linear(), 0.04, _onnx)


def step_onnx_rbf() -> Ratio:
    """36 RBFs in ONNX Runtime."""
    return _ratio("step-onnx-rbf", *_rbf(), 0.1, _onnx)


def step_onnx_local() -> Ratio:
    """50 local models in ONNX Runtime."""
    return _ratio("step-onnx-local", *_local(), 0.15, _onnx)


def _linear():
    return "linear, n=d=7", uc.ParametricPolicy(alpha=1e-6, risk="inconsistency"), 7


def _rbf():
    return (
        "36 RBFs, n=d=2",
        uc.ParametricPolicy(uc.NormalizedRBF(36, centers="grid"), alpha=1e-6, risk="inconsistency"),
        2,
    )


def _local():
    return "50 local models, n=d=7", uc.LocallyLinearPolicy(n_centers=50, alpha=1e-6, risk="inconsistency"), 7


KINDS = {"linear": _linear, "rbf": _rbf, "local": _local}
"""What is evaluated: its name, the policy, and the dimension of its states."""


def draw_samples(n: int) -> tuple[np.ndarray, np.ndarray]:
    X = np.random.default_rng(0).uniform(-1.5, 1.5, size=(5000, n))
    return X, -np.sign(X) * np.abs(X) ** 0.5


def _ratio(name: str, work: str, policy, n: int, reach: float, ready: Callable) -> Ratio:
    X, U = draw_samples(n)
    policy.fit(X, U)
    ridge, sample = Ridge().fit(X, U), X[:1].copy()
    step, against = Timer(ready(policy, X[0].copy())), Timer(lambda: ridge.predict(sample))
    ours, theirs = medians(lambda: step.timeit(CALLS), lambda: against.timeit(CALLS_AGAINST), repeats=15)
    ours, theirs = ours / CALLS, theirs / CALLS_AGAINST
    return Ratio(
        name, f"{work}, one state", "Ridge.predict on one sample", ours / theirs, reach, ours, theirs
    )


def _compiled(policy, x: np.ndarray) -> Callable[[], object]:
    step = policy.compile()
    return lambda: step(x)


def _stable(policy, x: np.ndarray) -> Callable[[], object]:
    return _compiled(policy.stabilized(np.zeros(len(x))), x)


def _onnx(policy, x: np.ndarray) -> Callable[[], object]:
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "policy.onnx"
        policy.to_onnx(path)
        session = onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])
    u = onnxruntime.OrtValue.ortvalue_from_numpy(np.zeros((1, policy.n_actions_)))
    binding = session.io_binding()
    binding.bind_ortvalue_input("x", onnxruntime.OrtValue.ortvalue_from_numpy(x[None]))
    binding.bind_ortvalue_output("u", u)
    session.run_with_iobinding(binding)
    np.testing.assert_allclose(u.numpy(), policy.predict(x[None]), atol=1e-9)
    return lambda: session.run_with_iobinding(binding)


BENCHMARKS: dict[str, Callable[[], Ratio]] = {
    "step-linear": step_linear,
    "step-rbf": step_rbf,
    "step-local": step_local,
    "step-stable": step_stable,
    "step-onnx-linear": step_onnx_linear,
    "step-onnx-rbf": step_onnx_rbf,
    "step-onnx-local": step_onnx_local,
}
