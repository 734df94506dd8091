"""Gaussian processes on few movements, on the arm, and how often their intervals hold the truth.

    python -m benchmarks.gaussian_process few          # 4 movements of the limit cycle, 20 data sets
    python -m benchmarks.gaussian_process arm          # Table I, constraint 1-2-3, 3 data sets
    python -m benchmarks.gaussian_process intervals    # 90 % intervals, limit cycle and arm

Constants of the method were chosen on limit cycles drawn with seeds 1000 to 1005 and on arms 200 and 201; what is
reported here is of others.
"""

import sys
from time import perf_counter

import numpy as np
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, DotProduct

import unconstrain as uc
from reproduction import published
from reproduction.arm.trial import Recordings
from reproduction.scores import nupe
from unconstrain.demo import FEW, draw_data, learn, measure_errors
from unconstrain.limit_cycle import demonstrate

QUANTILE = 1.6449
"""Deviations that hold 90 % of a normal distribution."""

CASES = ((20, 0.0, 0.0), (20, 0.0, 0.05), (20, 0.5, 0.05), (20, 1.0, 0.05), (20, 0.5, 0.1), (20, 0.0, 0.2))
"""Movements of the limit cycle, share of free ones, and noise."""


def make_smooth(d):
    """Make a smooth policy about a linear one, which does not know that the limit cycle is a cubic polynomial."""
    amplitude = (1e-5, 1e2)
    smooth = ConstantKernel(1.0, amplitude) * uc.kernels.Separable(RBF(1.5, (5e-2, 5e2)), d)
    return smooth + ConstantKernel(1.0, amplitude) * uc.kernels.Separable(DotProduct(1.0, "fixed"), d)


def measure_few(seeds):
    """Print nUPE on 4 movements of the limit cycle, as in Fig. 4."""
    print("4 movements of the limit cycle, nUPE (median), and seconds of a fit")
    ways = {
        "inconsistency, 36 RBFs": lambda seen: learn(seen, "inconsistency", FEW),
        "adaptive, 36 RBFs": lambda seen: learn(seen, "adaptive", FEW),
    }
    for risk in ("inconsistency", "adaptive"):
        for name, kernel in (("smooth", make_smooth(2)), ("auto", "auto")):
            policy = uc.GaussianProcessPolicy(kernel, risk=risk)
            ways[f"{risk}, process, {name} kernel"] = lambda seen, policy=policy: policy.fit(
                seen.states, seen.actions, groups=seen.episodes
            )
    mean, spread = published.TOY["inconsistency, 4 trajectories"]["nUPE"]
    print(f"  published: {mean:.3f} ± {spread:.3f}")
    for name, way in ways.items():
        errors, start = [], perf_counter()
        for seed in seeds:
            training, test = draw_data(seed)
            errors.append(measure_errors(way(training.select(training.episodes < FEW)), test)["nUPE"])
        seconds = (perf_counter() - start) / len(errors)
        print(
            f"  {name}: {np.mean(errors):.3g} ± {np.std(errors):.2g} ({np.median(errors):.2g}), {seconds:.1f} s",
            flush=True,
        )


def measure_arm(seeds):
    """Print nUPE on the arm under constraint 1-2-3; by the adaptive risk, which takes minutes, of one data set."""
    print("the arm, constraint 1-2-3, nUPE (of each data set), share of 90 % intervals that hold the truth")
    for p in (1.5, 1.8):
        mean, spread = published.ARM[p, "1-2-3"]["nUPE"]
        print(f"  p = {p}, published: {mean:.3f} ± {spread:.3f}")
    for risk, name, kernel, count in (
        ("inconsistency", "auto", "auto", len(seeds)),
        ("adaptive", "auto", "auto", 1),
        ("inconsistency", "smooth", make_smooth(7), len(seeds)),
    ):
        for p in (1.8, 1.5):
            errors, held, chosen, start = [], [], [], perf_counter()
            for seed in seeds[:count]:
                recordings = Recordings.simulate(p, "1-2-3", seed)
                seen, test = recordings.training, recordings.test
                policy = uc.GaussianProcessPolicy(kernel, risk=risk)
                policy.fit(seen.states, seen.actions, groups=seen.episodes)
                errors.append(nupe(test, policy.predict(test.states)))
                held.append(measure_share(policy, test))
                chosen.append(policy.kernel_name_)
            seconds = (perf_counter() - start) / count
            each = ", ".join(f"{error:.3f}" for error in errors)
            print(
                f"  p = {p}, {risk}, {name} kernel: {np.mean(errors):.3f} ({each}), {np.mean(held):.2f}, "
                f"{seconds:.0f} s, {', '.join(chosen)}",
                flush=True,
            )


def measure_intervals(seeds):
    """Print how many of the true actions 90 % intervals hold on other movements."""
    print("limit cycle, risk adaptive: share of 90 % intervals that hold the truth, of each data set; nUPE")
    everything = []
    for movements, free, noise in CASES:
        shares, errors = [], []
        for seed in seeds:
            first, second = (np.random.default_rng([seed, stream]) for stream in (3, 4))
            seen = demonstrate(movements, noise=noise, free=free, random_state=first)
            test = demonstrate(movements, random_state=second)
            policy = uc.GaussianProcessPolicy(make_smooth(2))
            policy.fit(seen.states, seen.actions, groups=seen.episodes)
            shares.append(measure_share(policy, test))
            errors.append(measure_errors(policy, test)["nUPE"])
        everything += shares
        each = ", ".join(f"{share:.2f}" for share in shares)
        print(
            f"  {movements} movements, {free:.0%} free, {noise:.0%} noise: {np.mean(shares):.2f} ({each}); "
            f"{np.mean(errors):.2g}",
            flush=True,
        )
    print(f"  all: {np.mean(everything):.3f}")


def measure_share(policy, test):
    """Compute the share of true actions that lie in the policy's 90 % intervals."""
    P, deviation = policy.predict(test.states, return_std=True)
    return float(np.mean(np.abs(P - test.policy) <= QUANTILE * deviation))


PARTS = {
    "few": (measure_few, range(20)),
    "arm": (measure_arm, range(3)),
    "intervals": (measure_intervals, range(2000, 2003)),
}


def main(names):
    """Run the parts of these names, all of them where there is none."""
    unknown = [name for name in names if name not in PARTS]
    if unknown:
        sys.exit(f"there is no part {unknown[0]!r}: choose among {', '.join(PARTS)}")
    for name in names or PARTS:
        measure, seeds = PARTS[name]
        measure(seeds)


if __name__ == "__main__":
    main(sys.argv[1:])
