"""How loops are compiled."""

from collections.abc import Callable
from typing import Any

from numba import njit

REORDER = {"reassoc", "contract", "arcp", "nsz"}
"""Sums may be taken in any order, or they could not be taken several at a time. NaN and infinity stay what they are."""


def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function when it is first called, and keep the result on disk where there is a place for it."""
    options: dict[str, Any] = {"nogil": True, "fastmath": REORDER, "error_model": "numpy"}
    try:
        return njit(cache=True, **options)(function)
    except RuntimeError:  # nowhere to keep it
        return njit(**options)(function)
