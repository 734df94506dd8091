"""Inner loops that numba compiles, where it is installed (extra `fast`), a file for each part that has some.

Each has its counterpart in NumPy beside what calls it, which is what runs without numba and what tests compare with.
"""

from functools import cache
from importlib import import_module
from types import ModuleType

WORTH = 50_000
"""Samples below which NumPy is done before compiled code is loaded."""


@cache
def load(name: str) -> ModuleType | None:
    """Import compiled loops.

    Parameters
    ----------
    name : str
        Of the file here.

    Returns
    -------
    module or None
        None where numba is not installed, or does not run here.
    """
    try:
        return import_module(f"{__name__}.{name}")
    except ImportError:
        return None


def load_for(n_samples: int, name: str) -> ModuleType | None:
    """Import compiled loops where there are enough samples for them.

    Parameters
    ----------
    n_samples : int
        How many samples there are.
    name : str
        Of the file here.

    Returns
    -------
    module or None
        None where NumPy is faster, or has to do.
    """
    return load(name) if n_samples >= WORTH else None
