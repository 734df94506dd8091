"""Which files are meant, and what to call them."""

import glob
import os
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

from unconstrain.errors import DataError

Paths = str | os.PathLike[str] | Iterable[str | os.PathLike[str]]

SUFFIXES = (".csv", ".tsv", ".txt", ".npz", ".parquet", ".pq")


def recordings(paths: Paths) -> list[str]:
    """The files meant, as the user would write them."""
    given = [paths] if isinstance(paths, str | os.PathLike) else paths
    if not isinstance(given, Iterable):
        raise DataError(f"paths must be a path or several of them, got {paths!r}")
    files: list[str] = []
    for each in given:
        if not isinstance(each, str | os.PathLike):
            raise DataError(f"paths must be a path or several of them, got {each!r} among them")
        name = os.path.expanduser(os.fspath(each))
        if isinstance(each, str) and glob.has_magic(name) and not os.path.lexists(name):
            matched = sorted(glob.glob(name, recursive=True))
            if not matched:
                raise DataError(f"no file matches {each}; check the pattern and the folder it starts from")
            files += matched
        else:
            files.append(name)
    if not files:
        raise DataError("no files were given to load")
    twice = [name for name, count in Counter(os.path.realpath(name) for name in files).items() if count > 1]
    if twice:
        raise DataError(f"{Path(twice[0]).name} is given twice, which would count its samples twice")
    return files


def existing(shown: str) -> Path:
    path = Path(shown)
    if path.is_dir():
        raise DataError(
            f"{shown} is a folder without Parquet files: give its files, or a pattern such as {path / '*.csv'}"
        )
    if not path.exists():
        raise DataError(f"there is no file {shown}; check the path, which starts from the current folder")
    if path.suffix.lower() not in SUFFIXES:
        raise DataError(
            f"{shown} cannot be read by its suffix {path.suffix!r}; those known are {', '.join(SUFFIXES)}"
        )
    if path.stat().st_size == 0:
        raise DataError(f"{shown} is empty: there is nothing to read")
    return path


def file_labels(files: list[str]) -> list[str]:
    """A file's name without suffix, or its path where that would not tell two files apart."""
    stems = Counter(Path(name).stem for name in files)
    return [Path(name).stem if stems[Path(name).stem] == 1 else str(Path(name)) for name in files]
