"""The mean of `exp(κ m₁ - κ)` over the unit sphere, as an operation of PyTorch.

That is `0F1(; ν+1; κ²/4) exp(-κ) = Γ(ν+1) (2/κ)^ν I_ν(κ) exp(-κ)` with `ν = d/2 - 1`; PyTorch has no Bessel functions
of any order. The logarithm G_μ of what stands before `exp(-κ)` is expanded for a large order μ, uniformly in κ (Debye),
and orders are counted down by the continued fraction of their quotients, which forgets errors:

    G_{j-1} = G_j - log q_j,    q_j = (2j/κ) I_j(κ) / I_{j-1}(κ) = 1 / (1 + κ² q_{j+1} / 4j(j+1)).

Beyond `FAR max(ν, 1)²` a few terms of the expansion in 1/κ are exact (Hankel).

References
----------
Digital Library of Mathematical Functions, 10.41(ii), 10.40(i), 10.33.
"""

import math
from fractions import Fraction
from functools import cache
from typing import TYPE_CHECKING, Any

from unconstrain.torch.backend import load_torch

if TYPE_CHECKING:
    from torch import Tensor

LARGE_ORDER, TERMS = 15.0, 10
"""From this order on so many terms are exact to double precision, whatever κ."""

FAR, FAR_TERMS = 1e2, 8


def log_mean(d: int, kappa: "Tensor") -> "Tensor":
    """Compute the logarithm of the mean of `exp(κ m₁ - κ)` over the unit sphere in d dimensions.

    Parameters
    ----------
    d : int
        Dimension of the space that the sphere lies in, 1 or more.
    kappa : Tensor of shape (N,)
        κ >= 0, finite.

    Returns
    -------
    Tensor of shape (N,)
        0 at κ = 0, and below. Its derivative is that of the exact function; there is no second one.
    """
    return _operation().apply(kappa, d)


@cache
def _operation() -> Any:
    torch = load_torch()
    Function: Any = torch.autograd.Function

    class LogMean(Function):
        @staticmethod
        def forward(ctx: Any, kappa: "Tensor", d: int) -> "Tensor":
            value, short = evaluate(d, kappa)
            ctx.save_for_backward(short)
            return value

        @staticmethod
        @torch.autograd.function.once_differentiable
        def backward(ctx: Any, gradient: "Tensor") -> tuple["Tensor", None]:
            (short,) = ctx.saved_tensors
            return -gradient * short, None

    return LogMean


def evaluate(d: int, kappa: "Tensor") -> "tuple[Tensor, Tensor]":
    """Compute the logarithm of the mean, and by how much the mean of m₁ falls short of 1.

    Parameters
    ----------
    d : int
        Dimension of the space that the sphere lies in, 1 or more.
    kappa : Tensor of shape (N,)
        κ >= 0, finite.

    Returns
    -------
    value : Tensor of shape (N,)
        The logarithm of the mean of `exp(κ m₁ - κ)`.
    short : Tensor of shape (N,)
        `1 - I_{ν+1}(κ) / I_ν(κ)`, the derivative of the former with the sign turned.
    """
    torch = load_torch()
    nu = d / 2 - 1
    far = FAR * max(nu, 1.0) ** 2
    near = kappa.clamp(max=far)
    steps = max(0, math.ceil(LARGE_ORDER - nu))
    top = nu + steps
    value = _debye(top, near)
    q = torch.exp(_debye(top + 1, near) - value)
    quarter, one, product = near**2 / 4, torch.ones_like(near), torch.ones_like(near)
    for step in range(steps):
        j = top - step
        q = torch.addcmul(one, quarter, q, value=1 / (j * (j + 1))).reciprocal()
        product = product * q
    value = value - torch.log(product)
    short = 1 - near / (2 * (nu + 1)) * q
    value = value - near
    distant = kappa.clamp(min=far)
    beyond, beyond_next = _hankel(nu, distant), _hankel(nu + 1, distant)
    value_far = math.lgamma(d / 2) + nu * torch.log(2 / distant) - 0.5 * torch.log(2 * math.pi * distant)
    value_far = value_far + torch.log1p(beyond)
    is_far = kappa > far
    return value_far.where(is_far, value), ((beyond - beyond_next) / (1 + beyond)).where(is_far, short)


def _debye(mu: float, kappa: "Tensor") -> "Tensor":
    """Expand `G_μ = log(Γ(μ+1) (2/κ)^μ I_μ(κ))` for a large order; (N,)."""
    torch = load_torch()
    h = torch.sqrt(mu**2 + kappa**2)
    t = mu / h
    powers = t[:, None] ** torch.arange(3 * TERMS + 1, dtype=t.dtype, device=t.device)
    series = powers @ torch.tensor(_coefficients(mu), dtype=t.dtype, device=t.device)
    constant = math.lgamma(mu + 1) + mu * math.log(2.0) - 0.5 * math.log(2 * math.pi)
    return constant - mu * torch.log(mu + h) + h - 0.5 * torch.log(h) + torch.log(series)


@cache
def _coefficients(mu: float) -> list[float]:
    """List the coefficients of `Σ_k u_k(t) / μ^k`, from the constant on."""
    total = [0.0] * (3 * TERMS + 1)
    for k, u in enumerate(_polynomials()):
        for power, coefficient in enumerate(u):
            total[power] += float(coefficient) / mu**k
    return total


@cache
def _polynomials() -> list[list[Fraction]]:
    """List `u_{k+1} = ½ t² (1 - t²) u_k' + ⅛ ∫ (1 - 5t²) u_k`, u_0 = 1, as coefficients from the constant on."""
    found = [[Fraction(1)]]
    for _ in range(TERMS):
        u = found[-1]
        following = [Fraction(0)] * (len(u) + 3)
        for n, c in enumerate(u):
            following[n + 1] += c * (Fraction(n, 2) + Fraction(1, 8 * (n + 1)))
            following[n + 3] -= c * (Fraction(n, 2) + Fraction(5, 8 * (n + 3)))
        found.append(following)
    return found


def _hankel(nu: float, kappa: "Tensor") -> "Tensor":
    """Expand `sqrt(2πκ) exp(-κ) I_ν(κ) - 1` in powers of 1/κ; (N,)."""
    total, term = kappa * 0, kappa * 0 + 1
    for k in range(1, FAR_TERMS + 1):
        term = term * -(4 * nu**2 - (2 * k - 1) ** 2) / (8 * k * kappa)
        total = total + term
    return total
