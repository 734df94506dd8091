"""Moments of samples that are seen along their motion, made and added up tile by tile."""

import numpy as np

from unconstrain.loops.compiling import compiled

SAMPLES = 128
"""In a tile: all that is made of them stays in a core's innermost caches."""


@compiled()
def add_product(A: np.ndarray, C: np.ndarray, S: np.ndarray) -> None:
    """Add `A Cᵀ` of a tile to S, four by four, so that what is loaded is used four times.

    Parameters
    ----------
    A : ndarray of shape (p, SAMPLES)
        p is a multiple of four.
    C : ndarray of shape (q, SAMPLES)
        q is a multiple of four.
    S : ndarray of shape (p, q)
        Added to.
    """
    for p in range(0, A.shape[0], 4):
        for q in range(0, C.shape[0], 4):
            s00 = s01 = s02 = s03 = s10 = s11 = s12 = s13 = 0.0
            s20 = s21 = s22 = s23 = s30 = s31 = s32 = s33 = 0.0
            for t in range(SAMPLES):
                a0, a1, a2, a3 = A[p, t], A[p + 1, t], A[p + 2, t], A[p + 3, t]
                c0, c1, c2, c3 = C[q, t], C[q + 1, t], C[q + 2, t], C[q + 3, t]
                s00, s01, s02, s03 = s00 + a0 * c0, s01 + a0 * c1, s02 + a0 * c2, s03 + a0 * c3
                s10, s11, s12, s13 = s10 + a1 * c0, s11 + a1 * c1, s12 + a1 * c2, s13 + a1 * c3
                s20, s21, s22, s23 = s20 + a2 * c0, s21 + a2 * c1, s22 + a2 * c2, s23 + a2 * c3
                s30, s31, s32, s33 = s30 + a3 * c0, s31 + a3 * c1, s32 + a3 * c2, s33 + a3 * c3
            S[p, q] += s00
            S[p, q + 1] += s01
            S[p, q + 2] += s02
            S[p, q + 3] += s03
            S[p + 1, q] += s10
            S[p + 1, q + 1] += s11
            S[p + 1, q + 2] += s12
            S[p + 1, q + 3] += s13
            S[p + 2, q] += s20
            S[p + 2, q + 1] += s21
            S[p + 2, q + 2] += s22
            S[p + 2, q + 3] += s23
            S[p + 3, q] += s30
            S[p + 3, q + 1] += s31
            S[p + 3, q + 2] += s32
            S[p + 3, q + 3] += s33


@compiled()
def add_along_motion(
    B: np.ndarray,
    U: np.ndarray,
    inverse: np.ndarray,
    weights: np.ndarray,
    of_basis: tuple[np.ndarray, np.ndarray],
    of_directions: tuple[np.ndarray, np.ndarray],
    products: np.ndarray,
    pulls: np.ndarray,
) -> None:
    """Add distinct products of features times those of directions, and what samples pull at.

    Parameters
    ----------
    B : ndarray of shape (M, N)
        The basis at the states.
    U : ndarray of shape (d, N)
        Actions, of any precision.
    inverse : ndarray of shape (N,)
        `1/‖u‖`, zero where nothing moves.
    weights : ndarray of shape (N,) or (0,)
        Weight of each sample; none stands for 1.
    of_basis, of_directions : tuple of ndarray
        First and second factors of the distinct products, as `products.pairs` lists them.
    products : ndarray
        Of at least (M(M+1)/2, d(d+1)/2), both rounded up to multiples of four: `Σ ω b_i b_j û_k û_l` is added.
    pulls : ndarray
        Of at least (d, M), rounded up likewise: `Σ ω u_k b_i` is added, where the sample moves.
    """
    M, N = B.shape
    d = U.shape[0]
    A, C = np.zeros((products.shape[0], SAMPLES)), np.zeros((products.shape[1], SAMPLES))
    basis, pulled = np.zeros((pulls.shape[1], SAMPLES)), np.zeros((pulls.shape[0], SAMPLES))
    directions, weighed = np.zeros((d, SAMPLES)), np.zeros((d, SAMPLES))
    for start in range(0, N, SAMPLES):
        n = min(SAMPLES, N - start)
        if n < SAMPLES:
            A[:], C[:], basis[:], pulled[:] = 0.0, 0.0, 0.0, 0.0
        for i in range(M):
            for t in range(n):
                basis[i, t] = B[i, start + t]
        for k in range(d):
            for t in range(n):
                u = np.float64(U[k, start + t])
                directions[k, t] = weighed[k, t] = u * inverse[start + t]
                pulled[k, t] = u if inverse[start + t] > 0.0 else 0.0
            if len(weights):
                for t in range(n):
                    weighed[k, t] *= weights[start + t]
                    pulled[k, t] *= weights[start + t]
        for p in range(len(of_basis[0])):
            i, j = of_basis[0][p], of_basis[1][p]
            for t in range(n):
                A[p, t] = basis[i, t] * basis[j, t]
        for q in range(len(of_directions[0])):
            k, m = of_directions[0][q], of_directions[1][q]
            for t in range(n):
                C[q, t] = directions[k, t] * weighed[m, t]
        add_product(A, C, products)
        add_product(pulled, basis, pulls)
