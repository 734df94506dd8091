"""The steps that change states and actions: what is done here depends on what a state is."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from unconstrain.recordings.actions import per_second
from unconstrain.recordings.angles import unwrap
from unconstrain.recordings.derivative import differentiate
from unconstrain.recordings.notes import Note
from unconstrain.recordings.preparing.rows import Notes, Portion, Rows
from unconstrain.recordings.recording import Recording
from unconstrain.recordings.relative import describe, end_of, moving_centre
from unconstrain.recordings.resampling import make_grid

Array = NDArray[np.float64]


def unwrap_states(portion: Portion, rows: Rows) -> tuple[Rows, Notes]:
    """Count the turns of angles on, and keep the sign of quaternions, episode by episode."""
    recording = portion.recording
    if not recording.unwraps:
        return rows, ()
    notes: Notes = ()
    X = rows.X
    for own in rows.runs():
        unwrapped, found = unwrap(
            rows.X[own], recording.roles.state_names, recording.roles.angle, recording.name
        )
        if found:
            X = X.copy() if X is rows.X else X
            X[own] = unwrapped
            notes += found
    return replace(rows, X=X), notes


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
    return rows.on(make_grid(rows.time, rows.codes, rate)), ()


def differentiate_states(portion: Portion, rows: Rows) -> tuple[Rows, Notes]:
    """Make the derivative of the states the actions, where none are given."""
    if not (portion.recording.differentiates and len(rows)):
        return rows, ()
    assert rows.time is not None
    U = np.empty_like(rows.U)
    for own in rows.runs():
        time = rows.time[own]
        U[own] = differentiate(rows.X[own], time, window=portion.recording.fit_window(time))
    return replace(rows, U=U), ()


def relate(portion: Portion, rows: Rows) -> tuple[Rows, Notes]:
    """Take states and actions relative to what the options say."""
    recording = portion.recording
    if not recording.is_relative:
        return rows, ()
    X, U = np.empty_like(rows.X), np.empty_like(rows.U)
    for own in rows.runs():
        X[own], U[own] = _relate(rows.take(own), recording)
    note = Note(
        "relative",
        recording.name,
        describe(recording.columns.relative_to, recording.preparation.moving_centre),
    )
    return replace(rows, X=X, U=U, policy=None), (note,)


def _relate(episode: Rows, recording: Recording) -> tuple[Array, Array]:
    """Return the states and actions of one episode relative to what the options say."""
    columns, how = recording.columns, recording.preparation
    X, U, time, reference = episode.X, episode.U, episode.time, episode.reference
    if reference is not None:
        assert time is not None
        X, U = X - reference, U - differentiate(reference, time, window=recording.fit_window(time))
    elif columns.relative_to is not None:
        X = X - end_of(X, str(columns.relative_to))
    if how.moving_centre is not None:
        assert time is not None
        X, U = X - moving_centre(X, time, how.moving_centre), U - moving_centre(U, time, how.moving_centre)
    return X, U
