"""Policies in files."""

from collections.abc import Iterable
from os import PathLike
from typing import Any

import numpy as np
from sklearn.utils.validation import check_is_fitted

from unconstrain.fitting.region import Region
from unconstrain.policies.base import Policy
from unconstrain.storage import Kind, load_object, save_object

LARGEST_DIMENSION = 10**6


def save_policy(policy: Policy, path: str | PathLike[str]) -> None:
    """Write a policy to a file that `load_policy` reads.

    Parameters
    ----------
    policy : Policy
        Fitted.
    path : path
        An existing file is replaced.

    Raises
    ------
    UnconstrainError
        The place cannot be written to, or the policy holds something that cannot be saved, such as a lambda.
    """
    save_object(path, Kind.POLICY, policy, _check_usable)


def load_policy(path: str | PathLike[str], *, trusted: Iterable[Any] = ()) -> Policy:
    """Read a policy that `policy.save(path)` wrote.

    Nothing in the file is run, whoever wrote it: it can hold arrays, numbers, text, and objects of a closed list of
    unconstrain's and scikit-learn's classes.

    Parameters
    ----------
    path : path
        The file.
    trusted : classes and functions, or str, optional
        Those of your own that the policy holds: a transformer, a function given to one. The file has only their
        names, so give the classes and functions themselves. What a regressor of a `RegressorPolicy` is made of is
        given by name, as the error says that asks for it.

    Returns
    -------
    Policy
        Fitted; it was checked that it predicts.

    Raises
    ------
    ArchiveError
        The file is missing, damaged, not a policy, or from a newer release, or holds something that is not trusted.
    """
    return load_object(path, Kind.POLICY, Policy, _check_usable, trusted=trusted, loader="load_policy")


def _check_usable(policy: Policy) -> None:
    """Raise something where a policy is not fitted, or does not act at the origin of its states."""
    check_is_fitted(policy)
    n, d = policy.n_features_in_, policy.n_actions_
    if not all(isinstance(each, int) and 0 < each <= LARGEST_DIMENSION for each in (n, d)):
        raise TypeError("it has no dimensions")
    actions = policy.predict(policy.space_.origin[None])
    if actions.reshape(1, -1).shape != (1, d) or (actions.ndim == 1) != policy.actions_are_scalars_:
        raise TypeError(f"its actions have shape {actions.shape}")
    if not np.isfinite(actions).all():
        raise ValueError("its actions are not finite")
    regions = [each for each in policy.solution_.regions if each is not None]
    if not regions or not all(isinstance(each, Region) for each in regions):
        raise TypeError("it does not say where it was recorded")
    policy.distance(policy.space_.origin[None])  # raises for the region of another space
