"""The distinct products of an array's columns: of all k² products a_i a_j only k(k+1)/2 differ.

They are formed around a ring: of column i with itself, then with the next one, then with the one after that, until
half the way round. So the products at one distance are one operation on two blocks of memory, and those at all
distances are one operation too: a view in which the second factor moves on. Threads, which wait for each other at
every operation, are then held up a tenth as often as by an operation a column.
"""

import numpy as np


def n_pairs(k: int) -> int:
    """Count the distinct products of k columns.

    Parameters
    ----------
    k : int
        Number of columns.

    Returns
    -------
    int
        `k(k+1)/2`.
    """
    return k * (k + 1) // 2


def pairs(k: int) -> tuple[np.ndarray, np.ndarray]:
    """List the pairs of columns in the order of `distinct_products`.

    Parameters
    ----------
    k : int
        Number of columns.

    Returns
    -------
    i : ndarray of shape (k(k+1)/2,), int
        The first columns.
    j : ndarray of shape (k(k+1)/2,), int
        The second columns.
    """
    distance, i = np.divmod(np.arange(n_pairs(k)), k)
    return i, (i + distance) % k


def pair_index(k: int) -> np.ndarray:
    """Find where the product of columns i and j stands among the distinct ones.

    Parameters
    ----------
    k : int
        Number of columns.

    Returns
    -------
    ndarray of shape (k, k), int
        Indices into `distinct_products`.
    """
    index = np.empty((k, k), dtype=np.intp)
    i, j = pairs(k)
    index[i, j] = index[j, i] = np.arange(len(i))
    return index


def distinct_products(
    A: np.ndarray, weights: np.ndarray | None = None, out: np.ndarray | None = None
) -> np.ndarray:
    """Multiply the columns of A with each other, `ω a_i a_j`.

    Parameters
    ----------
    A : ndarray of shape (N, k)
        Columns.
    weights : ndarray of shape (N,), optional
        Weights ω, 1 by default.
    out : ndarray of shape (k(k+1)/2, N), optional
        Where they may be written.

    Returns
    -------
    ndarray of shape (k(k+1)/2, N)
        In the order of `pairs`.
    """
    N, k = A.shape
    ring = np.empty((k + k // 2, N))
    ring[:k], ring[k:] = A.T, A.T[: k // 2]
    # k products, where weighing what comes out would be k(k+1)/2.
    once = ring[:k] if weights is None else ring[:k] * weights
    products = np.empty((n_pairs(k), N)) if out is None else out
    # Halfway round a ring of even length, every pair comes up twice.
    distances = (k + 1) // 2
    row, number = ring.strides
    moved = np.ndarray((distances, k, N), ring.dtype, ring, strides=(row, row, number))
    np.multiply(once, moved, out=products[: distances * k].reshape(distances, k, N))
    if k % 2 == 0:
        np.multiply(once[: k // 2], ring[k // 2 : k], out=products[distances * k :])
    return products


def unfold(products: np.ndarray, M: int, d: int) -> np.ndarray:
    """Assemble the matrix H from its distinct entries.

    Parameters
    ----------
    products : ndarray of shape (..., M(M+1)/2, d(d+1)/2)
        Products of features, times products of directions.
    M, d : int
        Numbers of features and of actions.

    Returns
    -------
    ndarray of shape (..., dM, dM)
        H.
    """
    k, j = pair_index(M)[None, :, None, :], pair_index(d)[:, None, :, None]
    index = (k * n_pairs(d) + j).reshape(d * M, d * M)
    # One pass over H, which of many large models is larger than the processor's cache by far.
    return products.reshape(*products.shape[:-2], -1).take(index, axis=-1)
