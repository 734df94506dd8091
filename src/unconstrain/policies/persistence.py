"""Policies on disk: skops, which holds arrays and names of types but no code, with a note of who wrote it.

A policy file is a skops archive (a zip) with one more member, `unconstrain.json`, that says which format and which
release wrote it. It is read first, so that a newer or foreign file is told apart from a damaged one.
"""

import json
import zipfile
import zlib
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

import skops.io

from unconstrain import atomic
from unconstrain.errors import PolicyFileError

FORMAT = 1
NOTE = "unconstrain.json"
OUR_TYPES = "unconstrain."
# What scikit-learn's own transformers (SplineTransformer, KBinsDiscretizer) hold and skops does not know yet.
KNOWN_TYPES = (
    "numpy.dtype",
    "scipy._lib.array_api_compat.numpy._aliases.asarray",
    "scipy.interpolate._bsplines.BSpline",
)


def save(policy, path: str | Path) -> None:
    """Write a fitted policy to `path`, whole or not at all."""
    with atomic.replacing(path) as temporary:
        skops.io.dump(policy, temporary, compression=zipfile.ZIP_DEFLATED, compresslevel=1)
        with zipfile.ZipFile(temporary, "a") as archive:
            archive.writestr(NOTE, json.dumps({"format": FORMAT, "release": version("unconstrain")}))


def load_policy(path: str | Path, *, trusted: Sequence[str] = ()):
    """The policy that `policy.save(path)` wrote.

    trusted: full names of types from other packages that the policy may hold (a transformer of your own), as skops
        asks for them; those of unconstrain, NumPy and scikit-learn need not be named.

    Raises `PolicyFileError` for a file that is missing, not a policy, damaged, or from a newer release, and for one
    that holds types not trusted.
    """
    path = Path(path)
    if not path.is_file():
        raise PolicyFileError(f"{path}: there is no such policy file")
    try:
        with zipfile.ZipFile(path) as archive:
            note = json.loads(archive.read(NOTE))
            damaged = archive.testzip()
    except KeyError:
        raise PolicyFileError(f"{path} is an archive, but not a policy saved by unconstrain") from None
    except (zipfile.BadZipFile, zlib.error, ValueError, OSError, EOFError, NotImplementedError) as error:
        if path.read_bytes()[:2] == b"PK":
            raise PolicyFileError(f"{path} is damaged ({error}): save the policy again") from None
        raise PolicyFileError(f"{path} is not a policy saved by unconstrain") from None
    if damaged is not None:
        raise PolicyFileError(f"{path} is damaged (in its part {damaged}): save the policy again")
    if not isinstance(note, dict) or not isinstance(note.get("format"), int):
        raise PolicyFileError(f"{path} is damaged (its {NOTE} is unreadable): save the policy again")
    if note["format"] > FORMAT:
        raise PolicyFileError(
            f"{path} was written by unconstrain {note.get('release')}, in a newer format than this release "
            f"({version('unconstrain')}) reads: upgrade unconstrain"
        )
    return _load_trusted(path, trusted)


def _load_trusted(path: Path, trusted: Sequence[str]):
    try:
        untrusted = set(skops.io.get_untrusted_types(file=path))
        known = {name for name in untrusted if name.startswith(OUR_TYPES)} | {*KNOWN_TYPES, *trusted}
        strange = sorted(untrusted - known)
        if strange:
            raise PolicyFileError(
                f"{path} holds types from outside unconstrain and scikit-learn, {', '.join(strange)}: "
                f"if you trust its source, load it with load_policy(path, trusted={strange!r})"
            )
        policy = skops.io.load(path, trusted=sorted(known))
    except PolicyFileError:
        raise
    except Exception as error:  # whatever skops stumbles over in a file that is ours by its note
        raise PolicyFileError(
            f"{path} cannot be read ({type(error).__name__}: {error}): save it again"
        ) from error
    if not (type(policy).__module__.startswith(OUR_TYPES) and hasattr(policy, "predict")):
        raise PolicyFileError(f"{path} holds a {type(policy).__name__}, not a policy")
    return policy
