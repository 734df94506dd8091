"""Bounds of the unconstrained policy error (UPE), given the inconsistency.

Assume that the true policy is in the model's span, `π = Φ w*`, and that actions were recorded without noise, so that
`r = ûᵀΦ w*`. With `δ = w - w*` and sums over the data's states (everything here is divided by their weight),

    E_i(w) = δᵀHδ = Σ_k λ_k a_k²,     UPE(w) = δᵀGδ = Σ_k a_k²,     δ = Σ_k a_k z_k + (what G does not change)

in the generalised eigenvectors of (H, G). Hence, for any w whatever,

    UPE <= E_i / λ_min,     a_k² <= E_i / λ_k,     Σ_{λ_k >= τ} a_k² <= E_i / min{λ_k : λ_k >= τ}.

The last is the share of the error in the directions that are determined; of the other directions nothing is known. With
noise, or a policy outside the span, `√E_i(w)` in these is replaced by `√E_i(w) + √E_i(w*)` (triangle inequality).

Local models are fitted alone: each has a bound of its own, on its states weighted by its receptive field K_m. The
blend's error is at most the blend of errors (‖·‖² is convex) and a blending weight at most `K_m / κ`, with κ the least
sum of activations at any of the states, so that `UPE <= 1/(Nκ) Σ_m E_m / λ_m`. The span of local models that are each
right is that of linear policies: for others this bounds the distance to the best of them only as far as they fit.
"""

import numpy as np

from unconstrain.diagnostics.spectrum import THRESHOLD


def compute_bounds(
    risks: np.ndarray, spectra: list[np.ndarray], weight: float, threshold: float = THRESHOLD
) -> tuple[float, float]:
    """Bound the unconstrained policy error.

    Parameters
    ----------
    risks : ndarray of shape (S,)
        E_i of each model, summed over samples, in squared units of the action.
    spectra : list of ndarray of shape (R,)
        Shares λ of each model, ascending.
    weight : float
        What to divide by, to make sums means.
    threshold : float
        The least λ of a determined direction.

    Returns
    -------
    everywhere : float
        Bound of the mean squared error along all directions, in squared units of the action; inf where a direction was
        not observed.
    determined : float
        Bound along determined directions.
    """
    everywhere = determined = 0.0
    for error, values in zip(risks, spectra, strict=True):
        if not len(values):
            continue
        everywhere += error / values[0] if values[0] > 0 else np.inf
        known = values[values >= threshold]
        determined += error / known[0] if len(known) else 0.0
    return everywhere / weight, determined / weight


def bound_directions(risks: np.ndarray, spectra: list[np.ndarray], weights: np.ndarray) -> list[np.ndarray]:
    """Bound the mean squared error along each direction by `E_i / λ_k`.

    Parameters
    ----------
    risks : ndarray of shape (S,)
        E_i of each model, summed over samples, in squared units of the action.
    spectra : list of ndarray of shape (R,)
        Shares λ of each model, ascending.
    weights : ndarray of shape (S,)
        Summed sample weights of each model.

    Returns
    -------
    list of ndarray of shape (R,)
        In the order of `spectra`; inf where λ is zero.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        return [
            np.where(values > 0, error / values, np.inf) / weight
            for error, values, weight in zip(risks, spectra, weights, strict=True)
        ]
