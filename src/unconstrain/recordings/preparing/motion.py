"""The steps that change states and actions: what is done here depends on what a state is."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from unconstrain.errors import DataError
from unconstrain.recordings.actions import per_second
from unconstrain.recordings.angles import unwrap
from unconstrain.recordings.derivative import differentiate
from unconstrain.recordings.notes import Note
from unconstrain.recordings.preparing.rows import Notes, Portion, Rows
from unconstrain.recordings.recording import Recording
from unconstrain.recordings.relative import describe, end_of, moving_centre
from unconstrain.recordings.resampling import make_grid
from unconstrain.spaces import Pose, Space
from unconstrain.spaces.frames import relate as relate_to
from unconstrain.spaces.frames import takes_frame

Array = NDArray[np.float64]


def follow_states(portion: Portion, rows: Rows) -> tuple[Rows, Notes]:
    """Count the turns of angles on, and keep the sign of quaternions, episode by episode."""
    recording, space = portion.recording, portion.recording.recorded_space
    if not space.is_flat and len(rows):
        _check_rotations(portion, rows, space, rows.X, "the states")
    if not recording.unwraps:
        return rows, ()
    notes: Notes = ()
    X = rows.X
    roles = recording.roles
    rotated = tuple(i for columns in roles.rotations for i in columns)
    for own in rows.runs():
        unwrapped, found = unwrap(rows.X[own], roles.state_names, roles.angle, recording.name, rotated)
        if found or rotated:
            X = X.copy() if X is rows.X else X
            X[own] = space.follow(unwrapped) if rotated else unwrapped
            notes += found
    return replace(rows, X=X), notes


def _check_rotations(portion: Portion, rows: Rows, space: Space, X: Array, what: str) -> None:
    recording = portion.recording
    faults = space.faults(X)
    if faults.any():
        row = portion.start + int(rows.numbers[int(np.argmax(faults))])
        raise DataError(
            f"{recording.shown}: {what} in row {row} (counted from 0) are no rotation, where they should be "
            f"{space.words}; correct that row or leave it out"
        )


def divide_increments(portion: Portion, rows: Rows) -> tuple[Rows, Notes]:
    """Make velocities of actions that are steps to the next state."""
    if rows.time is None or portion.recording.kind.kind != "increment":
        return rows, ()
    U = np.empty_like(rows.U)
    for own in rows.runs():
        U[own] = per_second(rows.U[own], rows.time[own])
    return replace(rows, U=U), ()


def resample(portion: Portion, rows: Rows) -> tuple[Rows, Notes]:
    """Bring rows to even times, fragment by fragment, so that nothing is interpolated across a gap."""
    rate = portion.recording.preparation.resample
    if rate is None or rows.time is None or not len(rows):
        return rows, ()
    grid, space = make_grid(rows.time, rows.codes, rate), portion.recording.recorded_space
    even = rows.on(grid)
    if space.is_flat:
        return even, ()
    X = space.between(rows.X[grid.before], rows.X[grid.after], grid.share)
    reference = even.reference
    if rows.reference is not None:
        kind = space if rows.reference.shape[1] == space.n_states else Pose()
        reference = kind.between(rows.reference[grid.before], rows.reference[grid.after], grid.share)
    return replace(even, X=X, reference=reference), ()


def differentiate_states(portion: Portion, rows: Rows) -> tuple[Rows, Notes]:
    """Make the derivative of the states the actions, where none are given."""
    if not (portion.recording.differentiates and len(rows)):
        return rows, ()
    assert rows.time is not None
    U = np.empty_like(rows.U)
    for own in rows.runs():
        U[own] = _velocities(portion.recording.recorded_space, rows.X[own], rows.time[own], portion.recording)
    return replace(rows, U=U), ()


def accelerate(portion: Portion, rows: Rows) -> tuple[Rows, Notes]:
    """Add velocities to the states, and make accelerations the actions, for a policy of second order.

    The true policy is gone then, which is one of velocities.
    """
    recording = portion.recording
    if recording.preparation.order != 2:
        return rows, ()
    U = np.empty_like(rows.U)
    for own in rows.runs():
        assert rows.time is not None
        U[own] = differentiate(rows.U[own], rows.time[own], window=recording.fit_window(rows.time[own]))
    text = (
        "states are positions and velocities, and actions accelerations; order=1 takes velocities for actions"
    )
    note = Note("order", recording.name, text)
    return replace(rows, X=np.hstack([rows.X, rows.U]), U=U, policy=None), (note,)


def _velocities(space: Space, X: Array, time: Array, recording: Recording) -> Array:
    """Differentiate the states (N, n) of one episode."""
    C = space.coordinates(X)
    return space.velocity(C, differentiate(C, time, window=recording.fit_window(time)))


def relate(portion: Portion, rows: Rows) -> tuple[Rows, Notes]:
    """Take states and actions relative to what the options say."""
    recording = portion.recording
    if not recording.is_relative:
        return rows, ()
    X, U = np.empty_like(rows.X), np.empty_like(rows.U)
    for own in rows.runs():
        X[own], U[own] = _relate(portion, rows.take(own))
    space, to = recording.recorded_space, recording.columns.relative_to
    in_frame = not space.is_flat or (
        rows.reference is not None and takes_frame(space, rows.reference.shape[1])
    )
    note = Note(
        "relative",
        recording.name,
        describe(to, recording.preparation.moving_centre, in_frame=in_frame),
    )
    return replace(rows, X=X, U=U, policy=None), (note,)


def _relate(portion: Portion, episode: Rows) -> tuple[Array, Array]:
    """Return the states and actions of one episode relative to what the options say."""
    recording = portion.recording
    columns, how, space = recording.columns, recording.preparation, recording.recorded_space
    X, U, time, reference = episode.X, episode.U, episode.time, episode.reference
    if reference is not None:
        assert time is not None
        kind = Pose() if takes_frame(space, reference.shape[1]) else space
        if not kind.is_flat:
            _check_rotations(portion, episode, kind, reference, "the columns of relative_to=")
        reference = kind.follow(reference)
        X, U = relate_to(space, X, U, reference, _velocities(kind, reference, time, recording))
        X = space.follow(X)
    elif columns.relative_to is not None:
        end = np.tile(end_of(X, str(columns.relative_to)), (len(X), 1))
        if U.shape[1] == space.n_actions:
            X, U = relate_to(space, X, U, end, np.zeros_like(U))
        else:
            X = space.relative(X, end)
        X = space.follow(X)
    if how.moving_centre is not None:
        assert time is not None
        X, U = X - moving_centre(X, time, how.moving_centre), U - moving_centre(U, time, how.moving_centre)
    return X, U
