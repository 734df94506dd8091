"""Recordings, the learnt field and a rollout as a file of Rerun (.rrd), for the viewer robotics people have."""

import os
import warnings
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

import numpy as np
from sklearn.utils.validation import check_is_fitted

from unconstrain import atomic
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError, PolicyError, UnconstrainError
from unconstrain.policies.base import Policy
from unconstrain.simulation import rollout as integrate
from unconstrain.stopping import Movement, MovementStopped, describe_stop
from unconstrain.viewer.rerun_entities import Room, log_field, log_movements, log_rollout
from unconstrain.viewer.rerun_layout import lay_out

SUFFIX = ".rrd"

MOST_STEPS = 5000
"""Of the rollout that is made where none is given."""


def log_rerun(
    policy: Policy,
    demos: Demonstrations,
    path: str | os.PathLike[str],
    *,
    rollout: Demonstrations | None = None,
    coordinates: Sequence[int] | None = None,
    overwrite: bool = False,
) -> tuple[str, ...]:
    """Write recordings, the learnt field and a rollout for Rerun's viewer: ``rerun FILE.rrd`` opens it.

    The time line ``time`` (seconds since each recording began) plays all recordings and the rollout at once, ``sample``
    plays the recordings one after another. Ordinary regression's field is in the file and hidden at first.

    Parameters
    ----------
    policy : Policy
        Fitted.
    demos : Demonstrations
        What it was learnt from, or other recordings of the same states.
    path : str or path
        Of the file, whose name ends in ``.rrd``.
    rollout : Demonstrations, optional
        A movement that `policy.rollout` returned. By default the policy is followed from where the first recording
        starts, for as long as that recording took.
    coordinates : sequence of int, optional
        Which of the states are drawn in space, at most three, counted from 0; by default the first three.
    overwrite : bool
        Whether a file that exists is replaced.

    Returns
    -------
    tuple of str
        What was left out, thinned or approximated, a sentence each. The file holds them as well, as ``notes``.

    Raises
    ------
    DataError
        The name of the file is not right, the file exists, the coordinates are not states, or the recordings or the
        rollout do not go with the policy.
    PolicyError
        It is no policy of this library.
    UnconstrainError
        Rerun, which comes with the extra `rerun`, is not installed, or the file cannot be written.

    Examples
    --------
    >>> uc.viewer.log_rerun(policy, demos, "wipe.rrd")                               # doctest: +SKIP
    ()
    """
    rr = import_rerun()
    target = atomic.as_path(path)
    check_suffix(target)
    if not overwrite and target.exists():
        raise DataError(f"{target} exists: give overwrite= to replace it, or another name")
    if not isinstance(policy, Policy):
        raise PolicyError(f"log_rerun writes a policy of unconstrain, got {type(policy).__name__}")
    check_is_fitted(policy)
    wanted, given = (
        (policy.n_features_in_, policy.n_actions_),
        (demos.states.shape[1], demos.actions.shape[1]),
    )
    if wanted != given:
        raise DataError(
            f"these recordings have {given[0]} states and {given[1]} actions, and the policy {wanted[0]} and "
            f"{wanted[1]}: give those it was learnt from, or others like them"
        )
    if rollout is not None and (rollout.states.shape[1], rollout.actions.shape[1]) != wanted:
        raise DataError(f"rollout= has other states or actions than the policy, {wanted[0]} and {wanted[1]}")
    room = Room.around(demos, coordinates)
    notes = list(room.notes)
    if rollout is None:
        rollout, said = _follow(policy, demos)
        notes += said
    with atomic.replacing(target) as temporary:
        stream = rr.RecordingStream("unconstrain", send_properties=True)
        stream.set_log_tick_enabled(False)
        stream.set_log_time_enabled(False)
        stream.save(temporary)
        stream.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True, strict=True)
        notes += log_movements(stream, policy, demos, room)
        notes += log_field(stream, policy, demos, room)
        if rollout is not None:
            log_rollout(stream, rollout, demos, room)
        lines = "\n".join(f"- {note}" for note in notes) or "- Nothing was left out."
        text = rr.TextDocument(f"# unconstrain\n\n{lines}\n", media_type=rr.MediaType.MARKDOWN)
        stream.log("notes", text, static=True, strict=True)
        stream.send_blueprint(lay_out(demos, room, has_rollout=rollout is not None))
        stream.flush()
        stream.disconnect()
    return tuple(notes)


def check_suffix(path: Path) -> None:
    """Raise `DataError` for a file whose name does not end as Rerun's do."""
    if path.suffix.lower() != SUFFIX:
        raise DataError(f"a file of Rerun's ends in {SUFFIX}: name it so, not {path.name!r}")


def import_rerun() -> ModuleType:
    """Import the package `rerun`.

    Returns
    -------
    module
        The package.

    Raises
    ------
    UnconstrainError
        If it is not installed.
    """
    try:
        import rerun
        import rerun.blueprint
    except ImportError as error:
        raise UnconstrainError(
            f"files for Rerun's viewer are written by rerun-sdk, which cannot be imported here ({error}): "
            "pip install 'unconstrain[rerun]'"
        ) from error
    return rerun


def _follow(policy: Policy, demos: Demonstrations) -> tuple[Movement | None, list[str]]:
    """Follow the policy from where the first recording starts, for as long as it took, and say what is to be said."""
    first = demos.episode(0)
    if first.time is None or len(first) < 2:
        return None, [
            "There is no rollout: the first recording has no times to follow it for, so give one with rollout=."
        ]
    dt = float(np.median(np.diff(first.time)))
    steps = min(len(first) - 1, MOST_STEPS)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", MovementStopped)  # which the notes say
            movement = integrate(policy, first.states[0], steps, dt)
    except UnconstrainError as error:
        return None, [f"There is no rollout: {error}."]
    label = demos.episode_labels[0]
    said = [f"The rollout starts where recording {label} does and takes {steps} steps of {dt:g} s."]
    said += [f"It stopped: {describe_stop(stop, steps, movement.state_names)}." for stop in movement.stopped]
    return movement, said
