"""What is inverted in place of H: H of a subset of samples.

With v the rows that a random subset of the samples says `vᵀw` by, and V_s of them, n of N,

    H + λ ≈ (N/n) V_sᵀV_s + λ,    and    ((N/n) V_sᵀV_s + λ)⁻¹ = (1 - V_sᵀ (V_sV_sᵀ + λn/N)⁻¹ V_s) / λ,

so that what is decomposed is as large as the subset, however many parameters there are. Where most samples show the
whole action, A is nearly a multiple of the identity; the actions then share a subset of the basis, d times as many
samples.

References
----------
Rudi, Carratino, Rosasco, FALKON: an optimal large scale kernel method, NeurIPS 2017, where the subset are centres; here
in the dual form, since there are fewer samples than parameters in it.
"""

from collections.abc import Callable

import numpy as np

from unconstrain.fitting.kernels.products import pairs
from unconstrain.fitting.wide.passes import Passes
from unconstrain.parallel import cut_blocks

MOST_ROWS = 5_000
"""Rows of the subset: 200 MB."""

WORTH = 50
"""To decompose it may take as long as so many passes: with fewer rows there are more of those."""

ROWS = 2**9

ISOTROPIC = 0.1
"""Share of what samples say that they say in all directions alike, from which on A is taken for a multiple of one."""

SEEN = 1e-3
"""Rows of A that say less than this share of the most are left out."""

Solve = Callable[[np.ndarray], np.ndarray]


class Subset:
    """A subset of the samples of some passes, drawn by chance but the same each time.

    Parameters
    ----------
    passes : Passes
        Over all samples.
    most_rows : int, optional
        Rows at most; by default as many as are worth their work.
    """

    def __init__(self, passes: Passes, most_rows: int | None = None):
        if most_rows is None:
            work = 4 * passes.n_samples * passes.n_functions * passes.n_actions
            most_rows = min(MOST_ROWS, int(np.cbrt(3 * WORTH * work)))
        A, numbers, places = _draw(passes, most_rows)
        d = passes.n_actions
        values, vectors = np.linalg.eigh(A)
        values = np.maximum(values, 0.0)
        total = float(values.sum())
        self.is_isotropic = total == 0.0 or d * float(values[:, 0].sum()) >= ISOTROPIC * total
        if self.is_isotropic:
            which, scale = np.arange(len(A)), np.sqrt(values.mean(axis=1))
            self.directions = None
        else:
            counts = values > SEEN * values[:, -1:]
            which, column = np.nonzero(counts)
            if len(which) > most_rows:
                which, column = which[:most_rows], column[:most_rows]
            scale = np.sqrt(values[which, column])
            self.directions = np.ascontiguousarray(vectors[which, :, column])
        n_drawn = int(which[-1]) + 1 if len(which) else 1
        B = np.empty((n_drawn, passes.n_functions))
        for number in np.unique(numbers[:n_drawn]).tolist():
            those = np.flatnonzero(numbers[:n_drawn] == number)
            B[those] = passes.basis(number)[places[those]]
        self.rows = B[which]
        self.rows *= (np.sqrt(passes.n_samples / n_drawn) * scale)[:, None]

    def factorize(self, decay: float) -> Solve:
        """Decompose `V_sV_sᵀ + λ`.

        Parameters
        ----------
        decay : float
            λ, above zero.

        Returns
        -------
        callable
            Multiplies arrays (M, L, d) by the inverse of `V_sᵀV_s + λ`.
        """
        from scipy.linalg import cho_factor, cho_solve

        V, q = self.rows, self.directions
        K = V @ V.T
        if q is not None:
            for rows in cut_blocks(len(K), ROWS):
                K[rows] *= q[rows] @ q.T
        K[np.diag_indices(len(K))] += decay
        # The transpose of what is symmetric lies in memory as LAPACK wants it.
        factor = cho_factor(K.T, lower=True, overwrite_a=True, check_finite=False)

        def solve(R: np.ndarray) -> np.ndarray:
            M, L, d = R.shape
            if q is None:
                seen = cho_solve(factor, V @ R.reshape(M, -1), check_finite=False)
                back = (V.T @ seen).reshape(R.shape)
            else:
                along = np.einsum("nld,nd->nl", (V @ R.reshape(M, -1)).reshape(-1, L, d), q)
                seen = cho_solve(factor, along, check_finite=False)
                back = (V.T @ (seen[:, :, None] * q[:, None]).reshape(len(V), -1)).reshape(R.shape)
            return np.asarray((R - back) / decay)

        return solve


def _draw(passes: Passes, most_rows: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Draw samples: A (n, d, d) of each with its weight, the number of its block, and its place there."""
    sizes = [len(block.Z) for block in passes.blocks]
    starts = np.concatenate([[0], np.cumsum(sizes)])
    n = min(passes.n_samples, most_rows)
    chosen = np.random.default_rng(0).permutation(passes.n_samples)[:n]
    numbers = np.searchsorted(starts, chosen, side="right") - 1
    places = chosen - starts[numbers]
    d = passes.n_actions
    i, j = pairs(d)
    A = np.empty((n, d, d))
    for number in np.unique(numbers).tolist():
        block, those = passes.blocks[number], np.flatnonzero(numbers == number)
        weights = None if block.weights is None else block.weights[places[those]]
        products = block.observation[places[those]].products(weights)
        A[those[:, None], i, j] = products.T
        A[those[:, None], j, i] = products.T
    return A, numbers, places
