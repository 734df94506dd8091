"""What a policy is measured by: risks that differ only in the projection before the error.

Every risk here is a mean over samples of a squared error behind a projection,

    E = 1/N Σ_n ‖Q_n (u_n - p_n)‖²,        p_n = model(x_n),

where the rows of `Q_n` (k x d) say what of the action is looked at:

| risk          | Q_n            | error of a sample        | needs            |
| ------------- | -------------- | ------------------------ | ---------------- |
| direct        | I              | ‖u_n - p_n‖²             | data             |
| constrained   | N_n            | ‖u_n - N_n p_n‖²         | true projections |
| inconsistency | û_nᵀ           | (r_n - û_nᵀ p_n)²        | data             |
| auto          | N_n or û_nᵀ    | whichever is known       | some projections |

with `r = ‖u‖` and `û = u / r`. `û ûᵀ` projects onto a line that surely lies in the image of the unknown
`N`, so the true policy has no inconsistency, whatever the constraints were. "auto" uses the projection of every
sample whose constraint is known (measured, computed, learnt) and the line of every other. For every model

    inconsistency <= auto <= constrained policy error <= unconstrained policy error.

What is known of a sample that does not move counts as well: `N pi = 0` there. Without it there is nothing to see.

Source: Howard, Klanke, Gienger, Goerick, Vijayakumar, ICRA 2009, equations (4) to (7).
"""

import numpy as np

from unconstrain.arrays import check_actions, check_projections
from unconstrain.errors import DataError
from unconstrain.fitting.observation import errors, sight
from unconstrain.motion import directions


def inconsistency(U, P) -> float:
    """Mean inconsistency `1/N Σ (r_n - û_nᵀ p_n)²` of predictions P (N, d) with actions U (N, d).

    In squared units of the action. Zero actions have no direction: they add nothing to the sum and are
    counted in N, so that `inconsistency <= constrained_policy_error` holds for every model and data.
    """
    U, P = _pair(U, P, "actions", "predictions")
    unit, r = directions(U)
    return float(np.mean((r - np.einsum("nd,nd->n", unit, P)) ** 2))


def direct(U, P) -> float:
    """Mean direct risk `1/N Σ ‖u_n - p_n‖²`, what ordinary regression minimises. U, P (N, d)."""
    U, P = _pair(U, P, "actions", "predictions")
    return float(np.mean(np.sum((U - P) ** 2, axis=1)))


def auto(U, P, N) -> float:
    """Mean risk of what is known, `1/N Σ ‖Q_n (u_n - p_n)‖²`: Q is the projection, or ûᵀ where that is not known.

    In squared units of the action. U (N, d) actions, P (N, d) predictions, N (N, d, d) projections, those not known
    all NaN. Zero actions whose projection is not known add nothing, and are counted, as in `inconsistency`.
    """
    U, P = _pair(U, P, "actions", "predictions")
    seen = sight("auto", U, check_projections(N, *U.shape, unknown=True))
    return float(np.mean(errors(seen, P)))


def constrained_policy_error(Pi, P, N) -> float:
    """CPE, `1/N Σ ‖N_n (pi_n - p_n)‖²`: the error that shows under the constraints N (N, d, d).

    Pi (N, d) is the true policy or the constrained action `N pi`, which give the same; P (N, d) predictions.
    """
    Pi, P = _pair(Pi, P, "the true policy", "predictions")
    N = check_projections(N, *Pi.shape)
    return float(np.mean(np.sum(np.einsum("nij,nj->ni", N, Pi - P) ** 2, axis=1)))


def projected_policy_error(Pi, N, learnt) -> float:
    """PPE, `1/N Σ ‖N_n pi_n - Ñ_n pi_n‖²`: how otherwise than the true constraint a learnt one would bend the policy.

    Pi (N, d) true policy, N and learnt (N, d, d) true and learnt projections. `normalized(error, Pi)` is the nPPE,
    `PPE / Σ_j var(pi_j)`. Source: Lin, Howard, Vijayakumar, ICRA 2015.
    """
    Pi = check_actions(Pi, "the true policy")
    N, learnt = check_projections(N, *Pi.shape), check_projections(learnt, *Pi.shape)
    return float(np.mean(np.sum(np.einsum("nij,nj->ni", N - learnt, Pi) ** 2, axis=1)))


def projected_observation_error(U, learnt) -> float:
    """POE, `1/N Σ ‖u_n - Ñ_n u_n‖²`: motion that a learnt constraint would have blocked, though it was seen.

    U (N, d) actions (or their nullspace component), learnt (N, d, d). Needs no truth. `normalized(error, U)` is the
    nPOE, `POE / Σ_j var(u_j)`. Source: Lin, Howard, Vijayakumar, ICRA 2015.
    """
    U = check_actions(U)
    learnt = check_projections(learnt, *U.shape)
    return float(np.mean(np.sum((U - np.einsum("nij,nj->ni", learnt, U)) ** 2, axis=1)))


def unconstrained_policy_error(Pi, P) -> float:
    """UPE, `1/N Σ ‖pi_n - p_n‖²`, of predictions P (N, d) against the true policy Pi (N, d)."""
    return direct(Pi, P)


def normalized(error: float, Pi) -> float:
    """`error / Σ_j var(pi_j)`: a mean error as a share of the true policy's variance over the samples Pi (N, d).

    Turns the errors of this module into the paper's nUPE, nCPE and normalised inconsistency. Where the true
    policy is not known, the actions may stand for it. Raises `DataError` if Pi does not vary.
    """
    variance = float(np.sum(np.var(check_actions(Pi, "the true policy"), axis=0)))
    if variance == 0.0:
        raise DataError(
            "the true policy is the same at every sample, so no error can be a share of its variance"
        )
    return error / variance


def _pair(A, B, name_a: str, name_b: str) -> tuple[np.ndarray, np.ndarray]:
    A, B = check_actions(A, name_a), check_actions(B, name_b)
    if A.shape != B.shape:
        raise DataError(f"{name_a} {A.shape} and {name_b} {B.shape} must have the same shape")
    if not len(A):
        raise DataError("no samples: a mean error needs at least one")
    return A, B
