"""Which recordings, which of their columns, and what is held out of them: shared by the commands that read files."""

import csv
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console

from unconstrain.arrays import check_choice
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError
from unconstrain.recordings import load
from unconstrain.recordings.roles import DIFFERENTIATE

Files = Annotated[
    list[str],
    typer.Argument(
        help="CSV, NPZ or Parquet recordings; or a folder of Parquet files, or of a LeRobot dataset.",
        metavar="FILES...",
    ),
]
State = Annotated[
    str | None,
    typer.Option(
        "--state",
        help="State columns: names or positions (from 0), separated by commas; '\"x, in m\"' where a name has some.",
        metavar="x,y,z",
    ),
]
Action = Annotated[
    str | None,
    typer.Option(
        "--action", help="Action columns; without them the states are differentiated.", metavar="u,v,w"
    ),
]
Time = Annotated[
    str | None, typer.Option("--time", help="Time column, in seconds or nanoseconds.", metavar="t")
]
Episode = Annotated[
    str | None,
    typer.Option("--episode", help="Column that tells episodes apart; else each file is one.", metavar="run"),
]
TimeUnit = Annotated[
    str | None, typer.Option("--time-unit", help="s, ms, us or ns, where it is guessed wrongly.")
]
Window = Annotated[
    float | None, typer.Option("--window", help="Seconds over which states are differentiated (0.2).")
]
Gap = Annotated[float | None, typer.Option("--gap", help="A step longer than this (s) splits an episode.")]
MaxSpeed = Annotated[
    float | None,
    typer.Option("--max-speed", help="A step faster than this splits an episode: trackers jump."),
]
MinSpeed = Annotated[float | None, typer.Option("--min-speed", help="Leave out samples slower than this.")]
MinDuration = Annotated[
    float | None,
    typer.Option("--min-duration", help="Drop fragments of split episodes shorter than this (s)."),
]
Force = Annotated[
    str | None,
    typer.Option("--force", help="Columns of the contact force, one for each action.", metavar="fx,fy,fz"),
]
ForceThreshold = Annotated[
    float | None, typer.Option("--force-threshold", help="A force above this is a contact, in its own unit.")
]
Free = Annotated[
    str | None,
    typer.Option("--free", help="Column with 1 where nothing constrained the motion.", metavar="COLUMN"),
]
Folds = Annotated[
    str | None,
    typer.Option(
        "--folds", help="What is held out: whole episodes, or blocks of each. Default: episodes, if several."
    ),
]

BLOCKS = 5
FOLDS = ("episodes", "blocks")

PLAIN = ("time_unit", "window", "gap", "max_speed", "min_speed", "min_duration")
"""Options that `load` takes as they are."""


def columns(text: str | None) -> list[str | int] | None:
    """`"x,y"` as names, `"1,2"` as positions; a name in double quotes may hold commas.

    Raises `DataError` for an empty name.
    """
    if text is None:
        return None
    names = [name.strip() for row in csv.reader([text], skipinitialspace=True) for name in row]
    if not names or not all(names):
        raise DataError(f"{text!r} has an empty column name: separate names or positions by single commas")
    return [int(name) if name.isdigit() else name for name in names]


def one_column(text: str | None, option: str) -> str | int | None:
    """A single column's name or position. Raises `DataError` for more than one."""
    named = columns(text)
    if named is None:
        return None
    if len(named) > 1:
        raise DataError(f"{option} takes one column, got {len(named)}: {text}")
    return named[0]


def asked(options: Mapping[str, Any]) -> dict[str, Any]:
    """The arguments of `load` among a command's options (`typer.Context.params`), those that were given.

    Without what tells of constraints, so that they can be kept with a policy, and other recordings read by them.
    """
    return _given(
        {
            "state": columns(options["state"]),
            "action": DIFFERENTIATE if options["action"] == DIFFERENTIATE else columns(options["action"]),
            "time": one_column(options["time"], "--time"),
            "episode": one_column(options["episode"], "--episode"),
            **{name: options[name] for name in PLAIN},
        }
    )


def told(options: Mapping[str, Any]) -> dict[str, Any]:
    """The columns that tell of constraints among a command's options, those that were given."""
    force, free = columns(options["force"]), one_column(options["free"], "--free")
    return _given({"force": force, "free": free})


def _given(options: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in options.items() if value is not None}


def as_before(before: dict[str, Any], now: dict[str, Any]) -> dict[str, Any]:
    """How to read recordings that are like those of `before`, where `now` does not say otherwise.

    Whoever names the states speaks of another layout: then no other column is taken over either.
    """
    columns = ("state", "action", "time", "episode") if "state" in now else ()
    return {name: value for name, value in before.items() if name not in columns} | now


def read(files: list[str], how: dict[str, Any]) -> Demonstrations:
    """The demonstrations in all the files."""
    return load(files, **how)


def describe(console: Console, demos: Demonstrations) -> None:
    """Say what was read: samples, episodes, and what the reader did to them."""
    console.print(
        f"read: {len(demos)} samples, {demos.n_episodes} episode{'s' if demos.n_episodes != 1 else ''}, "
        f"states {', '.join(demos.state_names)}, actions {', '.join(demos.action_names)}"
    )
    for note in demos.notes:
        console.print(f"note: {note}")


def folds_of(demos: Demonstrations, folds: str | None) -> np.ndarray:
    """Episodes to be held out together, or blocks of each."""
    folds = folds or ("episodes" if demos.n_episodes > 1 else "blocks")
    check_choice(folds, "--folds", FOLDS)
    if folds == "episodes" and demos.n_episodes < 2:
        raise DataError("there is one episode, and none is left when it is held out: use --folds blocks")
    return demos.episodes if folds == "episodes" else demos.blocks(BLOCKS)


def check_writable(*paths: Path | None) -> None:
    """Raise `DataError` before any work for an output whose folder is not there, or that is a folder."""
    for path in paths:
        if path is None:
            continue
        if path.is_dir():
            raise DataError(f"cannot write {path}: it is a folder, so give the name of a file")
        if not path.parent.is_dir():
            raise DataError(f"cannot write {path}: there is no folder {path.parent}, so make it first")
        if not os.access(path.parent, os.W_OK):
            raise DataError(
                f"cannot write {path}: nothing may be written to {path.parent}, so choose another folder"
            )
