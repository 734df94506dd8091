"""What the actions of recordings are is decided once for all of them, by the first."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from unconstrain.errors import DataError
from unconstrain.recordings.actions import ActionKind, find_kind
from unconstrain.recordings.blocks import number_values
from unconstrain.recordings.columns import DIFFERENTIATE
from unconstrain.recordings.pieces import Piece, read_numbers
from unconstrain.recordings.recording import FIRST_ROWS, Recording, distinct


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
