"""What was read of files and may soon be asked for again, as long as the memory has room for it."""

from threading import Lock
from typing import Any
from weakref import WeakKeyDictionary

from unconstrain.memory import available_memory

SHARE = 0.25
"""Of the memory that is left, how much may be taken."""

_kept: WeakKeyDictionary[Any, tuple[Any, int]] = WeakKeyDictionary()
_lock = Lock()


def keep(owner: object, value: object, n_bytes: int) -> None:
    """Keep a value until its owner is gone, or others need the room; one that is too large is not kept at all.

    Parameters
    ----------
    owner : object
        The file, opened. It does not hold the value, which would travel to other processes with it.
    value : object
    n_bytes : int
        Its size.
    """
    left = available_memory()
    with _lock:
        _kept.pop(owner, None)
        taken = sum(size for _, size in _kept.values())
        # What is kept already is not among what is left.
        room = float("inf") if left is None else SHARE * (left + taken)
        if n_bytes > room:
            return
        for oldest in list(_kept):
            if taken + n_bytes <= room:
                break
            taken -= _kept.pop(oldest)[1]
        _kept[owner] = (value, n_bytes)


def find(owner: object) -> Any:
    """Return what is kept for an owner, or None.

    Parameters
    ----------
    owner : object

    Returns
    -------
    object or None
    """
    with _lock:
        return _kept.get(owner, (None, 0))[0]
