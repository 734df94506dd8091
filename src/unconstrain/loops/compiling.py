"""How loops are compiled."""

from collections.abc import Callable
from typing import Any

from numba import njit

REORDER = {"reassoc", "contract", "arcp", "nsz"}
"""Sums may be taken in any order, or they could not be taken several at a time. NaN and infinity stay what they are."""


def compiled(
    *signature: Any, nogil: bool = True, exact: bool = False
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Compile a function, and keep the result on disk where there is a place for it.

    Parameters
    ----------
    *signature : numba type
        Of the one kind of call that there is, for which it is compiled at once; without it the function is compiled
        when it is first called.
    nogil : bool
        Whether other threads run meanwhile.
    exact : bool
        Whether every operation is rounded as NumPy rounds it, and none put in another order.

    Returns
    -------
    callable
        A decorator.
    """
    make: Any = njit
    options: dict[str, Any] = {"nogil": nogil, "fastmath": not exact and REORDER, "error_model": "numpy"}

    def decorate(function: Callable[..., Any]) -> Callable[..., Any]:
        try:
            return make(*signature, cache=True, **options)(function)
        except RuntimeError:  # nowhere to keep it
            return make(*signature, **options)(function)

    return decorate
