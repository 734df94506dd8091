"""Whether loops compiled by numba are there, and from how many samples on they are worth their start."""

from functools import cache
from types import ModuleType

WORTH = 50_000
"""Samples below which NumPy is done before compiled code is loaded."""


@cache
def load() -> ModuleType | None:
    """Import the compiled loops.

    Returns
    -------
    module or None
        None where numba is not installed, or does not run here.
    """
    try:
        from unconstrain.fitting.kernels import jit
    except ImportError:
        return None
    return jit


def load_for(n_samples: int) -> ModuleType | None:
    """Import the compiled loops where there are enough samples for them.

    Parameters
    ----------
    n_samples : int
        How many samples there are.

    Returns
    -------
    module or None
        None where NumPy is faster, or has to do.
    """
    return load() if n_samples >= WORTH else None
