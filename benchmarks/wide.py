"""Wide models, whose samples are held and solved by conjugate gradients.

python -m benchmarks iterative-fit iterative-memory iterative-path
python -m benchmarks wider                  100,000 parameters on 200,000 samples: the better part of an hour
"""

import resource
import subprocess
import sys
import time
import warnings

import numpy as np

import unconstrain as uc
from benchmarks.fits import draw_half_free
from benchmarks.ratio import Ratio
from unconstrain.fitting.observation import observe
from unconstrain.fitting.wide.decay import WideDecay
from unconstrain.fitting.wide.held import HeldSamples

N_SAMPLES, N_STATES, N_CENTERS = 20_000, 7, 1_500
ALPHA = 3e-3
"""What cross-validation chooses for these data."""

ROWS = 1_000


def _policy(X: np.ndarray, n_centers: int = N_CENTERS, alpha: float | str = ALPHA) -> uc.ParametricPolicy:
    centers = X[np.random.default_rng(1).permutation(len(X))[:n_centers]].copy()
    features = uc.NormalizedRBF(centers=centers, width=1.5)
    return uc.ParametricPolicy(features, risk="inconsistency", alpha=alpha)


def _one_pass(policy: uc.ParametricPolicy, X: np.ndarray, U: np.ndarray) -> float:
    """Time `V @ w` and `Vᵀ r` with V there, a thousand samples of it, for all samples."""
    along = U[:ROWS] / np.linalg.norm(U[:ROWS], axis=1, keepdims=True)
    V = policy.model_.along(X[:ROWS], along)
    w = policy.weights_
    times = []
    for _ in range(7):
        start = time.perf_counter()
        r = V @ w
        V.T @ r
        times.append(time.perf_counter() - start)
    return float(np.median(times)) * len(X) / ROWS


def fit() -> Ratio:
    """10,500 parameters on 20,000 samples, beside as many passes as the solution takes."""
    X, U, groups = draw_half_free(N_SAMPLES, N_STATES)
    policy = _policy(X)
    start = time.perf_counter()
    policy.fit(X, U, groups=groups)
    ours = time.perf_counter() - start
    decay = WideDecay([HeldSamples.of(policy.model_, X, observe("inconsistency", U))])
    decay.solve(ALPHA)
    passes = decay.passes.n_passes
    one = _one_pass(policy, X, U)
    return Ratio(
        "iterative-fit",
        f"N=20,000, d=7, 1,500 RBFs, fit in {passes} steps",
        f"{passes} x V @ w and V.T @ r",
        ours / (passes * one),
        8.0,
        ours,
        passes * one,
    )


def path() -> Ratio:
    """λ by cross-validation, beside one λ."""
    X, U, groups = draw_half_free(N_SAMPLES, N_STATES)
    times = []
    for alpha in (ALPHA, "cv"):
        start = time.perf_counter()
        _policy(X, alpha=alpha).fit(X, U, groups=groups)
        times.append(time.perf_counter() - start)
    one, ours = times
    return Ratio("iterative-path", "the same with λ chosen", "with one λ", ours / one, 20.0, ours, one)


def memory() -> Ratio:
    """Peak memory of that fit, in a process of its own."""
    command = [sys.executable, "-m", "benchmarks.wide", str(N_SAMPLES), str(N_CENTERS), str(ALPHA)]
    out = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    ours = float(out.splitlines()[-1])
    return Ratio("iterative-memory", "peak of iterative-fit", "1 GiB", ours / 2**30, 1.0, ours, float(2**30))


def wider() -> None:
    """Print how long 100,100 parameters take on 200,000 samples, and how much memory."""
    command = [sys.executable, "-m", "benchmarks.wide", "200000", "14300", "0.1"]
    print(subprocess.run(command, capture_output=True, text=True, check=True).stdout)


def main() -> None:
    n_samples, n_centers, alpha = int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3])
    X, U, groups = draw_half_free(n_samples, N_STATES)
    policy = _policy(X, n_centers, alpha)
    start = time.perf_counter()
    with warnings.catch_warnings():
        warnings.simplefilter("default")
        policy.fit(X, U, groups=groups)
    error = uc.metrics.unconstrained_policy_error(np.sin(X[::20]) - 2 * X[::20], policy.predict(X[::20]))
    print(f"{len(policy.weights_):,} parameters, {n_samples:,} samples, {time.perf_counter() - start:.0f} s")
    print(f"nUPE {error:.3g}")
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024)


if __name__ == "__main__":
    main()
