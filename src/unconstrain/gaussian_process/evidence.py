"""Kernels, their hyperparameters and the noise, by marginal likelihood.

`log p(t | θ, σ) = -½ tᵀ(K + σ²I)⁻¹t - ½ log |K + σ²I| - R/2 log 2π` of the rows of some samples that lie far from each
other. Of neighbours along a movement most would tell how rough the policy is over the shortest distance, which is not
what it is asked for elsewhere: on the arm widths then come out a third as large, and errors three times.

References
----------
Rasmussen, Williams, Gaussian Processes for Machine Learning, 2006, Sec. 5.4.1.
"""

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from sklearn.base import clone
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, DotProduct, WhiteKernel

from unconstrain.errors import PolicyError
from unconstrain.features.scaling import Scaling
from unconstrain.fitting.observation import Observation
from unconstrain.gaussian_process.kernels import CurlFree, CurlFreeQuadratic, Separable
from unconstrain.gaussian_process.parts import is_separable, parts_of
from unconstrain.gaussian_process.rows import Rows
from unconstrain.gaussian_process.spreading import choose_spread_out

MOST_ROWS = 500
"""Rows that likelihoods are computed of."""

LEAST_NOISE = 1e-8
"""Variance of the noise in squared units of the root mean square action."""

AMPLITUDES, WIDTHS = (1e-5, 1e2), (5e-2, 5e2)
"""Between which variances of parts, in squared units of the root mean square action, and widths, in spreads of the
states, are searched. Larger ones leave no digit of the variances."""

DECISIVE = 3.0
"""Log-likelihood by which a later candidate has to beat an earlier one."""

SMOOTH, CUBIC, POTENTIAL = "smooth", "cubic", "potential"


@dataclass(frozen=True)
class Evidence:
    """A kernel with its hyperparameters, and how likely it makes what was seen.

    Parameters
    ----------
    name : str
        Which candidate it is.
    kernel : Kernel
        For actions in units of their root mean square.
    noise : float
        σ², in squared units of that.
    log_likelihood : float
        Of the rows looked at.
    scaling : Scaling
        Of the states that the kernel sees.
    size : float
        Root mean square action.
    """

    name: str
    kernel: Any
    noise: float
    log_likelihood: float
    scaling: Scaling
    size: float


def candidates(n_states: int, n_actions: int) -> dict[str, Any]:
    """List the kernels that `kernel="auto"` chooses among.

    Parameters
    ----------
    n_states, n_actions : int
        n and d.

    Returns
    -------
    dict of str to Kernel
        "smooth", a smooth policy about a linear one; "cubic", that and a polynomial; and where each action belongs to a
        state "potential", the gradient of a smooth potential about a quadratic one.
    """
    d = n_actions

    def part(kernel: Any) -> Any:
        return ConstantKernel(1.0, AMPLITUDES) * Separable(kernel, d)

    linear = DotProduct(1.0, "fixed")
    smooth = part(RBF(1.5, WIDTHS)) + part(linear)
    found = {SMOOTH: smooth, CUBIC: smooth + ConstantKernel(0.1, AMPLITUDES) * Separable(linear**3, d)}
    if n_states == n_actions:
        bent = ConstantKernel(1.0, AMPLITUDES) * CurlFree(1.5, WIDTHS)
        straight = ConstantKernel(1.0, AMPLITUDES) * CurlFreeQuadratic()
        found[POTENTIAL] = bent + straight + part(ConstantKernel(1.0, "fixed"))
    return found


def adapt(kernel: Any, n_states: int, n_actions: int) -> Any:
    """Prepare a user's kernel for pairs of states and directions.

    Parameters
    ----------
    kernel : Kernel
        On such pairs, or on states alone, for all actions alike.
    n_states, n_actions : int
        n and d.

    Returns
    -------
    Kernel
        A copy, told how many columns are the direction.

    Raises
    ------
    PolicyError
        It is no kernel, has noise of its own, or is curl-free though actions do not belong to states.
    """
    from sklearn.gaussian_process.kernels import Kernel

    if not isinstance(kernel, Kernel) or isinstance(kernel, type):
        raise PolicyError(
            f'kernel must be "auto", one of unconstrain.kernels, or a kernel of scikit-learn, got {kernel!r:.60}'
        )
    kernel = clone(kernel)
    parts = parts_of(kernel)
    if any(isinstance(part, WhiteKernel) for part in parts):
        raise PolicyError("the noise is found beside the kernel: give the kernel without its WhiteKernel")
    if not any(isinstance(part, Separable | CurlFree | CurlFreeQuadratic) for part in parts):
        return Separable(kernel, n_actions)
    if n_states != n_actions and any(isinstance(part, CurlFree | CurlFreeQuadratic) for part in parts):
        raise PolicyError(
            f"curl-free kernels need as many actions as states, in the same order, got {n_states} states and "
            f"{n_actions} actions: give the columns that belong together, or Separable(kernel)"
        )
    for part in parts:
        if isinstance(part, Separable):
            part.n_actions = n_actions
    return kernel


def learn_kernel(
    name: str,
    kernel: Any,
    Z: np.ndarray,
    observation: Observation,
    weights: np.ndarray | None,
    size: float,
    least_noise: float = 0.0,
) -> Evidence:
    """Find the hyperparameters and the noise that make observations likeliest.

    Parameters
    ----------
    name : str
        Of the candidate.
    kernel : Kernel
        Where the search starts.
    Z : ndarray of shape (N, n)
        States.
    observation : Observation
        Of N samples.
    weights : ndarray of shape (N,) or None
        Weight of each sample.
    size : float
        Root mean square action, in which the kernel counts.
    least_noise : float
        Variance that is known beforehand, in squared units of the action.

    Returns
    -------
    Evidence
        The likeliest.
    """
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor

    scaling = find_scaling(kernel, Z)
    standard = scaling(Z)
    rows = choose_rows(Rows.of(standard, observation, weights), standard)
    least = max(LEAST_NOISE, least_noise / size**2)
    noise = WhiteKernel(max(1e-3, 2 * least), (least, max(10.0, 4 * least)))
    process = GaussianProcessRegressor(kernel + noise, alpha=1e-11, random_state=0)
    with warnings.catch_warnings():
        # It warns of every hyperparameter that ends at a bound, as amplitudes of parts do that are not needed.
        warnings.simplefilter("ignore", ConvergenceWarning)
        process.fit(rows.pairs, rows.targets / size)
    found = process.kernel_
    likelihood = float(process.log_marginal_likelihood_value_)
    return Evidence(name, found.k1, float(found.k2.noise_level), likelihood, scaling, size)


def find_scaling(kernel: Any, Z: np.ndarray) -> Scaling:
    """Find how a kernel sees states.

    Parameters
    ----------
    kernel : Kernel
        On pairs of states and directions.
    Z : ndarray of shape (N, n)
        States.

    Returns
    -------
    Scaling
        Each state in units of its spread; all in one unit where actions are the gradient of a potential.
    """
    scaling = Scaling.of(Z)
    if is_separable(kernel):
        return scaling
    return Scaling(scaling.mean, np.full_like(scaling.spread, np.sqrt(np.mean(scaling.spread**2))))


def choose_rows(rows: Rows, Z: np.ndarray) -> Rows:
    """Choose the rows of samples that lie far from each other.

    Parameters
    ----------
    rows : Rows
        Of all samples.
    Z : ndarray of shape (N, n)
        Standardised states of the samples.

    Returns
    -------
    Rows
        `MOST_ROWS` of them at most.
    """
    if len(rows) <= MOST_ROWS:
        return rows
    samples, counts = np.unique(rows.sample, return_counts=True)
    order = choose_spread_out(Z[samples], MOST_ROWS)
    return rows.of_samples(samples[order[np.cumsum(counts[order]) <= MOST_ROWS]])


def choose(found: list[Evidence]) -> Evidence:
    """Choose the likeliest candidate, an earlier one where a later is not clearly likelier.

    Parameters
    ----------
    found : list of Evidence
        One at least.

    Returns
    -------
    Evidence
        One of them.
    """
    best = found[0]
    for other in found[1:]:
        if other.log_likelihood > best.log_likelihood + DECISIVE:
            best = other
    return best
