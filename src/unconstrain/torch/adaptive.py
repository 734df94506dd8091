"""The negative marginal log-likelihood of recorded actions, where a sample may have been free or constrained.

A free action is the policy and noise, `N(u; p, σ² I)`. A constrained one is a point of the sphere with diameter p
(Thales), and noise: with ρ and R the action's distance from the centre and the radius, and `κ = ρR / σ²`,

    p(u) = (2πσ²)^(-d/2) exp(-(ρ - R)² / 2σ²) · mean of exp(κ m₁ - κ) over the unit sphere        (`torch.sphere`).

That supposes points evenly spread over the sphere. Where they are not (one task, always the same constraint) its
gradient pulls every prediction towards zero, since a small sphere has a small area. What holds wherever on the sphere
they lie is the distribution of the distance, `p(ρ) ∝ ρ^(d-1) p(u)` (`fitting.likelihood`). So the loss has the value of
the former, and the gradient of the latter.
"""

import math
from typing import TYPE_CHECKING, Any

from unconstrain.errors import DataError
from unconstrain.torch.backend import load_torch
from unconstrain.torch.batch import Batch, check_noise
from unconstrain.torch.sphere import log_mean

if TYPE_CHECKING:
    from torch import Tensor


def adaptive_loss(
    predicted: "Tensor",
    actions: Any,
    noise: Any,
    projections: Any = None,
    free: Any = None,
    *,
    free_share: Any = 0.5,
    weights: Any = None,
    reduction: str = "mean",
) -> "Tensor":
    """Compute how unlikely recorded actions are, given what a network says the unconstrained policy does.

    Parameters
    ----------
    predicted : Tensor of shape (..., d)
        What the network says.
    actions : Tensor or array_like of shape (..., d)
        Recorded actions, in the same unit.
    noise : float or Tensor
        Standard deviation σ of the actions' noise, in their unit, above zero. As a tensor it may be a parameter that
        is learnt too. Begin with a large one, half of the root mean square action, and lower it.
    projections : Tensor or array_like of shape (..., d, d), optional
        Nullspace projections that are known; all NaN where one is not.
    free : Tensor or array_like of shape (...), optional
        Which samples were free, where that is known or was inferred: booleans, or probabilities γ such as a policy's
        `free_probability`. By default each sample's own likelihood tells.
    free_share : float or Tensor of shape (...)
        How probable it is beforehand that a sample was free, where `free` is not given.
    weights : Tensor or array_like of shape (...), optional
        How much each sample counts, 1 by default.
    reduction : {"mean", "sum", "none"}
        The (weighted) mean over samples, their sum, or each.

    Returns
    -------
    Tensor
        In nats: a number, or of shape (...) for "none". The gradient can be taken once.

    Raises
    ------
    DataError
        Shapes do not go together, or an option is impossible.
    UnconstrainError
        PyTorch is not installed.

    Notes
    -----
    With the density of a free action `p₁ = N(u; p, σ² I)` and that of a constrained one p₀ it is
    `-log(s p₁ + (1 - s) p₀)` with s = `free_share`, and with γ = `free` given its expectation
    `-γ log p₁ - (1 - γ) log p₀`. Where the projection N is known it is that of `N u` about `N p`.

    The gradient of a constrained sample is that of the likelihood of its distance from the centre of the sphere: at the
    true policy its expectation is zero up to terms in `σ² / R²`, wherever on the sphere the samples lie. All is
    computed in double precision where the device has it, whatever the network's.

    References
    ----------
    docs/adaptive.md.
    """
    torch = load_torch()
    batch = Batch.of(predicted, actions, projections, free, weights)
    sigma = check_noise(noise, batch.P, positive=True)
    if sigma.ndim:
        if tuple(sigma.shape) != tuple(predicted.shape[:-1]):
            raise DataError(
                f"noise {tuple(sigma.shape)} must be one number, or one for each sample, "
                f"{tuple(predicted.shape[:-1])}"
            )
        sigma = sigma.reshape(-1)
    variance = sigma**2
    squares, ranks = batch.behind()
    whole = -0.5 * (squares / variance + ranks * torch.log(2 * math.pi * variance))
    bent = _constrained(batch, variance)
    if batch.free is not None:
        found = batch.free * whole + (1 - batch.free) * bent
    else:
        share = _check_share(free_share, batch)
        found = torch.logaddexp(torch.log(share) + whole, torch.log1p(-share) + bent)
    if batch.known is not None:
        found = whole.where(batch.known, found)
    return batch.reduce(-found, reduction, predicted)


def _constrained(batch: Batch, variance: "Tensor") -> "Tensor":
    """Compute log-likelihoods under "constrained", with the gradients of those of the distance; (N,)."""
    torch = load_torch()
    U, P, d = batch.U, batch.P, batch.U.shape[1]
    rho, R = (U - P / 2).norm(dim=1), P.norm(dim=1) / 2
    across = rho + R
    # Not as ρ - R, of which little would be left where the two are nearly equal.
    distance = (U * (U - P)).sum(dim=1) / across.where(across > 0, 1.0)
    kappa = (rho * R / variance).clamp(max=torch.finfo(U.dtype).max)
    log_density = log_mean(d, kappa) - 0.5 * distance**2 / variance
    log_density = log_density - 0.5 * d * torch.log(2 * math.pi * variance)
    # From the density of the action to that of its distance; bounded where the action is at the centre.
    tilt = (d - 1) / 2 * torch.log(rho**2 + variance.detach())
    return log_density + tilt - tilt.detach()


def _check_share(free_share: Any, batch: Batch) -> "Tensor":
    torch = load_torch()
    if not isinstance(free_share, torch.Tensor):
        numbers = torch.as_tensor(free_share)
        if numbers.ndim == 0 and not 0 <= float(numbers) <= 1:
            raise DataError(f"free_share must be a probability, 0 to 1, got {free_share!r:.40}")
    share = torch.as_tensor(free_share, device=batch.P.device, dtype=batch.P.dtype)
    share = share.reshape(-1) if share.ndim else share
    if share.ndim and len(share) != len(batch.P):
        raise DataError(
            f"free_share must be one number, or one for each of {len(batch.P)} samples, not {len(share)}"
        )
    return share
