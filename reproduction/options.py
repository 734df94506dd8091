"""Options that several commands of the program have, and where they print."""

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from unconstrain.cli import reporting

if TYPE_CHECKING:
    from rich.console import Console

FOLDER = Path("out") / "reproduction"
"""Where results go, a folder an experiment."""

PATH = click.Path(path_type=Path)
COUNT = click.IntRange(min=1)

Decorator = Callable[[Callable[..., None]], Callable[..., None]]

RUNNING = (
    click.option(
        "--trials", "--datasets", "trials", type=COUNT, help="How many data sets; by default as published."
    ),
    click.option("--jobs", type=COUNT, default=os.cpu_count() or 1, show_default=True, help="Processes."),
)
OUT = click.option(
    "--out",
    type=PATH,
    help=f"Folder for results, by default {FOLDER}/EXPERIMENT. Finished trials are kept there, and the same command "
    "goes on from them.",
)
ROBOT = (
    click.option("--robot", type=PATH, help="Your robot, MJCF or URDF; by default our humanoid."),
    click.option("--lock", default="", help="Joints of it to hold still, by commas."),
    click.option("--hands", default="", help="Its hand frames, LEFT,RIGHT."),
)
FEET = click.option(
    "--feet", default="", help="Its foot bodies, LEFT,RIGHT; without them its base stands still."
)
ADAPTIVE = click.option(
    "--adaptive",
    type=click.IntRange(min=0),
    metavar="N",
    help="How many of the data sets are learnt by risk adaptive as well, which takes 30 to 100 times as long; 0 leaves "
    "its column out, by default it has the first 10 (toy: 20).",
)
RECORDINGS = click.option(
    "--recordings",
    type=PATH,
    metavar="FOLDER",
    help="Folder of the recorded surfaces; without it that part is left out.",
)
PART = click.option("--part", metavar="NAME", help="Only this part; a wrong name lists them.")


def add_options(*options: Decorator) -> Decorator:
    """Make a decorator that adds options in the order given.

    Parameters
    ----------
    *options : decorator
        As `click.option` returns them.

    Returns
    -------
    decorator
        Of a function.
    """

    def add(function: Callable[..., None]) -> Callable[..., None]:
        for option in reversed(options):
            function = option(function)
        return function

    return add


def make_console() -> "Console":
    """Make a console that takes text literally: brackets in names of files are no markup.

    Returns
    -------
    rich.console.Console
        As wide as the terminal, or as pages are.
    """
    from rich.console import Console

    width = None if sys.stdout.isatty() else reporting.WIDTH
    return Console(markup=False, highlight=False, width=width)
