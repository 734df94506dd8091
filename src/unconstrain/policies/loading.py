"""Policies read back from files."""

from collections.abc import Iterable
from os import PathLike
from typing import Any

from unconstrain.policies.base import Policy, check_usable
from unconstrain.storage import Kind, load_object


def load_policy(path: str | PathLike[str], *, trusted: Iterable[Any] = ()) -> Policy:
    """Read a policy that `policy.save(path)` wrote.

    Nothing in the file is run, whoever wrote it: it can hold arrays, numbers, text, and objects of a closed list of
    unconstrain's and scikit-learn's classes.

    Parameters
    ----------
    path : path
        The file.
    trusted : classes and functions, optional
        Those of your own that the policy holds: a transformer, a function given to one. The file has only their
        names, so give the classes and functions themselves.

    Returns
    -------
    Policy
        Fitted; it was checked that it predicts.

    Raises
    ------
    ArchiveError
        The file is missing, damaged, not a policy, or from a newer release, or holds something that is not trusted.
    """
    return load_object(path, Kind.POLICY, Policy, check_usable, trusted=trusted, loader="load_policy")
