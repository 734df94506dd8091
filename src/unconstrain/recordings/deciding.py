"""What states and actions are, over how long states are smoothed, how long episodes take: decided once for all."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.errors import DataError
from unconstrain.recordings.actions import ActionKind, find_kind
from unconstrain.recordings.blocks import number_values
from unconstrain.recordings.columns import DIFFERENTIATE
from unconstrain.recordings.notes import Note
from unconstrain.recordings.phase import describe, mean_duration
from unconstrain.recordings.pieces import Piece, read_numbers
from unconstrain.recordings.preparing.filling import fill_columns
from unconstrain.recordings.preparing.motion import follow_states, resample
from unconstrain.recordings.preparing.reading import read
from unconstrain.recordings.preparing.rows import Portion, Rows
from unconstrain.recordings.preparing.splitting import split_rows
from unconstrain.recordings.preparing.timing import time_rows
from unconstrain.recordings.recording import FIRST_ROWS, Recording, distinct
from unconstrain.recordings.smoothing import find_smoothing
from unconstrain.recordings.states import FirstRows, arrange_reference, find_frame, find_space, in_frame
from unconstrain.recordings.steps import runs
from unconstrain.spaces import Numbers, Phased, Space
from unconstrain.spaces.frames import takes_frame

WORLD = "angular velocities are in the world's frame, in rad/s; angular_velocity=body takes the body's"
"""What is said where angular velocities are made of how the states turn."""


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
    if kind.kind in ("increment", "scaled") or not kind.timed:
        return tuple(replace(each, kind=kind) for each in recordings)
    return tuple(replace(_differentiated(each), kind=kind) for each in recordings)


def decide_space(recordings: Sequence[Recording]) -> tuple[tuple[Recording, ...], tuple[Note, ...]]:
    """Decide what states are: by the first recording where it is not given.

    Parameters
    ----------
    recordings : sequence of Recording
        Their space is numbers as yet.

    Returns
    -------
    tuple of Recording
        Each with its space, and what it is relative to in the order of its states.
    tuple of Note
        What was guessed.

    Raises
    ------
    DataError
        Columns that are given as a rotation are none, or states cannot be relative to what is given.
    """
    first = recordings[0]
    space, notes = _find_space(first)
    if not first.roles.action and not first.saves:
        names = space.action_names(first.roles.state_names)
        recordings = [replace(each, roles=replace(each.roles, action_names=names)) for each in recordings]
    _check_relative(first, space)
    every = []
    for each in recordings:
        roles = each.roles
        if roles.reference:
            order = arrange_reference(space, roles.reference_names)
            roles = replace(roles, reference=tuple(roles.reference[i] for i in order))
        every.append(replace(each, roles=roles, known_space=space))
    return tuple(every), notes


def _find_space(recording: Recording) -> tuple[Space, tuple[Note, ...]]:
    roles, how, plain = recording.roles, recording.preparation, Numbers(len(recording.roles.state))
    if recording.saves:
        saved = recording.declared.space if recording.declared is not None else None
        return saved or plain, ()
    if not (roles.rotations or roles.angle or (roles.angle is None and recording.differentiates)):
        return plain, ()
    is_asked = bool(roles.rotations or roles.angle)
    try:
        rows = _read_first(recording)
    except DataError:
        if is_asked:
            raise
        return plain, ()  # what is wrong is told where it is read
    space, notes = find_space(rows, roles, how, recording.shown)
    if roles.rotations and not roles.action and how.angular_velocity is None:
        notes = (*notes, Note("frame", "", WORLD))
    if roles.rotations and roles.action and how.angular_velocity is None:
        frame, found = find_frame(rows, space)
        space, notes = in_frame(space, frame), (*notes, *found)
    return space, notes


def _check_relative(recording: Recording, space: Space) -> None:
    roles, how, shown = recording.roles, recording.preparation, recording.shown
    count, n = len(roles.reference), space.n_states
    if count and count != n and not takes_frame(space, count):
        raise DataError(
            f"{shown}: relative_to= takes start, goal, or one column for each of the {n} states, and stands for "
            f"{count} here"
        )
    if isinstance(space, Phased) and (how.phase or how.order == 2 or how.moving_centre is not None):
        raise DataError(
            f"{shown}: these states have a phase already; give phase=, order= and moving_centre= where the recordings "
            "are read that they were made of"
        )
    if count and takes_frame(space, count) and how.order == 2:
        raise DataError(
            f"{shown}: order=2 and relative_to= a frame go together for states that are poses only"
        )
    if space.is_flat:
        return
    if how.moving_centre is not None and roles.rotations:
        raise DataError(f"{shown}: moving_centre= is for numbers and angles, and some states are rotations")
    if recording.is_relative and roles.action and len(roles.action) != space.n_actions:
        raise DataError(
            f"{shown}: the velocities of states that are {space.words} have {space.n_actions} numbers, and there are "
            f"{len(roles.action)} actions, which cannot be made relative: choose other action columns"
        )


def _differentiated(recording: Recording) -> Recording:
    """Return the same recording, whose states are differentiated in place of the actions it has."""
    names = recording.recorded_space.action_names(recording.roles.state_names)
    roles = replace(recording.roles, action=(), policy=(), action_names=names)
    return replace(recording, roles=roles, columns=replace(recording.columns, action=DIFFERENTIATE))


def _find(recording: Recording) -> str:
    """Find what the recorded actions are, by the first rows."""
    roles = recording.roles
    if len(roles.state) != len(roles.action) or roles.state == roles.action:
        return "velocity"
    rows = _read_first(recording)
    if rows.U is None or not len(rows.X):
        return "velocity"
    return find_kind(rows.X, rows.U, rows.codes, rows.time)


def _read_first(recording: Recording) -> FirstRows:
    roles = recording.roles
    time = () if roles.time is None else (roles.time,)
    episode = () if roles.episode is None else (roles.episode,)
    pieces: list[Piece] = []
    for piece in recording.read_pieces(distinct(roles.state, roles.action, time, episode)):
        pieces.append(piece.slice(0, FIRST_ROWS))
        if sum(len(each.rows) for each in pieces) >= FIRST_ROWS:
            break
    pieces = [piece for piece in recording.complete(pieces) if len(piece.rows)]
    if not pieces:
        none = np.zeros((0, len(roles.state)))
        return FirstRows(none, None, np.zeros(0, dtype=np.int64), None)
    both = read_numbers(pieces, (*roles.state, *roles.action), "state and action").astype(np.float64)
    codes = number_values(recording.labels(pieces))[0]
    order = np.argsort(codes, kind="stable")
    seconds = None
    if roles.time is not None:
        clock = recording.clock
        ticks = np.concatenate([clock.ticks(piece.cells(roles.time, "time")) for piece in pieces])
        seconds = (ticks - ticks[0])[order] / clock.ticks_a_second
    elif recording.timed:
        seconds = recording.count_time(codes)[order]
    n = len(roles.state)
    U = both[n:].T[order] if roles.action else None
    return FirstRows(both[:n].T[order], U, codes[order], seconds)


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
    X = np.concatenate([_coordinates(smoothed[0].recorded_space, rows) for rows in parts])
    time = np.concatenate([rows.time for rows in parts if rows.time is not None])
    before = np.cumsum([0, *(len(rows.origins) for rows in parts)])
    codes = np.concatenate([rows.codes + n for rows, n in zip(parts, before, strict=False)])
    found = find_smoothing(X, time, codes, window=smoothed[0].preparation.window)
    return tuple(replace(each, smoothing=found) if each.smooths else each for each in recordings)


def decide_duration(recordings: Sequence[Recording]) -> tuple[tuple[Recording, ...], tuple[Note, ...]]:
    """Find how long an episode takes, where states get a phase: the mean over all of them, of all recordings.

    Nothing but stamps and episodes is read for it.

    Parameters
    ----------
    recordings : sequence of Recording

    Returns
    -------
    tuple of Recording
        Each with that duration.
    tuple of Note
        What a phase means.

    Raises
    ------
    DataError
        Stamps cannot be read, or no episode lasts any time.
    """
    if not recordings[0].preparation.phase:
        return tuple(recordings), ()
    durations = [each for recording in recordings for each in _durations(recording)]
    found = mean_duration(durations, recordings[0].shown)
    return tuple(replace(each, duration=found) for each in recordings), (
        Note("phase", "", describe(durations)),
    )


def _durations(recording: Recording) -> list[float]:
    """Return how long (s) episodes last, without those that are left out for being short."""
    time = recording.roles.time
    episode = () if recording.roles.episode is None else (recording.roles.episode,)
    fields = recording.roles.state[:1] if time is None else (time,)
    ends: dict[Any, tuple[Any, Any]] = {}
    for piece in recording.read_pieces(distinct(fields, episode)):
        # Rows that are left out count too where time is counted by rows: they took their time.
        (timed,) = [piece] if time is None else recording.complete([piece], ("time",))
        if not len(timed.rows):
            continue
        codes, found = number_values(recording.labels([timed]))
        if time is None:
            ticks = np.empty(len(codes))
            for own, label in zip(runs(codes), found, strict=True):
                ticks[own] = np.arange(len(own)) + (ends[label][1] + 1 if label in ends else 0)
        else:
            ticks = recording.clock.ticks(timed.alike(time, "time"))
        for own, label in zip(runs(codes), found, strict=True):
            first, last = ticks[own].min(), ticks[own].max()
            before = ends.get(label, (first, last))
            ends[label] = min(first, before[0]), max(last, before[1])
    a_second = recording.preparation.rate if time is None else recording.clock.ticks_a_second
    assert a_second is not None
    lasted = [float(last - first) / a_second for first, last in ends.values()]
    least = recording.shortest if recording.preparation.drops("short") else 0.0
    return [each for each in lasted if each >= least]


def _coordinates(space: Space, rows: Rows) -> NDArray[np.float64]:
    """Return what is differentiated, (N, c)."""
    C = np.empty((len(rows), space.coordinates(space.origin[None]).shape[1]))
    for own in rows.runs():
        C[own] = space.coordinates(rows.X[own])
    return C


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
    for step in (time_rows, fill_columns, follow_states, split_rows, resample):
        rows, _ = step(portion, rows)
    return rows
