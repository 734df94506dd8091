"""The program: a command an experiment, each with its own options."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import click

from reproduction.experiments import EXPERIMENTS, find_experiment
from reproduction.options import (
    ADAPTIVE,
    COUNT,
    FEET,
    FOLDER,
    OUT,
    PART,
    PATH,
    RECORDINGS,
    ROBOT,
    RUNNING,
    Decorator,
    add_options,
    make_console,
)
from reproduction.real.parts import PARTS
from reproduction.viewing import view
from unconstrain.cli import reporting
from unconstrain.cli.command import Command, Group, Interrupted


@click.group(cls=Group, context_settings={"max_content_width": 100, "help_option_names": ["-h", "--help"]})
def program() -> None:
    """Run the paper's experiments, and those that go beyond it."""


def _experiment(name: str, *options: Decorator) -> None:
    """Add the command of an experiment, whose `reproduce` takes the options."""

    def run_experiment(out: Path | None, **given: Any) -> None:
        console = make_console()
        outcome = find_experiment(name)(out or FOLDER / name, console=console, **given)
        from rich.markdown import Markdown

        console.print(Markdown(f"## {outcome.title}\n\n{outcome.table}"))
        for heading, sentences in (
            ("found", outcome.findings),
            ("chosen where the paper is silent", outcome.choices),
        ):
            if sentences:
                console.print(f"{heading}:")
            for sentence in sentences:
                console.print(f"  - {sentence}")
        for path in (*outcome.figures, *outcome.files):
            console.print(f"written: {path}", soft_wrap=True)

    decorated: Callable[..., None] = add_options(*options, OUT)(run_experiment)
    help_ = EXPERIMENTS[name]
    program.add_command(click.command(name, cls=Command, help=help_, short_help=help_)(decorated))


_experiment("toy", *RUNNING, ADAPTIVE)
_experiment(
    "finger",
    click.option(
        "--movements",
        type=click.IntRange(min=2),
        default=12,
        show_default=True,
        help="Constrained movements to learn from.",
    ),
)
_experiment(
    "arm",
    *RUNNING,
    ADAPTIVE,
    click.option(
        "--model",
        type=click.Choice(["published", "auto"]),
        default="published",
        show_default=True,
        help="auto: the model is chosen by inconsistency.",
    ),
    click.option(
        "--constraint",
        help="Task rows 1-2-3, a plane's normal 0,0,1, or a matrix; by default the published four.",
    ),
    click.option("--physics", is_flag=True, help="With simulated dynamics and contact."),
)
_experiment(
    "grasp",
    *RUNNING,
    ADAPTIVE,
    click.option(
        "--model",
        type=click.Choice(["local", "potential", "auto"]),
        default="local",
        show_default=True,
        help="auto: the model is chosen by inconsistency.",
    ),
    *ROBOT,
    FEET,
    click.option("--video", type=PATH, help="Also render a video, .mp4."),
)
_experiment("posture", *RUNNING, ADAPTIVE, *ROBOT)
_experiment("constraints", *RUNNING, RECORDINGS)
_experiment("identifiability", *RUNNING, RECORDINGS, PART)
_experiment(
    "adaptive",
    *RUNNING,
    click.option(
        "--data",
        type=PATH,
        metavar="DATA_FOLDER",
        help="Folder of recordings: handwriting/*.mat, reaching/reaching_cluttered.mat, and the recorded surfaces; "
        "without it those parts are left out.",
    ),
    PART,
)
_experiment(
    "regressors",
    *RUNNING,
    click.option("--plant", metavar="NAME", help="Only this plant: cycle, arm or grasp."),
    click.option("--regressor", metavar="NAME", help="Only this regressor; a wrong name lists them."),
)


@click.command("all", cls=Command)
@add_options(*RUNNING, RECORDINGS)
@click.option("--only", multiple=True, type=click.Choice(list(EXPERIMENTS)), help="Not all; may be repeated.")
@click.option("--out", type=PATH, default=FOLDER, show_default=True, help="Folder, a folder an experiment.")
def run_all(trials: int | None, jobs: int, recordings: Path | None, only: tuple[str, ...], out: Path) -> None:
    """All of them, and a page about them."""
    from reproduction.report import reproduce_all

    console = make_console()
    page = reproduce_all(out, trials=trials, jobs=jobs, console=console, recordings=recordings, only=only)
    console.print(f"\nreport: {page}", soft_wrap=True)


@click.command("stability", cls=Command)
@click.argument("data", type=PATH, metavar="DATA_FOLDER")
@click.option(
    "--repetitions",
    type=COUNT,
    default=3,
    show_default=True,
    help="How often demonstrations are drawn to learn from.",
)
@click.option("--shape", multiple=True, metavar="NAME", help="Not all shapes; may be repeated.")
@click.option(
    "--figure", type=PATH, help="Draw rollouts and levels of the Lyapunov function (PNG, SVG, PDF)."
)
def stability(data: Path, repetitions: int, shape: tuple[str, ...], figure: Path | None) -> None:
    """Follow handwriting from everywhere, plain and stabilised: does every start lead to the goal.

    DATA_FOLDER holds handwriting/*.mat.
    """
    from reproduction.stability import list_shapes, measure, merge, plot_shapes, tabulate
    from unconstrain import plot
    from unconstrain.plot.saving import check_suffix

    console = make_console()
    check_suffix(figure)
    shapes = list(shape) or list_shapes(data)
    with console.status("learning") as status:
        rows = []
        for name in shapes:
            status.update(f"learning {name}")
            rows.append(merge(name, [measure(data, name, repetition) for repetition in range(repetitions)]))
    console.print(tabulate(rows), soft_wrap=True)
    if figure is not None:
        with console.status("drawing"):
            plot.save(plot_shapes(data, shapes), figure)
        console.print(f"written: {figure}", soft_wrap=True)


@click.command("real", cls=Command)
@click.argument("data", type=PATH, metavar="DATA_FOLDER")
@click.option("--part", multiple=True, type=click.Choice(list(PARTS)), help="Not all; may be repeated.")
@click.option(
    "--repetitions",
    type=COUNT,
    default=10,
    show_default=True,
    help="How often what is drawn at random is drawn.",
)
@click.option(
    "--out",
    type=PATH,
    default=FOLDER / "real",
    show_default=True,
    help="Folder for results. Finished repetitions are kept there, and the same command goes on from them.",
)
def real(data: Path, part: tuple[str, ...], repetitions: int, out: Path) -> None:
    """Learn from recordings of people: handwriting, reaching among boxes, wiping, lids.

    DATA_FOLDER holds handwriting/*.mat, reaching/*.mat and wiping/*.mat; what is missing is left out.
    """
    from rich.markdown import Markdown

    from reproduction.real.page import run_parts

    console = make_console()
    outcomes = run_parts(data, part or list(PARTS), repetitions, out, console.print)
    for outcome in outcomes:
        console.print(Markdown(f"## {outcome.title}\n\n{outcome.table}"))
        for sentence in outcome.findings:
            console.print(f"  - {sentence}")
        for path in outcome.figures:
            console.print(f"written: {path}", soft_wrap=True)
    console.print(f"written: {out / 'real.md'}", soft_wrap=True)


@click.command("cycles", cls=Command)
@click.argument("data", type=PATH, metavar="DATA_FOLDER")
def cycles(data: Path) -> None:
    """Follow movements that go round and round for ten periods, plain and kept on a cycle.

    DATA_FOLDER holds planer_circle.csv, curve_circle.csv and wiping/*.mat.
    """
    from reproduction.cycles import measure_all, tabulate

    console = make_console()
    with console.status("learning"):
        rows, refused = measure_all(data)
    console.print(tabulate(rows), soft_wrap=True)
    for sentence in refused:
        console.print(sentence, soft_wrap=True)


program.add_command(run_all)
program.add_command(real)
program.add_command(cycles)
program.add_command(stability)
program.add_command(view)


def run(arguments: Sequence[str] | None = None) -> int:
    """Run the program with the arguments given, or those of the process.

    Parameters
    ----------
    arguments : sequence of str, optional
        What follows the program's name.

    Returns
    -------
    int
        The exit code: 0, or 2 after a user's mistake, of which one sentence is printed to standard error.

    Raises
    ------
    KeyboardInterrupt
        The user pressed Ctrl-C.
    """
    try:
        return program.main(arguments, prog_name="python -m reproduction", standalone_mode=False) or 0
    except (Interrupted, click.Abort):
        raise KeyboardInterrupt from None
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message())
        return 0
    except click.UsageError as error:
        hint = None if error.ctx is None else f"see {error.ctx.command_path} --help"
        reporting.say_error(error.format_message(), hint)
        return error.exit_code
    except click.ClickException as error:
        reporting.say_error(error.format_message())
        return error.exit_code
