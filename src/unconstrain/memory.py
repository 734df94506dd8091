"""Refuse in a sentence what would not fit into memory, before it is allocated."""

import os
from pathlib import Path

from unconstrain.errors import DataError

GIGABYTE = 1e9
NO_MATTER = 1e6
"""Bytes of which nobody asks: to look how much is left takes longer than a step of a rollout, or a short episode."""
CONTAINER = Path("/sys/fs/cgroup")
"""Where Linux says how much memory a container may take."""


def check_memory(n_bytes: float, what: str, remedy: str) -> None:
    """Check that an array fits into the memory that is left.

    Parameters
    ----------
    n_bytes : float
        Size of all that has to be held at a time, in bytes.
    what : str
        What it is, as the subject of a sentence in the singular: "the moments of 24,000 parameters".
    remedy : str
        What to do instead: "choose fewer centres".

    Raises
    ------
    DataError
        If there is less memory than that. Where the operating system does not say how much there is, nothing is
        refused.
    """
    if n_bytes < NO_MATTER:
        return
    left = available_memory()
    if left is not None and n_bytes > left:
        needed, free = (
            f"{size / GIGABYTE:,.1f} GB" if size < 1e18 else f"{size / GIGABYTE:.0e} GB"
            for size in (n_bytes, left)
        )
        raise DataError(f"{what} would take {needed} of memory, and {free} are left: {remedy}")


def available_memory() -> float | None:
    """Ask the operating system how much memory this process can still take.

    Returns
    -------
    float or None
        Bytes: the least that the machine, the container and the limits of the process leave. None where nothing is
        known.
    """
    known = [
        size for size in (_left_on_machine(), _left_in_container(), _left_to_process()) if size is not None
    ]
    return min(known, default=None)


def _left_on_machine() -> float | None:
    try:
        for line in Path("/proc/meminfo").read_text().splitlines():
            if line.startswith("MemAvailable:"):
                return 1024.0 * int(line.split()[1])
        return float(os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    except (OSError, ValueError, AttributeError):
        return None


def _left_in_container() -> float | None:
    try:
        limit = (CONTAINER / "memory.max").read_text().strip()
        taken = int((CONTAINER / "memory.current").read_text())
        return None if limit == "max" else max(0.0, float(int(limit) - taken))
    except (OSError, ValueError):
        return None


def _left_to_process() -> float | None:
    try:
        import resource

        limit, _ = resource.getrlimit(resource.RLIMIT_AS)
        taken = int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    except (ImportError, OSError, ValueError):
        return None
    return None if limit == resource.RLIM_INFINITY else max(0.0, float(limit - taken))
