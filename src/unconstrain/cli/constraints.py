"""`unconstrain constraints`: the directions in which recordings never move, and how sure that is."""

from pathlib import Path

import click

from unconstrain.cli import outputs, recordings, reporting
from unconstrain.cli.command import command
from unconstrain.errors import PolicyError
from unconstrain.progress import working

MODELS = ("constant", "linear", "rbf")
N_CENTERS = 10


@command(
    short_help="Find the constraint that recordings moved under.",
    epilog="For example:\n\n\b\nunconstrain constraints wipe.csv --state x,y,z --time t --out table.skops",
)
@recordings.recorded
@click.option(
    "--model",
    type=click.Choice(MODELS),
    default="constant",
    show_default=True,
    help="constant rows, or rows that vary with the state: linear, rbf.",
)
@click.option(
    "--rows",
    "n_constraints",
    type=click.IntRange(min=1),
    metavar="NUMBER",
    help="How many rows; by default as many as the motion tells (constant), or 1.",
)
@click.option(
    "--n-centers",
    type=click.IntRange(min=1),
    metavar="NUMBER",
    help=f"How many RBFs; {N_CENTERS} by default.",
)
@outputs.out("constraint.skops", "Where the constraint is saved.")
@outputs.figure("Draw shares of motion and rows")
@outputs.overwrite
def constraints(
    recorded: recordings.Recorded,
    model: str,
    n_constraints: int | None,
    n_centers: int | None,
    out: Path,
    figure: Path | None,
    overwrite: bool,
) -> None:
    """Find the constraint that recordings moved under: rows A with A u = 0."""
    outputs.check_outputs(recorded.files, {"out": out, "figure": figure}, overwrite=overwrite)
    if n_centers is not None and model != "rbf":
        raise PolicyError(f"n_centers= is for --model rbf, and this is {model}")
    from unconstrain import metrics, plot
    from unconstrain.constraints.learnt import ConstantConstraint, FeatureConstraint
    from unconstrain.constraints.learnt.base import held_out_projections
    from unconstrain.features import NormalizedRBF

    if model == "constant":
        estimator = ConstantConstraint(n_constraints)
    else:
        features = NormalizedRBF(n_centers or N_CENTERS) if model == "rbf" else None
        estimator = FeatureConstraint(features, n_constraints or 1)
    with working("reading"):
        demos = recorded.load()
    recordings.describe(demos)
    data, groups = (demos.states, demos.actions), demos.folds()
    with working("fitting"):
        learnt = estimator.fit(*data, groups=groups)
        error = metrics.projected_observation_error(
            demos.actions, held_out_projections(estimator, *data, groups)
        )
    learnt.save(out)
    if figure is not None:
        plot.save(plot.constraint_figure(learnt, demos), figure)
    reporting.say(learnt.describe(demos.states, demos.action_names))
    reporting.say(
        "motion across the constraint, on what was held out: "
        f"{metrics.normalized(error, demos.actions):.2%} of the actions' variance (nPOE)"
    )
    if figure is not None:
        reporting.say(f"figure: {figure}")
    reporting.say(f"constraint: {out}")
