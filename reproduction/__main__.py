"""`unconstrain reproduce`: the paper's experiments, and those that go beyond it."""

import inspect
import os
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.markdown import Markdown

from reproduction import EXPERIMENTS, experiment, report
from unconstrain.errors import UnconstrainError


def reproduce(
    name: Annotated[str, typer.Argument(help=f"{', '.join(EXPERIMENTS)}, or all.", metavar="EXPERIMENT")],
    trials: Annotated[
        int | None,
        typer.Option("--trials", "--datasets", min=1, help="How many; by default as many as published."),
    ] = None,
    jobs: Annotated[int, typer.Option("--jobs", min=1, help="Processes.")] = os.cpu_count() or 1,
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder for results; finished trials are kept in it.")
    ] = None,
    model: Annotated[
        str | None, typer.Option("--model", help="arm, grasp: auto chooses the model by the data.")
    ] = None,
    constraint: Annotated[
        str | None,
        typer.Option("--constraint", help="arm: task rows 1-2-3, a plane's normal 0,0,1, or a matrix."),
    ] = None,
    physics: Annotated[
        bool, typer.Option("--physics", help="arm: with simulated dynamics and contact.")
    ] = False,
    robot: Annotated[
        Path | None, typer.Option("--robot", help="grasp, posture: your robot, MJCF or URDF.")
    ] = None,
    lock: Annotated[
        str | None, typer.Option("--lock", help="grasp, posture: joints of it to lock, by commas.")
    ] = None,
    hands: Annotated[
        str | None, typer.Option("--hands", help="grasp, posture: its hand frames, LEFT,RIGHT.")
    ] = None,
    feet: Annotated[
        str | None,
        typer.Option(
            "--feet", help="grasp: its foot bodies, LEFT,RIGHT; without them its base stands still."
        ),
    ] = None,
    video: Annotated[Path | None, typer.Option("--video", help="grasp: also render a video.")] = None,
) -> None:
    """Run an experiment: table "published | ours", figures, and all trials as JSON."""
    console = Console()
    out = out or Path("reproduction") / ("" if name == "all" else name)
    options: dict[str, Any] = {
        "model": model,
        "constraint": constraint,
        "robot": robot,
        "lock": lock,
        "hands": hands,
        "feet": feet,
        "video": video,
    }
    options = {option: value for option, value in options.items() if value is not None}
    if physics:
        options["physics"] = True
    if name == "all":
        if options:
            raise UnconstrainError(f"--{next(iter(options))} is for a single experiment, not for all")
        report.reproduce_all(out, trials=trials, jobs=jobs, console=console)
        console.print(f"\nreport: {out / 'report.md'}, {out / 'report.html'}")
        return
    module = experiment(name)
    unknown = sorted(set(options) - set(inspect.signature(module.reproduce).parameters))
    if unknown:
        raise UnconstrainError(f"the experiment {name} has no option --{unknown[0]}")
    outcome = module.reproduce(out, trials=trials, jobs=jobs, console=console, **options)
    console.print(Markdown(f"## {outcome.title}\n\n{outcome.table}"))
    for heading, sentences in (
        ("found", outcome.findings),
        ("chosen where the paper is silent", outcome.choices),
    ):
        if sentences:
            console.print(f"{heading}:")
        for sentence in sentences:
            console.print(f"  - {sentence}", highlight=False)
    for path in (*outcome.figures, *outcome.files):
        console.print(f"written: {path}", soft_wrap=True)
