"""`unconstrain constraints`: the directions in which recordings never move, and how sure that is."""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console

from unconstrain import metrics as risk
from unconstrain.arrays import check_choice
from unconstrain.cli import recordings, reporting
from unconstrain.constraints.learnt import ConstantConstraint, FeatureConstraint
from unconstrain.constraints.learnt.base import LearntConstraint, held_out_projections
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import PolicyError
from unconstrain.features import NormalizedRBF
from unconstrain.plot import constraint as constraint_figures
from unconstrain.plot import policy as figures

MODELS = ("constant", "linear", "rbf")

Model = Annotated[
    str,
    typer.Option("--model", help="constant; or rows that vary with the state: linear, rbf."),
]
Rows = Annotated[
    int | None, typer.Option("--rows", help="How many rows; by default as the motion tells (constant), or 1.")
]
NCenters = Annotated[int | None, typer.Option("--n-centers", help="How many RBFs (10).")]
Out = Annotated[Path, typer.Option("--out", help="Where the constraint is saved.")]
Figure = Annotated[
    Path | None, typer.Option("--figure", help="Draw shares of motion and rows (PNG, SVG, PDF).")
]


def constraints(
    context: typer.Context,
    files: recordings.Files,
    state: recordings.State = None,
    action: recordings.Action = None,
    time: recordings.Time = None,
    episode: recordings.Episode = None,
    model: Model = "constant",
    rows: Rows = None,
    n_centers: NCenters = None,
    out: Out = Path("constraint.skops"),
    figure: Figure = None,
    time_unit: recordings.TimeUnit = None,
    window: recordings.Window = None,
    gap: recordings.Gap = None,
    max_speed: recordings.MaxSpeed = None,
    min_speed: recordings.MinSpeed = None,
    min_duration: recordings.MinDuration = None,
) -> None:
    """Find the constraint that recordings moved under: rows A with A u = 0.

    `unconstrain constraints wipe.csv --state x,y,z --time t --out table.skops`
    """
    recordings.check_writable(out, figure)
    figures.check_suffix(figure)
    check_choice(model, "--model", MODELS)
    if n_centers is not None and model != "rbf":
        raise PolicyError(f"--n-centers is for --model rbf, and this is {model}")
    how = recordings.asked(context.params)
    estimator = _estimator(model, rows, 10 if n_centers is None else n_centers)
    console = reporting.console()
    with console.status("reading"):
        demos = recordings.read(files, how)
    recordings.describe(console, demos)
    groups = recordings.folds_of(demos, None)
    with console.status("fitting"):
        learnt = estimator.fit(demos.states, demos.actions, groups=groups)
        N = held_out_projections(estimator, demos.states, demos.actions, groups)
    _report(console, demos, learnt)
    error = risk.normalized(risk.projected_observation_error(demos.actions, N), demos.actions)
    console.print(
        f"motion across the constraint, on what was held out: {error:.2%} of the actions' variance (nPOE)"
    )
    if figure is not None:
        figures.save(constraint_figures.found(demos, learnt), figure)
        console.print(f"figure: {figure}")
    learnt.save(out)
    console.print(f"constraint: {out}")


def _estimator(model: str, rows: int | None, n_centers: int) -> LearntConstraint:
    if model == "constant":
        return ConstantConstraint(rows)
    return FeatureConstraint(
        NormalizedRBF(n_centers) if model == "rbf" else None, 1 if rows is None else rows
    )


def _report(console: Console, demos: Demonstrations, learnt: LearntConstraint) -> None:
    console.print(f"rows: {learnt.n_constraints_} ({learnt.reason_})")
    names = demos.action_names
    A = learnt.rows(demos.states)
    if isinstance(learnt, ConstantConstraint):
        for row in A[0]:
            console.print(f"  {equation(row, names)}")
        console.print(f"how sure: standard error of the direction {np.degrees(learnt.uncertainty_):.2g}°")
        return
    for j in range(A.shape[1]):
        mean = constraint_figures.middle(A[:, j])
        turned = np.degrees(np.arccos(np.clip(np.abs(A[:, j] @ mean), 0.0, 1.0)))
        console.print(
            f"  {equation(mean, names)}   on average; it turns by {np.median(turned):.0f}° (median)"
        )


def equation(row: np.ndarray, names: tuple[str, ...]) -> str:
    """A row as the equation it states, its largest term first: `0.85 z - 0.42 x ≈ 0`."""
    row = row * np.sign(row[np.argmax(np.abs(row))])
    text = ""
    for i in np.argsort(-np.abs(row)):
        if abs(row[i]) >= 0.0005:
            text += f" {'-' if row[i] < 0 else '+'} {abs(row[i]):.3f} {names[i]}"
    return text.removeprefix(" + ") + " ≈ 0"
