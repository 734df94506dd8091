"""The paper's errors: of predictions on held-out demonstrations, as shares of the variance of their true policy."""

from numpy.typing import ArrayLike

from unconstrain import metrics
from unconstrain.demonstrations import Demonstrations


def nupe(held_out: Demonstrations, P: ArrayLike) -> float:
    """Measure the nUPE, `mean ‖π - p‖² / Σ_j var(π_j)`, of predictions P (N, d)."""
    assert held_out.policy is not None
    return metrics.normalized(metrics.unconstrained_policy_error(held_out.policy, P), held_out.policy)


def ncpe(held_out: Demonstrations, P: ArrayLike, projections: ArrayLike | None = None) -> float:
    """Measure the nCPE, `mean ‖N (π - p)‖² / Σ_j var(π_j)`, of predictions P (N, d).

    By default the projections N (N, d, d) are those the demonstrations were made under.
    """
    N = held_out.projections if projections is None else projections
    assert held_out.policy is not None
    assert N is not None
    return metrics.normalized(metrics.constrained_policy_error(held_out.policy, P, N), held_out.policy)


def nupe_and_ncpe(held_out: Demonstrations, P: ArrayLike) -> dict[str, float]:
    """Measure both, by name."""
    return {"nUPE": nupe(held_out, P), "nCPE": ncpe(held_out, P)}
