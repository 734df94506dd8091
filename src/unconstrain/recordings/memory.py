"""Whether arrays fit into this computer, told before they are allocated."""

import os

from unconstrain.errors import DataError


def check_memory(needed: float, what: str, remedy: str) -> None:
    """Refuse what is larger than the memory of this computer.

    Parameters
    ----------
    needed : float
        Bytes.
    what : str
        What takes them: the beginning of a sentence.
    remedy : str
        What to do instead: its end.

    Raises
    ------
    DataError
        There is less memory than that.
    """
    there_is = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") if hasattr(os, "sysconf") else None
    if there_is is not None and needed > there_is:
        raise DataError(
            f"{what} takes {needed / 1e9:,.0f} GB, and this computer has {there_is / 1e9:,.0f} GB: {remedy}"
        )
