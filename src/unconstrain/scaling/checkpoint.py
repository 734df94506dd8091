"""Where a stream stands, in a file: what was added up, what was placed, and up to which row.

An archive that holds the accumulator with everything placed and its episodes dealt out to folds, and the sums so far.
"""

import hashlib
import json
import os
import warnings
from dataclasses import astuple, dataclass, fields
from typing import Any

import numpy as np
from sklearn.base import clone

from unconstrain.errors import UnconstrainError
from unconstrain.fitting.accumulator import Accumulator
from unconstrain.fitting.sums import Sums
from unconstrain.policies.base import Policy
from unconstrain.recordings.notes import Note
from unconstrain.storage import Kind, encode, foreign_parts, load_object, save_object


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
    notes : tuple of Note
        What was found in the rows before.
    """

    accumulator: Accumulator
    sums: Sums
    done: int
    notes: tuple[Note, ...] = ()


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
    about = [type(policy).__name__, clone(policy).get_params(deep=False), learnt]
    return {"policy": _digest(about), "source": _digest(source), "settings": _digest(settings)}


def save(path: str | os.PathLike[str], belongs_to: dict[str, str], progress: Progress) -> None:
    """Write a checkpoint, whole or not at all, and warn where that fails: the work itself goes on.

    Parameters
    ----------
    path : path
        The file.
    belongs_to : dict
        As `identity` returned it.
    progress : Progress
        Where the stream stands.
    """
    reached = {field.name: getattr(progress, field.name) for field in fields(Progress)}
    reached["notes"] = [astuple(note) for note in progress.notes]
    try:
        save_object(path, Kind.CHECKPOINT, {"belongs_to": belongs_to, **reached})
    except UnconstrainError as error:
        warnings.warn(f"{error}; the fit goes on without this checkpoint", stacklevel=2)


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
        The file is damaged, is no checkpoint, or belongs to something else; or the policy holds something that cannot
        be saved, such as a lambda.
    """
    trusted = foreign_parts(given)  # which fails before the work where nothing could be saved
    if not os.path.lexists(path):
        return None
    found = load_object(path, Kind.CHECKPOINT, dict, _check, trusted=trusted)
    other = [what for what, value in belongs_to.items() if found["belongs_to"][what] != value]
    if other:
        raise UnconstrainError(
            f"{path} is the checkpoint of another {other[0]}: give another file, or delete this one to start anew"
        )
    notes = tuple(Note(*note) for note in found["notes"])
    return Progress(found["accumulator"], found["sums"], found["done"], notes)


def _check(found: dict[str, Any]) -> None:
    kinds = {"accumulator": Accumulator, "sums": Sums, "done": int, "notes": list}
    if set(found) != {"belongs_to", *kinds} or set(found["belongs_to"]) != {"policy", "source", "settings"}:
        raise TypeError("it holds other things than a checkpoint")
    wrong = [name for name, kind in kinds.items() if not isinstance(found[name], kind)]
    if wrong:
        raise TypeError(f"it holds another {wrong[0]}")
    for part in (*found["sums"].moments, *found["accumulator"].total.moments):
        if part is not None and not all(
            np.isfinite(each).all() for each in (part.H, part.g, part.squares, part.weight)
        ):
            raise TypeError("its sums are not finite")
    found["sums"] + Sums()  # raises for counts that are none
    if not all(isinstance(note, tuple) and len(note) == len(fields(Note)) for note in found["notes"]):
        raise TypeError("it holds notes that are none")


def _digest(value: Any) -> str:
    """Digest what a value consists of, whatever its type, as long as it can be saved."""
    tree, arrays = encode(value)
    digest = hashlib.blake2b(json.dumps(tree, sort_keys=True).encode(), digest_size=16)
    for name, array in arrays.items():
        digest.update(f"{name} {array.dtype.str} {array.shape}".encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()
