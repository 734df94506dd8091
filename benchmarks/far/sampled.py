"""What is lost if contact is inferred from a sample of the episodes, and the rest is read once."""

import numpy as np

import unconstrain as uc
from benchmarks.fits import draw_half_free

DIMENSIONS = 7


def measure_sampled(n_rows: int, shares: tuple[float, ...]) -> dict[tuple[int, str], float]:
    """Return errors beside the true policy, by the rows that contact is inferred from and what follows.

    Errors are mean squares as a share of the policy's own.
    """
    X, U, groups = draw_half_free(n_rows, DIMENSIONS)
    errors = {}
    for share in (*shares, 1.0):
        part = groups < share * (groups.max() + 1)
        policy = _policy(X).fit(X[part], U[part], groups=groups[part])
        errors[int(part.sum()), ""] = _error(policy, X)
        if not part.all():
            policy.partial_fit(X[~part], U[~part], groups=groups[~part])
            errors[int(part.sum()), "one pass over the others"] = _error(policy, X)
    return errors


def _policy(X: np.ndarray) -> uc.LocallyLinearPolicy:
    return uc.LocallyLinearPolicy(centers=X[:: len(X) // 14][:14].copy())


def _error(policy: uc.LocallyLinearPolicy, X: np.ndarray) -> float:
    Pi = np.sin(X) - 2.0 * X
    return float(np.mean((policy.predict(X) - Pi) ** 2) / np.mean(Pi**2))
