"""`unconstrain diagnose`: what recordings cannot tell, before the robot moves."""

from pathlib import Path

import click

from unconstrain.cli import comparing, constraining, models, outputs, recordings, reporting
from unconstrain.cli.command import command
from unconstrain.cli.declared import Number
from unconstrain.errors import PolicyError
from unconstrain.progress import working

THRESHOLD = 1e-3  # of `diagnostics.spectrum`, which is not imported before it is needed


@command(
    short_help="Say what recordings leave undetermined, and what to record.",
    epilog="For example:\n\n\b\nunconstrain diagnose wipe.csv --state x,y,z --time t --episode run",
)
@recordings.recorded
@constraining.constraint
@models.model
@recordings.folds
@outputs.figure("Draw how far the policy is determined")
@outputs.overwrite
@click.option(
    "-k",
    "--most",
    "most",
    type=click.IntRange(1, 100),
    metavar="NUMBER",
    default=3,
    show_default=True,
    help="How many regions and recordings to name.",
)
@click.option(
    "--threshold",
    type=Number(),
    default=THRESHOLD,
    show_default=True,
    help="A direction of which a smaller share was observed is undetermined.",
)
def diagnose(
    recorded: recordings.Recorded,
    constraint: Path | None,
    model: models.Model,
    folds: str | None,
    figure: Path | None,
    overwrite: bool,
    most: int,
    threshold: float,
) -> None:
    """Say how far recordings determine the policy, where they do not, and what to record next."""
    outputs.check_outputs(recorded.files, {"figure": figure}, overwrite=overwrite)
    if model.is_chosen:
        raise PolicyError("this command is about one model: choose --model linear, rbf or locally-linear")
    from unconstrain.diagnostics import identifiability

    with working("reading"):
        demos = constraining.tell(recorded.load(), constraint)
    recordings.describe(demos)
    comparison = comparing.compare(demos, model, folds)
    evaluation = comparing.evaluate(comparison, demos, recorded.options_used)
    with working("diagnosing"):
        found = identifiability(comparison.policy, demos, threshold=threshold)
        text = found.describe(demos.state_names, demos.action_names, most)
    if figure is not None:
        from unconstrain import plot
        from unconstrain.plot import figures

        plot.save(figures.draw_identifiability(found), figure)
    comparing.describe(comparison, evaluation)
    reporting.say()
    reporting.say(text)
    if found.n_silent:
        reporting.say(f"{found.n_silent} samples do not move, and say nothing")
    if figure is not None:
        reporting.say(f"figure: {figure}")
