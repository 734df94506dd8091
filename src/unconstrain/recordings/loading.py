"""One function that loads any recording."""

import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError
from unconstrain.recordings import folder
from unconstrain.recordings.differentiate import differentiate, spans_window
from unconstrain.recordings.files import Paths, existing, file_labels, recordings
from unconstrain.recordings.formats import csv, npz, parquet
from unconstrain.recordings.roles import Keys, Roles, assigned
from unconstrain.recordings.saved import read_saved
from unconstrain.recordings.splitting import GAP_STEPS, SUSPICIOUS, split
from unconstrain.recordings.stamps import PER_SECOND
from unconstrain.recordings.table import Key, Table

READERS: dict[str, Callable[[Path, str], Table]] = {
    ".csv": csv.read,
    ".tsv": csv.read,
    ".txt": csv.read,
    ".npz": npz.read,
    ".parquet": parquet.read,
    ".pq": parquet.read,
}

# What columns without a header are called.
UNNAMED = re.compile(r"[xu]\d+(_dot)?")


def load(
    paths: Paths,
    state: Keys | None = None,
    action: Keys | None = None,
    time: Key | None = None,
    episode: Key | None = None,
    *,
    force: Keys | None = None,
    free: Key | None = None,
    time_unit: str | None = None,
    window: float = 0.2,
    gap: float | None = None,
    max_speed: float | None = None,
    min_speed: float | None = None,
    min_duration: float | None = None,
) -> Demonstrations:
    """Demonstrations from recordings in CSV, TSV, TXT, NPZ or Parquet files.

    A file that `uc.save` wrote needs no more than its path. Of any other, say which columns are what, by
    name or, where a header repeats its names or is missing, by position (counted from 0). In NPZ and
    Parquet an array or list column of k numbers per sample stands for k columns.

    Without `action`, the actions are the derivative of the states, by Savitzky–Golay within each episode
    (`differentiate`). The states themselves stay as recorded, unsmoothed.

    Parameters
    ----------
    paths : path, pattern such as ``"runs/*.csv"``, or several of them
        A folder is one of Parquet files that are parts of one recording, or a LeRobot dataset (2.0, 2.1, 3.0), whose
        columns have known names; `fit_stream` reads those that do not fit into memory.
    state, action : column, or list of columns
        ``action="differentiate"`` insists on the derivative, where a dataset has actions too.
    time : column
        Seconds or nanoseconds (told by their step) or timestamps; must increase strictly within an episode.
        `Demonstrations.time` counts seconds from the first stamp of each episode as recorded.
    episode : column
        Of any type; its values tell episodes apart and may alternate. Without it every file is an episode;
        with it and several files, every value in every file is.
    force : column, or list of columns, optional
        Measured contact forces, of which `constraints.from_recording` makes projections.
    free : column, optional
        1 where nothing constrained the motion, else 0.
    time_unit : {"s", "ms", "us", "ns"}, optional
        To insist on a unit.
    window : float
        Seconds over which positions are smoothed when they are differentiated.
    gap : float, optional
        A step longer than this (s) splits an episode. By default, when states are differentiated, five
        times the episode's median step.
    max_speed : float, optional
        A step faster than this ([units of the states] / s) splits an episode: trackers flip and jump.
    min_speed : float, optional
        Samples with ‖u‖ below this ([units of the actions]) are left out, after differentiating.
    min_duration : float, optional
        Fragments of a split episode that are shorter than this (s) are dropped, as are those too short
        for `window` when states are differentiated. Episodes that were not split stay.

    Returns
    -------
    Demonstrations
        In the order of the files and their samples. Its `notes` say what was split, dropped or left out,
        and what looks suspicious.

    Raises
    ------
    DataError
        Anything that cannot be read or used, in one sentence that names the file and the place in it.
    """
    for name, value in {
        "window": window,
        "gap": gap,
        "max_speed": max_speed,
        "min_speed": min_speed,
        "min_duration": min_duration,
    }.items():
        if value is not None and not (_is_number(value) and value > 0):
            raise DataError(f"{name} must be a positive number, got {value!r}")
    if time_unit is not None and time_unit not in PER_SECOND:
        raise DataError(f"time_unit must be one of {', '.join(PER_SECOND)}, got {time_unit!r}")
    asked = Roles(state, action, time, episode, force, free)
    files = folder.expanded(recordings(paths), asked)
    several = []
    for shown, label in zip(files, file_labels(files), strict=True):
        demos, table, roles = None, None, asked
        if folder.is_meant(shown):
            table, roles = folder.read(shown, asked)
        else:
            path = existing(shown)
            if state is None and asked != Roles():
                raise DataError(
                    "action, time, episode, force and free columns were given but no state columns; give state= too"
                )
            try:
                demos = read_saved(path, shown) if state is None else None
                table = READERS[path.suffix.lower()](path, shown) if demos is None else None
            except OSError as error:
                raise DataError(f"{shown} cannot be read: {error.strerror or error}") from error
        differentiated = table is not None and roles.differentiated
        if table is not None:
            demos = assigned(table, label, len(files) > 1, roles, time_unit)
        assert demos is not None
        if table is not None or gap is not None or max_speed is not None:
            demos = _split(demos, shown, differentiated, window, gap, max_speed, min_duration)
        if differentiated:
            demos = _differentiated(demos, window)
        if table is not None:
            _check_motion(demos, shown, differentiated)
        several.append(demos)
    _check_same_names(several, files)
    demos = Demonstrations.concatenate(several)
    return demos if min_speed is None else demos.moving(min_speed)


class NothingLeft(DataError):
    """A recording of which no fragment is long enough."""


def derived(
    demos: Demonstrations,
    shown: str,
    *,
    window: float,
    gap: float | None = None,
    max_speed: float | None = None,
    min_duration: float | None = None,
) -> Demonstrations:
    """The demonstrations, split where the recording is broken, with the derivative of the states as actions.

    All as `load` does it, which see; `shown` is what the recording is called in errors and notes.
    """
    return _differentiated(_split(demos, shown, True, window, gap, max_speed, min_duration), window)


def _is_number(value: object) -> bool:
    return isinstance(value, int | float | np.number) and math.isfinite(value)


def _split(
    demos: Demonstrations,
    shown: str,
    differentiated: bool,
    window: float,
    gap: float | None,
    max_speed: float | None,
    min_duration: float | None,
) -> Demonstrations:
    if demos.time is None:
        for name, value in (("gap", gap), ("max_speed", max_speed), ("min_duration", min_duration)):
            if value is not None:
                raise DataError(f"{shown}: {name} needs to know the time of each sample; give time= too")
        return demos
    if differentiated:
        _check_long_enough(demos, shown, window)
    elif gap is None:
        gap = math.inf  # given actions do not depend on their neighbours, so a gap does no harm

    def long_enough(time: NDArray[np.float64]) -> bool:
        # Rounding must not drop a fragment of exactly the duration asked for.
        lasts = time[-1] - time[0] >= (min_duration or 0.0) * (1 - 1e-9)
        return bool(lasts) and (not differentiated or spans_window(time, window))

    found = split(
        demos.states,
        demos.time,
        demos.episodes,
        demos.episode_labels,
        gap=None if gap is None else float(gap),
        max_speed=None if max_speed is None else float(max_speed),
        long_enough=long_enough,
    )
    shortest = max(window if differentiated else 0.0, min_duration or 0.0)
    if not len(found.samples):
        raise NothingLeft(
            f"{shown}: split at {found.gaps} gaps and {found.fast} fast steps, no fragment lasts "
            f"{shortest:g} s; raise gap or max_speed, or lower window or min_duration"
        )
    # Notes travel with the data, so they name the file without the folders of this computer.
    notes, name = list(demos.notes), Path(shown).name
    if found.gaps:
        length = f"{GAP_STEPS:g} typical steps" if gap is None else f"{gap:g} s"
        notes.append(f"{name}: split at {_count(found.gaps, 'gap')} longer than {length}")
    if found.fast:
        notes.append(f"{name}: split at {_count(found.fast, 'step')} faster than {max_speed:g} per second")
    if found.dropped:
        notes.append(
            f"{name}: dropped {_count(found.dropped, 'fragment')} "
            f"({_count(found.dropped_samples, 'sample')}) shorter than {shortest:g} s"
        )
    if max_speed is None and found.suspicious:
        notes.append(
            f"{name}: {_count(found.suspicious, 'step')} more than {SUSPICIOUS:g} times faster than 95 % of them, "
            "as when a tracker jumps; give max_speed to split there"
        )
    chosen = demos.select(found.samples)
    return replace(chosen, episodes=found.episodes, episode_labels=found.labels, notes=tuple(notes))


def _check_long_enough(demos: Demonstrations, shown: str, window: float) -> None:
    assert demos.time is not None
    order = np.argsort(demos.episodes, kind="stable")
    bounds = np.cumsum(np.bincount(demos.episodes))[:-1]
    for label, stamps in zip(demos.episode_labels, np.split(demos.time[order], bounds), strict=True):
        if not spans_window(stamps, window):
            raise DataError(
                f"{shown}: episode {label!r} has {_count(len(stamps), 'sample')} "
                f"over {stamps[-1] - stamps[0]:.3g} s, too few to differentiate with window={window:g} s; "
                "leave it out, or lower window"
            )


def _differentiated(demos: Demonstrations, window: float) -> Demonstrations:
    assert demos.time is not None
    actions = np.empty_like(demos.states)
    order = np.argsort(demos.episodes, kind="stable")
    for own in np.split(order, np.cumsum(np.bincount(demos.episodes))[:-1]):
        actions[own] = differentiate(demos.states[own], demos.time[own], window=window)
    return replace(demos, actions=actions)


def _check_motion(demos: Demonstrations, shown: str, differentiated: bool) -> None:
    if len(demos) < 2:
        raise DataError(f"{shown} has one sample; at least two are needed")
    if not np.any(demos.actions):
        remedy = "the states do not move" if differentiated else "choose other action columns"
        raise DataError(f"all actions of {shown} are zero: {remedy}")


def _check_same_names(several: list[Demonstrations], files: list[str]) -> None:
    """Positions may mean other columns in another file; names tell, where both files have them."""
    for what in ("state", "action"):
        named = [(getattr(demos, f"{what}_names"), file) for demos, file in zip(several, files, strict=True)]
        first, file = named[0]
        for names, other in named[1:]:
            if len(names) != len(first):
                raise DataError(f"{file} has {len(first)} {what} columns but {other} has {len(names)}")
        named = [(names, file) for names, file in named if not all(map(UNNAMED.fullmatch, names))]
        for names, other in named[1:]:
            first, file = named[0]
            if names != first:
                raise DataError(
                    f"the {what} columns are {', '.join(first)} in {file} but {', '.join(names)} in {other}; "
                    "choose them by name, or load the files one by one and concatenate"
                )


def _count(number: int, thing: str) -> str:
    return f"{number} {thing}{'' if number == 1 else 's'}"
