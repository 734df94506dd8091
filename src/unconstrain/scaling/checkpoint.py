"""Where a stream stands, in a file: what was added up, what was placed, and up to which row.

An archive that holds the policy with everything placed and its episodes dealt out to folds, and the moments by fold.
"""

import os
from dataclasses import dataclass, fields
from typing import Any

import joblib

from unconstrain.errors import UnconstrainError
from unconstrain.fitting.tally import Tally
from unconstrain.policies.base import Policy
from unconstrain.storage import Kind, foreign_parts, load_object, save_object


@dataclass(frozen=True)
class Progress:
    """A policy with everything placed, what the rows before `done` add to it, and the longest action known before."""

    policy: Policy
    tally: Tally
    done: int
    longest: float


def identity(policy: Policy, source: str, settings: dict[str, Any]) -> dict[str, str]:
    """What a checkpoint belongs to: the policy as given, the source, and the settings on which the result depends."""
    learnt = [
        (part.H, part.g) if part is not None else None for part in getattr(policy, "moments_", None) or []
    ]
    about = (type(policy).__name__, policy.get_params(deep=True), learnt)
    return {"policy": joblib.hash(about), "source": joblib.hash(source), "settings": joblib.hash(settings)}


def save(path: str | os.PathLike[str], belongs_to: dict[str, str], progress: Progress) -> None:
    """Write a checkpoint, whole or not at all.

    Parameters
    ----------
    path : path
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
    kinds = {"policy": Policy, "tally": Tally, "done": int, "longest": float}
    if set(found) != {"belongs_to", *kinds} or set(found["belongs_to"]) != {"policy", "source", "settings"}:
        raise TypeError("it holds other things than a checkpoint")
    wrong = [name for name, kind in kinds.items() if not isinstance(found[name], kind)]
    if wrong:
        raise TypeError(f"it holds another {wrong[0]}")
