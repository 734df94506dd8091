"""Where a stream stands, in a file: what was added up, what was placed, and up to which row.

An NPZ file as `moments_file` writes them, of kind "checkpoint". Its arrays are the moments by fold, and `policy`, the
bytes of the skops file of the policy with everything placed and its episodes dealt out to folds.
"""

import os
from dataclasses import dataclass
from typing import Any

import joblib
import numpy as np
import skops.io

from unconstrain import moments_file
from unconstrain.errors import UnconstrainError
from unconstrain.fitting.tally import Tally
from unconstrain.policies.base import Policy

KIND = "checkpoint"


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
    """Write a checkpoint, whole or not at all."""
    tally = progress.tally
    arrays, counts = moments_file.packed(tally.moments)
    arrays["policy"] = np.frombuffer(skops.io.dumps(progress.policy), dtype=np.uint8)
    about = {
        "kind": KIND,
        "belongs_to": belongs_to,
        "n_samples": counts,
        "seen": tally.n_samples,
        "zero": tally.n_zero,
        "longest": tally.longest,
        "shortest": None if np.isinf(tally.shortest) else tally.shortest,
        "known": tally.n_known,
        "done": progress.done,
        "longest_known": progress.longest,
    }
    moments_file.write(path, about, arrays)


def load(path: str | os.PathLike[str], belongs_to: dict[str, str], given: Policy) -> Progress | None:
    """Where the stream stood, or None where there is no such file yet.

    given: the policy as the user gives it; types it holds are trusted to be in the file.
    Raises `UnconstrainError` for a file that is damaged, foreign, or belongs to something else.
    """
    if not os.path.lexists(path):
        return None
    about, arrays = moments_file.read(path, (KIND,))
    try:
        other = [what for what, value in belongs_to.items() if about["belongs_to"][what] != value]
        if other:
            raise UnconstrainError(
                f"{path} is the checkpoint of another {other[0]}: give another file, or delete this one to start anew"
            )
        data = arrays.pop("policy").tobytes()
        trusted = skops.io.get_untrusted_types(data=skops.io.dumps(given))
        ours = [name for name in skops.io.get_untrusted_types(data=data) if name.startswith("unconstrain.")]
        policy = skops.io.loads(data, trusted=sorted({*trusted, *ours}))
        tally = Tally(
            tuple(moments_file.unpacked(about["n_samples"], arrays)),
            int(about["seen"]),
            int(about["zero"]),
            float(about["longest"]),
            np.inf if about["shortest"] is None else float(about["shortest"]),
            int(about.get("known", 0)),  # not in checkpoints of streams that carried none
        )
        return Progress(policy, tally, int(about["done"]), float(about["longest_known"]))
    except UnconstrainError:
        raise
    except Exception as error:  # whatever a file that only looks like ours makes readers stumble over
        raise UnconstrainError(
            f"{path} is damaged and cannot be gone on from ({type(error).__name__}): delete it to start anew"
        ) from error
