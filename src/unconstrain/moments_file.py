"""Moments on disk: NPZ, arrays and no pickle, with a note of what they are and who wrote them.

For the i-th fold the file holds `H_i`, `g_i`, `squares_i` and `weight_i`, and besides them the text `unconstrain`,
a JSON object of `format` (1), `release`, `kind` ("moments" or "moments by fold") and `n_samples`, a number a fold,
null for a fold without samples.
"""

import json
import os
import zipfile
import zlib
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from typing import Any

import numpy as np

from unconstrain import atomic
from unconstrain.errors import UnconstrainError
from unconstrain.fitting.moments import Moments

FORMAT = 1
NOTE = "unconstrain"
ARRAYS = ("H", "g", "squares", "weight")


def save(moments: Moments | Sequence[Moments | None], path: str | os.PathLike[str]) -> None:
    """Write moments, one or by fold, whole or not at all."""
    one = isinstance(moments, Moments)
    folds: Sequence[Moments | None] = [moments] if isinstance(moments, Moments) else list(moments)
    arrays, counts = packed(folds)
    write(path, {"kind": "moments" if one else "moments by fold", "n_samples": counts}, arrays)


def load(path: str | os.PathLike[str]) -> Any:
    """What `save` wrote. Raises `UnconstrainError` for a file missing, foreign, damaged, or of a newer release."""
    about, arrays = read(path, ("moments", "moments by fold"))
    try:
        folds = unpacked(about["n_samples"], arrays)
        return folds[0] if about["kind"] == "moments" else folds
    except (KeyError, TypeError, IndexError, ValueError):
        raise UnconstrainError(
            f"{path} is damaged: what it says of its arrays is not so; write it again"
        ) from None


def packed(folds: Sequence[Moments | None]) -> tuple[dict[str, np.ndarray], list[int | None]]:
    """The arrays of moments by fold under the names they have in a file, and the number of samples a fold."""
    arrays = {
        f"{name}_{i}": np.asarray(getattr(fold, name))
        for i, fold in enumerate(folds)
        if fold is not None
        for name in ARRAYS
    }
    return arrays, [None if fold is None else int(fold.n_samples) for fold in folds]


def unpacked(counts: Sequence[int | None], arrays: Mapping[str, np.ndarray]) -> list[Moments | None]:
    """What `packed` took apart. Raises `KeyError` or `ValueError` where shapes or arrays are not as they must be."""
    folds: list[Moments | None] = []
    for i, count in enumerate(counts):
        if count is None:
            folds.append(None)
            continue
        H, g, squares, weight = (np.asarray(arrays[f"{name}_{i}"], dtype=np.float64) for name in ARRAYS)
        fold = Moments(H, g, squares, weight, int(count))
        *batch, P, Q = fold.H.shape
        if (
            P != Q
            or fold.g.shape[:-1] != (*batch, P)
            or {fold.squares.shape, fold.weight.shape} != {tuple(batch)}
        ):
            raise ValueError("shapes")
        folds.append(fold)
    return folds


def write(path: str | os.PathLike[str], about: dict[str, Any], arrays: Mapping[str, np.ndarray]) -> None:
    """Write an NPZ file of ours, whole or not at all: arrays, and a note `about` them with format and release."""
    note = np.array(json.dumps({"format": FORMAT, "release": version("unconstrain"), **about}))
    named: dict[str, Any] = {**arrays, NOTE: note}
    with atomic.replacing(path) as temporary, temporary.open("wb") as file:
        np.savez(file, **named)


def read(
    path: str | os.PathLike[str], kinds: tuple[str, ...]
) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """The note and the arrays of a file of ours that is of one of these `kinds`.

    Raises `UnconstrainError` for a file that is missing, foreign, damaged, or from a newer release.
    """
    if not os.path.isfile(path):
        raise UnconstrainError(f"{path} is not a file, so it holds no {kinds[0]}: check the path")
    try:
        with np.load(path, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
        about = json.loads(str(arrays.pop(NOTE)))
        kind, found = about["kind"], int(about["format"])
    except (KeyError, AttributeError):  # an archive without our note, or a single array
        raise UnconstrainError(f"{path} holds no {kinds[0]} saved by unconstrain") from None
    except (zipfile.BadZipFile, zlib.error, EOFError, ValueError, TypeError, OSError, NotImplementedError):
        with open(path, "rb") as file:
            ours = file.read(2) == b"PK"
        raise UnconstrainError(
            f"{path} is damaged: write it again"
            if ours
            else f"{path} holds no {kinds[0]} saved by unconstrain"
        ) from None
    if found > FORMAT:
        raise UnconstrainError(
            f"{path} was written by unconstrain {about.get('release')}, in a newer format than this release "
            f"({version('unconstrain')}) reads: upgrade unconstrain"
        )
    if kind not in kinds:
        raise UnconstrainError(f"{path} holds no {kinds[0]}: it holds {kind}")
    return about, arrays
