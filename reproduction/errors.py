"""The paper's errors: of predictions on held-out demonstrations, as shares of the variance of their true policy."""

from numpy.typing import ArrayLike

from unconstrain import metrics as risk
from unconstrain.demonstrations import Demonstrations


def nupe(held_out: Demonstrations, P: ArrayLike) -> float:
    """nUPE, `mean ‖π - p‖² / Σ_j var(π_j)`, of predictions P (N, d)."""
    assert held_out.policy is not None
    return risk.normalized(risk.unconstrained_policy_error(held_out.policy, P), held_out.policy)


def ncpe(held_out: Demonstrations, P: ArrayLike, projections: ArrayLike | None = None) -> float:
    """nCPE, `mean ‖N (π - p)‖² / Σ_j var(π_j)`, of predictions P (N, d).

    projections: N (N, d, d); by default those the demonstrations were made under.
    """
    N = held_out.projections if projections is None else projections
    assert held_out.policy is not None
    assert N is not None
    return risk.normalized(risk.constrained_policy_error(held_out.policy, P, N), held_out.policy)


def both(held_out: Demonstrations, P: ArrayLike) -> dict[str, float]:
    """nUPE and nCPE by name."""
    return {"nUPE": nupe(held_out, P), "nCPE": ncpe(held_out, P)}
