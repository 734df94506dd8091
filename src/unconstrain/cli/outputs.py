"""Which files a command writes; what is there already is not lost, and no work is done for what cannot be written."""

import glob
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import click

from unconstrain import atomic
from unconstrain.cli.declared import option
from unconstrain.errors import DataError
from unconstrain.plot.saving import SUFFIXES, check_suffix

SECTION = "Output"

NEVER_READ = (".skops", *SUFFIXES)
"""How the names of outputs end that no reader of folders takes for recordings."""

overwrite = option(
    "--overwrite",
    is_flag=True,
    help="Replace files that exist; without it they are left as they are.",
    section=SECTION,
)
"""Decorator of a command that writes files."""


def out(default: str, help: str) -> Callable[[Callable], Callable]:
    """Make the option for the file that a command writes."""
    path = click.Path(path_type=Path)
    return option("--out", type=path, default=default, show_default=True, help=help, section=SECTION)


def figure(help: str, default: str | None = None) -> Callable[[Callable], Callable]:
    """Make the option for the picture that a command draws."""
    return option(
        "--figure",
        type=click.Path(path_type=Path),
        default=default,
        show_default=default is not None,
        help=f"{help} ({', '.join(suffix[1:].upper() for suffix in SUFFIXES)}).",
        section=SECTION,
    )


def check_outputs(
    inputs: Sequence[str | os.PathLike[str]],
    outputs: Mapping[str, Path | None],
    *,
    overwrite: bool,
    continued: Mapping[str, Path | None] | None = None,
) -> None:
    """Raise a mistake, before any work, for an output that cannot or must not be written.

    Parameters
    ----------
    inputs : sequence of path
        What the command reads: files, folders, patterns, URIs.
    outputs : mapping
        What it writes, by option; None is not written. Of these "figure" is a picture.
    overwrite : bool
        Whether outputs that exist may be replaced.
    continued : mapping, optional
        What it writes besides, by option, and may exist.

    Raises
    ------
    UnconstrainError
        An output is also an input, is a file of a folder that is read, is given twice, exists and must not be
        replaced, or cannot be written at all.
    """
    continued = continued or {}
    check_suffix(outputs.get("figure"))
    read = [_real(path) for each in inputs for path in _expanded(each)]
    named: dict[str, str] = {}
    for name, path in {**outputs, **continued}.items():
        if path is None:
            continue
        real = _real(path)
        if any(_is_same(real, other) for other in read):
            raise DataError(f"{path} is one of the files that are read: choose another name for {name}=")
        inside = any(real.startswith(os.path.join(folder, "")) for folder in read)
        if inside and os.path.exists(real) and path.suffix.lower() not in NEVER_READ:
            raise DataError(f"{path} is in a folder that is read: choose another name for {name}=")
        if real in named:
            raise DataError(f"{named[real]}= and {name}= are the same file, {path}: choose two names")
        named[real] = name
        check_new(path, name, overwrite=overwrite or name in continued)


def check_apart(inputs: Sequence[str | os.PathLike[str]], folder: Path) -> None:
    """Raise `UnconstrainError` for a folder to be written that is read, holds what is read, or lies within it."""
    real = _real(folder)
    for path in (_real(path) for each in inputs for path in _expanded(each)):
        parts = (path, real)
        if path == real or any(a.startswith(os.path.join(b, "")) for a, b in (parts, parts[::-1])):
            raise DataError(
                f"{folder} holds what is read, or lies in a folder that is read: choose another name for out="
            )


def check_new(path: Path, name: str, *, overwrite: bool) -> None:
    """Raise `UnconstrainError` for a file that cannot be written, or that exists and must not be replaced."""
    atomic.check_writable(path)
    if not overwrite and os.path.lexists(_real(path)):
        raise DataError(f"{path} exists: give overwrite= to replace it, or another name with {name}=")


def _expanded(given: str | os.PathLike[str]) -> list[str]:
    name = os.path.expanduser(os.fspath(given))
    return [name] if os.path.lexists(name) else glob.glob(name, recursive=True)


def _real(path: str | os.PathLike[str]) -> str:
    return os.path.realpath(os.path.expanduser(path))


def _is_same(path: str, other: str) -> bool:
    """Whether two names are one file, by a hard link too."""
    return path == other or (os.path.isfile(path) and os.path.isfile(other) and os.path.samefile(path, other))
