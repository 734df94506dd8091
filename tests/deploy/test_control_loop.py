"""The C++ control loop of the gallery acts as `predict` does, by onnxruntime's C API and by arrays alone."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import unconstrain as uc

pytest.importorskip("onnx")
onnxruntime = pytest.importorskip("onnxruntime")

CPP = Path(__file__).parents[2] / "examples" / "cpp"
COMPILER = shutil.which("g++") or shutil.which("clang++")
LIBRARIES = list(Path(onnxruntime.__file__).parent.glob("capi/libonnxruntime.so.*"))


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    if COMPILER is None or not LIBRARIES:
        pytest.skip("needs a C++ compiler, and onnxruntime's shared library")
    folder = tmp_path_factory.mktemp("cpp")
    (folder / "libonnxruntime.so.1").symlink_to(LIBRARIES[0])
    command = [COMPILER, "-O0", "-std=c++17", "-Wall", "-Wextra", "-Werror", "-idirafter", CPP / "subset"]
    command += [CPP / "control_loop.cpp", LIBRARIES[0], f"-Wl,-rpath,{folder}", "-o", folder / "control_loop"]
    subprocess.run(command, check=True)
    return folder / "control_loop"


def run(program, *arguments):
    return subprocess.run([program, *map(str, arguments)], capture_output=True, text=True)


def test_both_ways_act_as_predict_does(program, tmp_path):
    rng = np.random.default_rng(0)
    X = rng.uniform(-1.5, 1.5, size=(200, 3))
    policy = uc.LocallyLinearPolicy(n_centers=5, risk="direct").fit(X, -np.sin(X[:, :2]))
    step = policy.compile()
    policy.to_onnx(tmp_path / "policy.onnx")
    parts = [step.arrays[name].ravel() for name in ("centers", "width", "coef", "intercept")]
    np.concatenate([[5, 3, 2], *parts]).tofile(tmp_path / "policy.f64")
    states = np.concatenate([X, 30.0 * X[:5]])  # far from all centres, too
    states.tofile(tmp_path / "states.f64")
    for file in ("policy.onnx", "policy.f64"):
        files = tmp_path / "states.f64", 3, 2, tmp_path / "actions.f64", tmp_path / "times.f64"
        ran = run(program, tmp_path / file, *files)
        assert ran.returncode == 0, ran.stderr
        actions = np.fromfile(tmp_path / "actions.f64").reshape(-1, 2)
        expected = policy.predict(states)
        np.testing.assert_allclose(actions, expected, rtol=0, atol=1e-12 * np.abs(expected).max())
        assert len(np.fromfile(tmp_path / "times.f64")) == len(states)


@pytest.mark.parametrize("file", ["missing.onnx", "missing.f64"])
def test_a_missing_policy_is_one_sentence(program, file, tmp_path):
    np.zeros(3).tofile(tmp_path / "states.f64")
    ran = run(program, tmp_path / file, tmp_path / "states.f64", 3, 2, tmp_path / "a", tmp_path / "t")
    assert ran.returncode == 1
    assert file in ran.stderr
    assert ran.stderr.count("\n") == 1
    assert not (tmp_path / "a").exists()
