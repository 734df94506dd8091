"""The command that learns from a recording, as it is typed."""

import csv
import io
import os
import shlex
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path, PurePosixPath
from typing import Any

from unconstrain.recordings.columns import Columns
from unconstrain.recordings.preparation import Preparation


def fit_command(paths: Sequence[str | os.PathLike[str]], columns: Columns, preparation: Preparation) -> str:
    """Write the command that learns from files, quoted for a shell.

    Parameters
    ----------
    paths : sequence of path
    columns : Columns
    preparation : Preparation
        Options that differ from their defaults are written.

    Returns
    -------
    str

    Examples
    --------
    >>> fit_command(["a b.csv"], Columns(state=["x", "y"], time="t"), Preparation())
    "unconstrain fit 'a b.csv' --state x,y --time t --out 'a b.skops'"
    """
    parts = ["unconstrain", "fit", *map(_path, paths)]
    for carrier in (columns, preparation):
        for field in fields(carrier):
            value = getattr(carrier, field.name)
            if value is not None and value != field.default:
                written = _written(value) if carrier is columns else str(value)
                name = f"--{field.name.replace('_', '-')}"
                parts += [name] if value is True else [name, shlex.quote(written)]
    return " ".join([*parts, "--out", _path(_output(os.fspath(paths[0])))])


def _written(value: Any) -> str:
    """Write columns as the program reads them: as a line of CSV."""
    each = [value] if isinstance(value, str | int) else list(value)
    line = io.StringIO()
    csv.writer(line, lineterminator="").writerow(each)
    return line.getvalue()


def _path(path: str | os.PathLike[str]) -> str:
    name = os.fspath(path)
    return shlex.quote(f"./{name}" if name.startswith("-") else name)


def _output(path: str) -> str:
    """Name a policy after the recording, in the current folder, as no file there is named."""
    stem = PurePosixPath(path.rstrip("/")).stem.strip(".*?[]") or "policy"
    name, number = f"{stem}.skops", 1
    while Path(name).exists():
        number += 1
        name = f"{stem}-{number}.skops"
    return name
