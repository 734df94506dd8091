"""LAPACK's reduction of a symmetric matrix to three diagonals, without the interpreter's lock.

SciPy's own wrapper keeps the lock, so that threads wait for each other where many matrices are reduced side by side.
The same routine is in `scipy.linalg.cython_lapack`, the interface for compiled code, and called there it is without.
"""

import ctypes
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

Reduced = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]

N_INTEGERS, N_ARGUMENTS = 4, 10
"""Of the routine: n, lda, lwork and info, among ten. Where integers have another width they are not called `int`."""


def sytrd(H: np.ndarray) -> Reduced:
    """Reduce a matrix to three diagonals.

    Parameters
    ----------
    H : ndarray of shape (P, P)
        Symmetric.

    Returns
    -------
    held : ndarray of shape (P, P)
        Reflectors, below the diagonal beside the main one.
    diagonal : ndarray of shape (P,)
        The main one.
    beside : ndarray of shape (P - 1,)
        The one beside it.
    factors : ndarray of shape (P - 1,)
        Of the reflectors.
    """
    routine, P = _routine(), len(H)
    lwork = _workspace(P)
    if routine is None:
        from scipy.linalg.lapack import dsytrd

        held, diagonal, beside, factors, _ = dsytrd(H.T, lower=1, lwork=lwork)
        return held, diagonal, beside, factors
    held, work = np.array(H, dtype=np.float64, order="C"), np.empty(lwork)
    diagonal, beside, factors = np.empty(P), np.empty(P - 1), np.empty(P - 1)
    n, size, info = ctypes.c_int(P), ctypes.c_int(lwork), ctypes.c_int(0)
    matrix, *arrays = [each.ctypes.data for each in (held, diagonal, beside, factors, work)]
    order, integers = ctypes.byref(n), (ctypes.byref(size), ctypes.byref(info))
    routine(ctypes.c_char_p(b"L"), order, matrix, order, *arrays, *integers)
    return held.T, diagonal, beside, factors


@cache
def _workspace(P: int) -> int:
    from scipy.linalg.lapack import dsytrd_lwork

    return int(dsytrd_lwork(P, lower=1)[0])


@cache
def _routine() -> Callable[..., Any] | None:
    """Find the routine; None where it does not take what is expected."""
    from scipy.linalg import cython_lapack

    capsule = getattr(cython_lapack, "__pyx_capi__", {}).get("dsytrd")
    if capsule is None:
        return None
    name_of, address_of = ctypes.pythonapi.PyCapsule_GetName, ctypes.pythonapi.PyCapsule_GetPointer
    name_of.restype, name_of.argtypes = ctypes.c_char_p, [ctypes.py_object]
    address_of.restype, address_of.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
    signature: Any = name_of(capsule)
    if signature.count(b"int *") != N_INTEGERS or signature.count(b",") != N_ARGUMENTS - 1:
        return None
    address: Any = address_of(capsule, signature)
    return ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * N_ARGUMENTS)(address)
