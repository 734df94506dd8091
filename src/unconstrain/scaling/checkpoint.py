"""Where a stream stands, in a file: what was added up, what was placed, and up to which row.

An archive that holds the accumulator with everything placed and its episodes dealt out to folds, and the sums so far;
where contact is inferred, in several passes, also what the passes before found.
"""

import hashlib
import json
import os
import warnings
from dataclasses import astuple, dataclass, fields, is_dataclass
from types import UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

import numpy as np
from sklearn.base import clone

from unconstrain.errors import UnconstrainError
from unconstrain.fitting.accumulator import Accumulator, Record
from unconstrain.fitting.contact import Belief, Tally
from unconstrain.fitting.corrected import CorrectedMoments
from unconstrain.fitting.inference import Inference
from unconstrain.fitting.region import Region
from unconstrain.fitting.sums import Sums
from unconstrain.fitting.wide.held import HeldSamples, Piece
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
    inference : Inference, optional
        What earlier passes found, and this one is for, where contact is inferred.
    """

    accumulator: Accumulator
    sums: Sums
    done: int
    notes: tuple[Note, ...] = ()
    inference: Inference | None = None


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
    return Progress(found["accumulator"], found["sums"], found["done"], notes, found["inference"])


def _check(found: dict[str, Any]) -> None:
    kinds: dict[str, Any] = {
        "accumulator": Accumulator,
        "sums": Sums,
        "done": int,
        "notes": list,
        "inference": Inference | None,
    }
    if set(found) != {"belongs_to", *kinds} or set(found["belongs_to"]) != {"policy", "source", "settings"}:
        raise TypeError("it holds other things than a checkpoint")
    wrong = [name for name, kind in kinds.items() if not isinstance(found[name], kind)]
    if wrong:
        raise TypeError(f"it holds another {wrong[0]}")
    _check_sums(found["sums"])
    _check_accumulator(found["accumulator"], filled=found["inference"] is None)
    if found["inference"] is not None:
        _check_inference(found["inference"])
    if not all(isinstance(note, tuple) and len(note) == len(fields(Note)) for note in found["notes"]):
        raise TypeError("it holds notes that are none")


def _check_sums(sums: Sums) -> None:
    for part in (*sums.moments, *sums.judges):
        if isinstance(part, CorrectedMoments):
            _check_types(part, CorrectedMoments)
        elif isinstance(part, HeldSamples):
            if not all(isinstance(each, Piece) and np.isfinite(each.Z).all() for each in part.pieces):
                raise TypeError("its samples are none")
        elif part is not None and not all(
            np.isfinite(each).all() for each in (part.H, part.g, part.squares, part.weight)
        ):
            raise TypeError("its sums are not finite")
    if not all(each is None or isinstance(each, Region) for each in sums.regions):
        raise TypeError("it does not say where samples lie")
    sums + Sums()  # raises for counts that are none
    _check_types(sums.tallies, tuple[Tally, ...])


def _check_accumulator(accumulator: Accumulator, *, filled: bool) -> None:
    """Check an accumulator, and that it has a belief if something was added to it."""
    _check_sums(accumulator.total)
    _check_types(accumulator.belief, Belief | None)
    _check_types(accumulator.record, Record)
    _check_types(accumulator.compared, tuple[tuple[Belief, ...], ...])
    if accumulator.risk == "adaptive" and filled and accumulator.belief is None:
        raise TypeError("it holds sums of which nothing was believed")
    model = accumulator.model
    for belief in (accumulator.belief, *(each for several in accumulator.compared for each in several)):
        if belief is not None:
            model.evaluate(np.zeros((1, model.n_states)), belief.w)  # raises for parameters of another model


def _check_inference(inference: Inference) -> None:
    """Check where an inference stands: the types of what it holds, and that it knows how to go on."""
    _check_types(inference, Inference)
    if inference.result is not None:
        raise TypeError("it holds an inference that has ended")
    _check_accumulator(inference.blank, filled=False)
    for run in (*inference.runs, *inference.compared):
        if run.accepted is not None:
            _check_accumulator(run.accepted, filled=True)
            if len(run.accepted.total.tallies) != 1:
                raise TypeError("it holds a run without tallies")
    wanted = inference.next_pass()  # raises where it does not
    assert wanted is not None
    _check_accumulator(wanted, filled=False)
    if not isinstance(inference.description, str):
        raise TypeError("it holds an inference that cannot be described")


def _check_types(value: Any, kind: Any, where: str = "it") -> None:
    """Check a value by what its annotation says, down to the fields of dataclasses and what containers hold."""
    of, inner = get_origin(kind), get_args(kind)
    if kind is Any:
        return
    if of in (UnionType, Union):
        (kind,) = [each for each in inner if each is not type(None)]
        if value is not None:
            _check_types(value, kind, where)
        return
    expected: Any = float | int if kind is float else np.ndarray if of is np.ndarray else of or kind
    if not isinstance(value, expected) or (isinstance(value, bool) and kind is not bool):
        raise TypeError(f"{where} holds a {type(value).__name__} where it takes a {kind}")
    if isinstance(value, np.ndarray) and not (value.dtype == np.float64 and np.isfinite(value).all()):
        raise TypeError(f"{where} holds numbers that are not finite")
    if isinstance(value, dict):
        for key, each in value.items():
            _check_types(key, inner[0], where)
            _check_types(each, inner[1], f"{where}.{key}")
    elif isinstance(value, list | tuple):
        kinds = inner if of is tuple and inner[-1] is not Ellipsis else (inner[0],) * len(value)
        for each, its in zip(value, kinds, strict=True):
            _check_types(each, its, where)
    elif is_dataclass(kind):
        hints = get_type_hints(kind)
        if set(vars(value)) != set(hints):
            raise TypeError(f"{where} is no {type(value).__name__}")
        for name, its in hints.items():
            _check_types(getattr(value, name), its, f"{where}.{name}")


def _digest(value: Any) -> str:
    """Digest what a value consists of, whatever its type, as long as it can be saved."""
    tree, arrays = encode(value)
    digest = hashlib.blake2b(json.dumps(tree, sort_keys=True).encode(), digest_size=16)
    for name, array in arrays.items():
        digest.update(f"{name} {array.dtype.str} {array.shape}".encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()
