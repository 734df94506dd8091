"""
A control loop in C++
=====================

For people whose controller is written in C++: the policy that was learnt in Python acts there, by onnxruntime's C
API, or from its arrays with no library at all. Both give the actions that Python gives. The program is
``examples/cpp``; it needs a compiler, and for the first way the extra `onnx` and the package `onnxruntime`, which
brings the library.
"""

# %%
# A policy of 40 local models for seven joints.

import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import onnxruntime

import unconstrain as uc

rng = np.random.default_rng(0)
X = rng.uniform(-1.5, 1.5, size=(2000, 7))
N = uc.constraints.projection(rng.normal(size=(2000, 2, 7)))
U = np.einsum("nij,nj->ni", N, -np.sin(X))
policy = uc.LocallyLinearPolicy(n_centers=40).fit(X, U)

# %%
# Its two files: the ONNX graph, and the arrays of the compiled policy as plain doubles.

folder = Path(tempfile.mkdtemp())
step = policy.compile()
policy.to_onnx(folder / "policy.onnx")
sizes = [*step.arrays["coef"].shape[::2], step.n_actions]
parts = (step.arrays[name].ravel() for name in ("centers", "width", "coef", "intercept"))
np.concatenate([sizes, *parts]).tofile(folder / "policy.f64")
states = rng.uniform(-1.5, 1.5, size=(100_000, 7))
states.tofile(folder / "states.f64")

# %%
# The program is compiled against the library in the Python package. That has no headers; where none are installed,
# those few functions of the C API that the program calls are declared in ``cpp/subset``.

compiler = shutil.which("g++") or shutil.which("clang++")
if compiler is None:
    raise SystemExit("there is no C++ compiler here: install g++ or clang++")
sources = Path(sys.argv[0]).parent / "cpp"
(library,) = Path(onnxruntime.__file__).parent.glob("capi/libonnxruntime.so.*")
(folder / "libonnxruntime.so.1").symlink_to(library)  # the name that programs look for
command = [compiler, "-O3", "-std=c++17", "-Wall", "-Wextra", "-idirafter", sources / "subset"]
command += [sources / "control_loop.cpp", library, f"-Wl,-rpath,{folder}", "-o", folder / "control_loop"]
subprocess.run(command, check=True)


def follow(file):
    """Run the program; return its actions, and how long each step took in microseconds."""
    actions, times = folder / "actions.f64", folder / "times.f64"
    given = [folder / file, folder / "states.f64", 7, 7, actions, times]
    ran = subprocess.run([folder / "control_loop", *map(str, given)], capture_output=True, text=True)
    if ran.returncode:
        raise SystemExit(ran.stderr)
    print(ran.stdout, end="")
    return np.fromfile(actions).reshape(-1, 7), np.fromfile(times)


def time_python():
    """Run the compiled policy in Python."""
    actions, times = np.empty_like(states), np.empty(len(states))
    for k, state in enumerate(states):
        began = time.perf_counter_ns()
        step(state, actions[k])
        times[k] = 1e-3 * (time.perf_counter_ns() - began)
    return actions, times


loops = {
    "Python, compiled": time_python(),
    "C++, onnxruntime": follow("policy.onnx"),
    "C++, arrays": follow("policy.f64"),
}

# %%
# All agree with `predict` to rounding. A controller minds the slowest steps more than the usual one.

expected = policy.predict(states)
figure, ax = plt.subplots(figsize=(7, 4), layout="constrained")
for name, (actions, times) in loops.items():
    median, slow = np.percentile(times, [50, 99.9])
    print(
        f"{name}: median {median:.2f} µs, 99.9 % {slow:.2f} µs, off predict {np.abs(actions - expected).max():.1e}"
    )
    ax.semilogx(
        np.sort(times)[::-1], np.arange(1, len(times) + 1) / len(times), label=f"{name}, {median:.1f} µs"
    )
ax.set(yscale="log", xlabel="a step takes longer than (µs)", ylabel="share of 100,000 steps")
ax.legend(title="median")
figure.savefig("control_loop_cpp.png")
plt.show()
