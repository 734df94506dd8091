"""Whole objects in files: archive and encoding together, and a check that what was read still works."""

import os
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from unconstrain.errors import UntrustedArchiveError
from unconstrain.storage.archive import FilePath, Kind, damaged, read, write
from unconstrain.storage.encoding import UntrustedError, decode, encode

Check = Callable[[Any], None]


def save_object(path: FilePath, kind: Kind, value: Any, check: Check | None = None) -> None:
    """Write an object to a file, whole or not at all.

    Parameters
    ----------
    path : path
        An existing file is replaced.
    kind : Kind
        What the file holds.
    value : object
        Anything that `encode` takes.
    check : callable, optional
        Raises an exception for an object that does not work. Whether this one does is kept for `load_object`.

    Raises
    ------
    UnconstrainError
        The object holds something that cannot be saved, or the place cannot be written to.
    """
    tree, arrays = encode(value)
    write(path, kind, {"works": _failure(value, check) is None, "value": tree}, arrays)


def load_object(
    path: FilePath,
    kind: Kind,
    expected: type,
    check: Check | None = None,
    *,
    trusted: Iterable[Any] = (),
    loader: str = "",
) -> Any:
    """Read an object that `save_object` wrote.

    Parameters
    ----------
    path : path
        The file.
    kind : Kind
        What the file has to hold.
    expected : type
        Of the object.
    check : callable, optional
        As for `save_object`. An object that worked when it was saved has to work now; one that did not may still raise
        `ValueError`, as splines do outside their range if they are told to.
    trusted : classes and functions, optional
        Of the user's own, which the object may hold.
    loader : str
        The public function that is called, for the sentence that asks for `trusted`.

    Returns
    -------
    object

    Raises
    ------
    ArchiveError
        The file is missing, foreign, damaged, of another kind, or from a newer release, or it holds classes or
        functions that are not trusted.
    """
    trusted = [trusted] if isinstance(trusted, str) or callable(trusted) else list(trusted)
    tree, arrays = read(path, kind)
    # A tree that nobody wrote can make its classes raise nearly anything.
    try:
        value = decode(tree["value"], arrays, trusted)
        if not isinstance(value, expected):
            raise TypeError(f"it holds a {type(value).__name__}")
        failure = _failure(value, check)
        if failure is not None and (tree["works"] or not isinstance(failure, ValueError)):
            raise failure
    except UntrustedError as error:
        shown = [name.replace(":", ".") for name in error.names]
        # What a regressor is made of is often hidden deep in its package, and so is trusted by name.
        own = [f'"{name}"' if ":" not in name else name.rpartition(":")[2] for name in error.names]
        classes = "import what it names and " if any(":" in name for name in error.names) else ""
        raise UntrustedArchiveError(
            f"{os.fspath(path)} holds {', '.join(shown)}, which unconstrain does not know: if you trust the file's "
            f"source, {classes}load it with {loader}(path, trusted=[{', '.join(own)}])",
            tuple(error.names),
        ) from None
    except Exception as error:
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise damaged(path, kind, f"{reason:.200}") from None
    return value


def _failure(value: Any, check: Check | None) -> Exception | None:
    if check is None:
        return None
    try:
        with np.errstate(all="ignore"):
            check(value)
    except Exception as error:
        return error
    return None
