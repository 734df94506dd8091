"""What the fits are measured against: BLAS itself, on the same shapes, and the published algorithm as a loop."""

from collections.abc import Callable

import numpy as np
from scipy.linalg.blas import dsyrk


def dsyrk_in_blocks(n_parameters: int, n_samples: int, block: int = 512) -> Callable[[], object]:
    """`Σ v vᵀ` by dsyrk for n_samples vectors that are already there, in blocks that stay in the cache."""
    V = np.asfortranarray(np.random.default_rng(0).standard_normal((n_parameters, block)))

    def run():
        H = np.zeros((n_parameters, n_parameters), order="F")
        for _ in range(0, n_samples, block):
            H = dsyrk(1.0, V, beta=1.0, c=H, overwrite_c=True)
        return H

    return run


def dgemm(rows: int, inner: int, columns: int) -> Callable[[], object]:
    """One product of a rows x inner with an inner x columns matrix, both already there."""
    rng = np.random.default_rng(0)
    A, B = rng.standard_normal((rows, inner)), rng.standard_normal((inner, columns))
    return lambda: A @ B


def published_local_fit(
    X: np.ndarray, U: np.ndarray, centers: np.ndarray, width: float, alpha: float
) -> np.ndarray:
    """Local models by the algorithm as published: one outer product per sample per model. Returns w (M, d(n+1))."""
    n, d = X.shape[1], U.shape[1]
    solutions = np.empty((len(centers), d * (n + 1)))
    for m, center in enumerate(centers):
        H, g = np.zeros((d * (n + 1), d * (n + 1))), np.zeros(d * (n + 1))
        for x, u in zip(X, U, strict=True):
            r = np.linalg.norm(u)
            v = np.kron(u / r, np.append(x, 1.0))
            w = np.exp(-np.sum((x - center) ** 2) / (2 * width**2))
            H += w * np.outer(v, v)
            g += w * r * v
        solutions[m] = np.linalg.solve(H + alpha * np.eye(len(g)), g)
    return solutions
