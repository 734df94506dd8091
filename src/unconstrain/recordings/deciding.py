"""What actions are, and over how long states are smoothed, is decided once for all recordings, by the first."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from unconstrain.errors import DataError
from unconstrain.recordings.actions import ActionKind, find_kind
from unconstrain.recordings.blocks import number_values
from unconstrain.recordings.columns import DIFFERENTIATE
from unconstrain.recordings.pieces import Piece, read_numbers
from unconstrain.recordings.preparing.motion import resample, unwrap_states
from unconstrain.recordings.preparing.reading import read
from unconstrain.recordings.preparing.rows import Portion, Rows
from unconstrain.recordings.preparing.splitting import split_rows
from unconstrain.recordings.preparing.timing import time_rows
from unconstrain.recordings.recording import FIRST_ROWS, Recording, distinct
from unconstrain.recordings.smoothing import find_smoothing


def decide_kind(recordings: Sequence[Recording], given: str | None) -> tuple[Recording, ...]:
    """Decide what recorded actions are: by the first recording where it is not given.

    Parameters
    ----------
    recordings : sequence of Recording
    given : {"velocity", "target", "increment"}, optional

    Returns
    -------
    tuple of Recording
        Those of commanded states differentiate the states instead.

    Raises
    ------
    DataError
        It is given where no actions are recorded, or needs a time that is not known.
    """
    first = recordings[0]
    if first.differentiates or first.saves:
        if given not in (None, "velocity"):
            raise DataError(
                f"action_is={given} is about recorded actions, and there are none in {first.shown}: name their columns "
                "with action=, or leave it out"
            )
        return tuple(recordings)
    kind = ActionKind(given or _find(first), given is None, first.timed)
    if kind.kind == "velocity":
        return tuple(recordings)
    if given is not None and not kind.timed:
        raise DataError(
            f"{first.shown}: action_is={given} needs to know the time of each sample; give time= or rate= too"
        )
    if kind.kind == "increment" or not kind.timed:
        return tuple(replace(each, kind=kind) for each in recordings)
    return tuple(replace(_differentiated(each), kind=kind) for each in recordings)


def _differentiated(recording: Recording) -> Recording:
    """Return the same recording, whose states are differentiated in place of the actions it has."""
    names = tuple(f"{name}_dot" for name in recording.roles.state_names)
    roles = replace(recording.roles, action=(), policy=(), action_names=names)
    return replace(recording, roles=roles, columns=replace(recording.columns, action=DIFFERENTIATE))


def _find(recording: Recording) -> str:
    """Find what the recorded actions are, by the first rows."""
    roles = recording.roles
    if len(roles.state) != len(roles.action) or roles.state == roles.action:
        return "velocity"
    time = () if roles.time is None else (roles.time,)
    episode = () if roles.episode is None else (roles.episode,)
    pieces: list[Piece] = []
    for piece in recording.read_pieces(distinct(roles.state, roles.action, time, episode)):
        pieces.append(piece.slice(0, FIRST_ROWS))
        if sum(len(each.rows) for each in pieces) >= FIRST_ROWS:
            break
    pieces = [piece for piece in recording.complete(pieces) if len(piece.rows)]
    if not pieces:
        return "velocity"
    both = read_numbers(pieces, (*roles.state, *roles.action), "state and action").astype(np.float64)
    X, U = both[: len(roles.state)].T, both[len(roles.state) :].T
    codes = number_values(recording.labels(pieces))[0]
    order = np.argsort(codes, kind="stable")
    seconds = None
    if roles.time is not None:
        clock = recording.clock
        ticks = np.concatenate([clock.ticks(piece.cells(roles.time, "time")) for piece in pieces])
        seconds = (ticks - ticks[0])[order] / clock.ticks_a_second
    elif recording.timed:
        seconds = recording.count_time(codes)[order]
    return find_kind(X[order], U[order], codes[order], seconds)


def decide_smoothing(recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """Find over how long states are smoothed, and their noise: by the first rows, which may be of several recordings.

    They share one window, so that one noise holds for all velocities. By rows of their own, short recordings could
    hardly tell it.

    Parameters
    ----------
    recordings : sequence of Recording

    Returns
    -------
    tuple of Recording
        What cannot be read stays as it is: that is for whoever reads all of it to say.
    """
    smoothed = [each for each in recordings if each.smooths and each.timed]
    if not smoothed:
        return tuple(recordings)
    parts: list[Rows] = []
    left = FIRST_ROWS
    for recording in smoothed:
        if left <= 0:
            break
        try:
            rows = _prepare_first(recording, left)
        except DataError:
            return tuple(recordings)
        if len(rows):
            parts.append(rows)
        left -= len(rows)
    if not parts:
        return tuple(recordings)
    X = np.concatenate([rows.X for rows in parts])
    time = np.concatenate([rows.time for rows in parts if rows.time is not None])
    before = np.cumsum([0, *(len(rows.origins) for rows in parts)])
    codes = np.concatenate([rows.codes + n for rows, n in zip(parts, before, strict=False)])
    found = find_smoothing(X, time, codes, window=smoothed[0].preparation.window)
    return tuple(replace(each, smoothing=found) if each.smooths else each for each in recordings)


def _prepare_first(recording: Recording, n_rows: int) -> Rows:
    """Prepare the first rows until they would be differentiated; episodes that are too short to tell are left out."""
    how = recording.preparation
    drop = "short" if how.drop is None else f"{how.drop},short"
    probe = replace(recording, preparation=replace(how, drop=drop, window=None, min_duration=None))
    pieces: list[Piece] = []
    count = 0
    for piece in probe.read_pieces(probe.keys(everything=False)):
        pieces.append(piece.slice(0, n_rows - count))
        count += len(pieces[-1].rows)
        if count >= n_rows:
            break
    portion = Portion(probe, pieces, 0, everything=False)
    rows, _ = read(portion)
    for step in (time_rows, unwrap_states, split_rows, resample):
        rows, _ = step(portion, rows)
    return rows
