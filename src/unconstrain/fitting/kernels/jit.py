"""Inner loops that numba compiles; `fast.load` imports them where it is installed (extra `fast`).

Each has its counterpart in NumPy beside what calls it, which is what runs without numba and what tests compare with.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit

SAMPLES = 128
"""In a tile: all that is made of them stays in a core's innermost caches."""

REORDER = {"reassoc", "contract", "arcp", "nsz"}
"""Sums may be taken in any order, or they could not be taken several at a time. NaN and infinity stay what they are."""


def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function when it is first called, and keep the result on disk where there is a place for it."""
    options: dict[str, Any] = {"nogil": True, "fastmath": REORDER, "error_model": "numpy"}
    try:
        return njit(cache=True, **options)(function)
    except RuntimeError:  # nowhere to keep it
        return njit(**options)(function)


@compiled
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


@compiled
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


@compiled
def first_rows(
    Z: np.ndarray, edge: np.ndarray, shift: float, factor: float, limit: float, rows: np.ndarray
) -> int:
    """Find the first state in each box of a grid.

    Parameters
    ----------
    Z : ndarray of shape (N, m)
        States, of any precision.
    edge : ndarray of shape (m,)
        Of the finest boxes; those asked for are `floor((floor(z / edge) + shift) factor)`.
    shift, factor, limit : float
        Finest boxes are numbered up to `limit`.
    rows : ndarray of shape (K,), int64
        Written to: the indices of the states found.

    Returns
    -------
    int
        How many; -1 where there are more than K.
    """
    N, m = Z.shape
    places = 4 * len(rows)  # a power of two
    table = np.full(places, -1, np.int64)
    boxes = np.empty((len(rows), m))
    box = np.empty(m)
    found = 0
    for n in range(N):
        mixed = np.uint64(0)
        for j in range(m):
            finest = min(max(np.floor(np.float64(Z[n, j]) / edge[j]), -limit), limit)
            box[j] = np.floor((finest + shift) * factor)
            mixed = (mixed + np.uint64(np.int64(box[j]))) * np.uint64(0x9E3779B97F4A7C15)
            mixed ^= mixed >> np.uint64(29)
        at = np.int64(mixed & np.uint64(places - 1))
        while table[at] >= 0:
            same = True
            for j in range(m):
                if boxes[table[at], j] != box[j]:
                    same = False
                    break
            if same:
                break
            at = (at + 1) & (places - 1)
        if table[at] < 0:
            if found == len(rows):
                return -1
            table[at] = found
            boxes[found] = box
            rows[found] = n
            found += 1
    return found


@compiled
def sweep(steps: np.ndarray, rows: np.ndarray) -> None:
    """Compute the rows `r_t = r_{t-1} M_t`, each scaled to sum to one, from the row (1/2, 1/2).

    Parameters
    ----------
    steps : ndarray of shape (N, 2, 2)
        M.
    rows : ndarray of shape (N, 2)
        Written to.
    """
    a = b = 0.5
    for t in range(len(steps)):
        first = a * steps[t, 0, 0] + b * steps[t, 1, 0]
        second = a * steps[t, 0, 1] + b * steps[t, 1, 1]
        total = first + second
        a, b = first / total, second / total
        rows[t, 0], rows[t, 1] = a, b
