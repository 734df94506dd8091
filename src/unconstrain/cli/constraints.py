"""`unconstrain constraints`: the directions in which recordings never move, and how sure that is."""

from pathlib import Path
from typing import Annotated

import typer

from unconstrain import metrics as risk
from unconstrain import plot
from unconstrain.arrays import check_choice
from unconstrain.cli import recordings, reporting
from unconstrain.constraints.learnt import ConstantConstraint, FeatureConstraint
from unconstrain.constraints.learnt.base import LearntConstraint, held_out_projections
from unconstrain.errors import PolicyError
from unconstrain.features import NormalizedRBF

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
    plot.check_suffix(figure)
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
    console.print(learnt.describe(demos.states, demos.action_names), markup=False)
    error = risk.normalized(risk.projected_observation_error(demos.actions, N), demos.actions)
    console.print(
        f"motion across the constraint, on what was held out: {error:.2%} of the actions' variance (nPOE)"
    )
    if figure is not None:
        plot.save(plot.constraint_figure(learnt, demos), figure)
        console.print(f"figure: {figure}")
    learnt.save(out)
    console.print(f"constraint: {out}")


def _estimator(model: str, rows: int | None, n_centers: int) -> LearntConstraint:
    if model == "constant":
        return ConstantConstraint(rows)
    return FeatureConstraint(
        NormalizedRBF(n_centers) if model == "rbf" else None, 1 if rows is None else rows
    )
