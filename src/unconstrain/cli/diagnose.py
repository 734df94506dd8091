"""`unconstrain diagnose`: what recordings cannot tell, before the robot moves."""

from pathlib import Path
from typing import Annotated

import typer

from unconstrain import plot
from unconstrain.arrays import check_choice
from unconstrain.cli import models, recordings, reporting
from unconstrain.diagnostics import identifiability
from unconstrain.diagnostics.spectrum import THRESHOLD
from unconstrain.errors import PolicyError

CHOICES = tuple(name for name in models.MODELS if name != "auto")


def diagnose(
    context: typer.Context,
    files: recordings.Files,
    state: recordings.State = None,
    action: recordings.Action = None,
    time: recordings.Time = None,
    episode: recordings.Episode = None,
    model: Annotated[str, typer.Option("--model", help=f"One of {', '.join(CHOICES)}.")] = "locally-linear",
    alpha: models.Alpha = "cv",
    centers: models.Centers = None,
    n_centers: models.NCenters = None,
    width: models.Width = None,
    folds: recordings.Folds = None,
    k: Annotated[
        int, typer.Option("--most", "-k", min=1, help="How many regions and recordings to name.")
    ] = 3,
    threshold: Annotated[
        float, typer.Option("--threshold", help="A direction of which less was seen is undetermined.")
    ] = THRESHOLD,
    figure: Annotated[
        Path | None, typer.Option("--figure", help="Draw how far the policy is determined (PNG, SVG, PDF).")
    ] = None,
    time_unit: recordings.TimeUnit = None,
    window: recordings.Window = None,
    gap: recordings.Gap = None,
    max_speed: recordings.MaxSpeed = None,
    min_speed: recordings.MinSpeed = None,
    min_duration: recordings.MinDuration = None,
) -> None:
    """Say how far recordings determine the policy, where they do not, and what to record next.

    `unconstrain diagnose wipe.csv --state x,y,z --time t --episode run --model locally-linear`
    """
    recordings.check_writable(figure)
    plot.check_suffix(figure)
    check_choice(model, "--model", models.MODELS)
    if model == "auto":
        raise PolicyError(f"diagnose is about one model: choose --model {' or '.join(CHOICES)}")
    how = recordings.asked(context.params)
    policy = models.build(model, alpha=models.decay(alpha), centers=centers, n_centers=n_centers, width=width)
    console = reporting.console()
    with console.status("reading"):
        demos = recordings.read(files, how)
    recordings.describe(console, demos)
    with console.status("fitting"):
        policy.fit(demos.states, demos.actions, groups=recordings.folds_of(demos, folds))
    with console.status("diagnosing"):
        labels = [demos.episode_labels[code] for code in demos.episodes]
        report = identifiability(policy, demos.states, demos.actions, groups=labels, threshold=threshold)
        text = report.describe(demos.state_names, demos.action_names, k)
    console.print(text, markup=False)
    if report.n_silent:
        console.print(f"{report.n_silent} samples do not move, and say nothing")
    if figure is not None:
        plot.save(plot.identifiability_figure(report, demos.state_names), figure)
        console.print(f"figure: {figure}")
