"""What a Gaussian process predicts of folds that were left out of it, and what that says of its variances.

Without the rows I of a fold the posterior is that of the others, which costs no other factorisation. With
`G = (K + σ²I)⁻¹` of all rows and α = G t,

    C_I = (G_II)⁻¹,        e_I = C_I α_I,        α' = α - G_{·I} C_I α_I,

are the covariance of the fold's rows given the others, noise included, their errors, and the coefficients of the
process without them, zero at I. On inducing rows the moments of the fold are subtracted.

*Calibration.* Noise differs from one sample to the next, but a policy that is wrong at one sample is as wrong at the
next. So whatever the noise, products of errors of samples that follow each other have their covariance as the mean, and

    f = Σ ρ z z' / Σ ρ²,       z = e / √C_rr,     ρ = C_rr' / √(C_rr C_r'r'),

over such pairs of rows is how much wider the policy's covariance has to be than the process says. To that a fifth of
the delete-a-fold jackknife is added, `⅕ (K - 1)/K Σ_k (m_k - m̄)(m_k - m̄)ᵀ` of the means m_k without each fold, as
for policies that are linear in their parameters (`fitting.calibration`).

References
----------
Dubrule, Cross validation of kriging in a unique neighborhood, Mathematical Geology 15, 1983. Rasmussen, Williams,
Gaussian Processes for Machine Learning, 2006, Sec. 5.4.2.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from unconstrain.fitting.moments import Moments
from unconstrain.gaussian_process.inducing import InducingFeatures
from unconstrain.gaussian_process.process import Process
from unconstrain.gaussian_process.rows import Rows

NARROWEST, WIDEST = 1.0, 1e4
"""Between which covariances are widened."""

SHARE_OF_SPREAD = 0.2
"""Share of the jackknife that is added."""

LEAST_TOLD = 0.2
"""Sum of squared correlations below which products of errors are noise, and say nothing of the covariance."""


@dataclass(frozen=True)
class HeldOut:
    """What is left of the process without each fold, and how wide its covariance has to be.

    Parameters
    ----------
    processes : dict of int to Process
        Without each fold; they predict only.
    widening : float
        f.
    """

    processes: dict[int, Process]
    widening: float

    def widen(self, process: Process) -> Process:
        """Make the covariance of the process of all folds as wide as what was held out says.

        Parameters
        ----------
        process : Process
            Of all folds.

        Returns
        -------
        Process
            With the same mean.
        """
        K = len(self.processes)
        if K < 2:
            return replace(process, widening=self.widening)
        coefficients = np.stack([each.coefficients for each in self.processes.values()], axis=1)
        apart = coefficients - coefficients.mean(axis=1, keepdims=True)
        return replace(process, widening=self.widening, apart=np.sqrt(SHARE_OF_SPREAD * (K - 1) / K) * apart)


def hold_out_exactly(process: Process, rows: Rows, fold: np.ndarray, follows: np.ndarray) -> HeldOut:
    """Leave folds out of a process that is exact.

    Parameters
    ----------
    process : Process
        Conditioned on all rows.
    rows : Rows
        These.
    fold, follows : ndarray of shape (N,)
        The fold of each sample, and whether it follows the sample before it in its episode.

    Returns
    -------
    HeldOut
        By fold.
    """
    assert process.whitener is not None
    G = process.whitener @ process.whitener.T
    processes, above, below = {}, 0.0, 0.0
    of_row = fold[rows.sample]
    for k in np.unique(of_row).tolist():
        inside = np.flatnonzero(of_row == k)
        C = np.linalg.inv(G[np.ix_(inside, inside)])
        errors = C @ process.coefficients[inside]
        coefficients = process.coefficients - G[:, inside] @ errors
        processes[k] = replace(process, coefficients=coefficients, whitener=None)
        one, other = _neighbours(rows.sample[inside], follows)
        up, down = _compare(errors, np.diagonal(C), C[one, other], one, other)
        above, below = above + up, below + down
    return HeldOut(processes, _widening(above, below))


def hold_out_of_moments(
    features: InducingFeatures,
    parts: Sequence[Moments | None],
    rows: Rows,
    fold: np.ndarray,
    follows: np.ndarray,
    size: float,
    noise: float,
) -> HeldOut:
    """Leave folds out of a process on inducing rows.

    Parameters
    ----------
    features : InducingFeatures
        Of the inducing rows.
    parts : sequence of Moments or None
        By fold.
    rows : Rows
        Of some of the samples, by which the covariance is judged.
    fold, follows : ndarray of shape (N,)
        The fold of each sample, and whether it follows the sample before it in its episode.
    size, noise : float
        In what the policy is counted, and σ² in squared units of that.

    Returns
    -------
    HeldOut
        By fold.
    """
    present = {k: part for k, part in enumerate(parts) if part is not None}
    processes, above, below = {}, 0.0, 0.0
    of_row = fold[rows.sample]
    for k in present:
        others = [part for j, part in present.items() if j != k]
        if not others:
            continue
        process = features.process(Moments.sum(others), size, noise)
        processes[k] = process.without_variances()
        inside = np.flatnonzero(of_row == k)
        one, other = _neighbours(rows.sample[inside], follows)
        if not len(one):
            continue
        seen = rows.pairs[inside]
        k_rows = process.kernel(seen, process.pairs)
        errors = rows.targets[inside] / size - k_rows @ process.coefficients
        assert process.whitener is not None
        assert process.left is not None
        F = k_rows @ process.whitener
        C = process.kernel(seen) - F @ F.T + F @ process.left @ F.T
        up, down = _compare(errors, np.diagonal(C) + noise, C[one, other], one, other)
        above, below = above + up, below + down
    return HeldOut(processes, _widening(above, below))


def _neighbours(sample: np.ndarray, follows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Find pairs of rows of samples (R,), of which one follows the other in its episode."""
    starts = np.searchsorted(sample, sample - 1, side="left")
    ends = np.searchsorted(sample, sample - 1, side="right")
    counts = np.where(follows[sample], ends - starts, 0)
    one = np.repeat(np.arange(len(sample)), counts)
    within = np.arange(len(one)) - np.repeat(np.cumsum(counts) - counts, counts)
    return one, np.repeat(starts, counts) + within


def _compare(
    errors: np.ndarray, variances: np.ndarray, covariances: np.ndarray, one: np.ndarray, other: np.ndarray
) -> tuple[float, float]:
    """Sum up `ρ z z'` and `ρ²`."""
    deviations = np.sqrt(variances)
    z = errors / deviations
    correlations = covariances / (deviations[one] * deviations[other])
    return float(correlations @ (z[one] * z[other])), float(correlations @ correlations)


def _widening(above: float, below: float) -> float:
    """Return f, one where too few pairs say something."""
    if below < LEAST_TOLD:
        return 1.0
    return float(np.clip(above / below, NARROWEST, WIDEST))
