"""LAPACK's reduction of a symmetric matrix to three diagonals, without the interpreter's lock.

SciPy's own wrapper keeps the lock, so that threads wait for each other where many matrices are reduced side by side.
The same routine is in `scipy.linalg.cython_lapack`, the interface for compiled code, and called there it is without.
"""

import ctypes
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

N_INTEGERS, N_ARGUMENTS = 4, 10
"""Of the routine: n, lda, lwork and info, among ten. Where integers have another width they are not called `int`."""


def sytrd(stack: np.ndarray, diagonal: np.ndarray, beside: np.ndarray, factors: np.ndarray) -> None:
    """Reduce matrices to three diagonals, `dsytrd` of the lower triangle of each one's transpose.

    Parameters
    ----------
    stack : ndarray of shape (S, P, P)
        Symmetric, stored a row after the other. Overwritten: of the transpose of each, what is below the diagonal
        beside the main one are the reflectors.
    diagonal : ndarray of shape (S, P)
        Written to: the main one.
    beside : ndarray of shape (S, P - 1)
        Written to: the one beside it.
    factors : ndarray of shape (S, P - 1)
        Written to: of the reflectors.
    """
    routine, P = _routine(), stack.shape[1]
    lwork = _workspace(P)
    if routine is None:
        from scipy.linalg.lapack import dsytrd

        for m in range(len(stack)):
            stack[m].T[:], diagonal[m], beside[m], factors[m], _ = dsytrd(stack[m].T, lower=1, lwork=lwork)
        return
    work = np.empty(lwork)
    n, size, info = ctypes.c_int(P), ctypes.c_int(lwork), ctypes.c_int(0)
    order, last = ctypes.byref(n), (work.ctypes.data, ctypes.byref(size), ctypes.byref(info))
    triangle = ctypes.c_char_p(b"L")
    written = (stack, diagonal, beside, factors)
    begins, strides = [each.ctypes.data for each in written], [each.strides[0] for each in written]
    for m in range(len(stack)):
        matrix, *vectors = (begin + m * stride for begin, stride in zip(begins, strides, strict=True))
        routine(triangle, order, matrix, order, *vectors, *last)


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
