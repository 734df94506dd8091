"""Where a stream stands, in a file: what was added up, what was placed, and up to which row.

An archive that holds the accumulator with everything placed and its episodes dealt out to folds, and the sums so far.
"""

import os
from dataclasses import dataclass, fields
from typing import Any

import joblib

from unconstrain.errors import UnconstrainError
from unconstrain.fitting.accumulator import Accumulator
from unconstrain.fitting.sums import Sums
from unconstrain.policies.base import Policy
from unconstrain.storage import Kind, foreign_parts, load_object, save_object


@dataclass(frozen=True)
class Progress:
    """How far a stream has come.

    Parameters
    ----------
    accumulator : Accumulator
        With everything placed and all episodes so far dealt out, as it was before the stream.
    sums : Sums
        What the rows before `done` add.
    done : int
        The row to go on from.
    """

    accumulator: Accumulator
    sums: Sums
    done: int


def identity(policy: Policy, source: str, settings: dict[str, Any], partial: bool) -> dict[str, str]:
    """Describe what a checkpoint belongs to.

    Parameters
    ----------
    policy : Policy
        As given.
    source : str
        What identifies the data.
    settings : dict
        The settings on which the result depends.
    partial : bool
        Whether the stream goes on from what the policy has learnt.

    Returns
    -------
    dict of str
        A digest of each.
    """
    learnt = [
        None if part is None else (part.H, part.g)
        for part in (policy.moments_ if partial and hasattr(policy, "accumulator_") else [])
    ]
    about = (type(policy).__name__, policy.get_params(deep=True), learnt)
    return {"policy": joblib.hash(about), "source": joblib.hash(source), "settings": joblib.hash(settings)}


def save(path: str | os.PathLike[str], belongs_to: dict[str, str], progress: Progress) -> None:
    """Write a checkpoint, whole or not at all.

    Parameters
    ----------
    path : path
        The file.
    belongs_to : dict
        As `identity` returned it.
    progress : Progress
        Where the stream stands.

    Raises
    ------
    UnconstrainError
        The place cannot be written to, or the policy holds something that cannot be saved, such as a lambda.
    """
    reached = {field.name: getattr(progress, field.name) for field in fields(Progress)}
    save_object(path, Kind.CHECKPOINT, {"belongs_to": belongs_to, **reached})


def load(path: str | os.PathLike[str], belongs_to: dict[str, str], given: Policy) -> Progress | None:
    """Read where a stream stood.

    Parameters
    ----------
    path : path
        The file.
    belongs_to : dict
        As `identity` returned it.
    given : Policy
        As the user gives it; classes and functions that it holds are trusted to be in the file.

    Returns
    -------
    Progress or None
        None where there is no such file yet.

    Raises
    ------
    UnconstrainError
        The file is damaged, is no checkpoint, or belongs to something else.
    """
    if not os.path.lexists(path):
        return None
    found = load_object(path, Kind.CHECKPOINT, dict, _check, trusted=foreign_parts(given))
    other = [what for what, value in belongs_to.items() if found["belongs_to"][what] != value]
    if other:
        raise UnconstrainError(
            f"{path} is the checkpoint of another {other[0]}: give another file, or delete this one to start anew"
        )
    return Progress(**{field.name: found[field.name] for field in fields(Progress)})


def _check(found: dict[str, Any]) -> None:
    kinds = {"accumulator": Accumulator, "sums": Sums, "done": int}
    if set(found) != {"belongs_to", *kinds} or set(found["belongs_to"]) != {"policy", "source", "settings"}:
        raise TypeError("it holds other things than a checkpoint")
    wrong = [name for name, kind in kinds.items() if not isinstance(found[name], kind)]
    if wrong:
        raise TypeError(f"it holds another {wrong[0]}")
