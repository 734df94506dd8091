"""`unconstrain evaluate`: a policy against recordings it has not seen."""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.table import Table

from unconstrain import metrics as risk
from unconstrain.cli import recordings, reporting
from unconstrain.errors import DataError
from unconstrain.policies import load_policy


def evaluate(
    context: typer.Context,
    policy: Annotated[Path, typer.Argument(help="A policy saved by `unconstrain fit`.", metavar="POLICY")],
    files: recordings.Files,
    state: recordings.State = None,
    action: recordings.Action = None,
    time: recordings.Time = None,
    episode: recordings.Episode = None,
    time_unit: recordings.TimeUnit = None,
    window: recordings.Window = None,
    gap: recordings.Gap = None,
    max_speed: recordings.MaxSpeed = None,
    min_speed: recordings.MinSpeed = None,
    min_duration: recordings.MinDuration = None,
) -> None:
    """Hold a saved policy against other recordings.

    They are read as those it was learnt from, unless an option says otherwise; --state names all columns anew.
    """
    learnt = load_policy(policy)
    how = recordings.asked(context.params)
    how = recordings.as_before(getattr(learnt, "recording_", {}), how)
    console = reporting.console()
    demos = recordings.read(files, how)
    recordings.describe(console, demos)
    if demos.states.shape[1] != learnt.n_features_in_ or demos.actions.shape[1] != learnt.n_actions_:
        raise DataError(
            f"{policy} maps {learnt.n_features_in_} states to {learnt.n_actions_} actions, but the recordings have "
            f"{demos.states.shape[1]} and {demos.actions.shape[1]}: choose the columns it was learnt from"
        )
    P = learnt.predict(demos.states).reshape(demos.actions.shape)
    table = Table("episode", "samples", "inconsistency", "share of observed motion explained")
    rows = [(demos.episode_labels[code], demos.episodes == code) for code in range(demos.n_episodes)]
    if len(rows) > 1:
        for label, mask in rows[:20]:
            _add(table, label, demos.actions[mask], P[mask])
        if len(rows) > 20:
            table.add_row(f"... {len(rows) - 20} more", "", "", "")
    _add(table, "all", demos.actions, P)
    console.print(table)
    if demos.policy is not None:
        error = risk.normalized(risk.unconstrained_policy_error(demos.policy, P), demos.policy)
        console.print(f"these recordings carry the true policy: nUPE {error:.4g}")


def _add(table: Table, label: str, U: np.ndarray, P: np.ndarray) -> None:
    share = f"{risk.explained(U, P):.2%}" if np.any(U) else "nothing moves"
    table.add_row(label, str(len(U)), f"{risk.inconsistency(U, P):.4g}", share)
