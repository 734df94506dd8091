"""The program: its commands, and how it ends when something is wrong."""

import sys
from typing import Annotated

import typer
from rich.console import Console

import unconstrain
from unconstrain.cli import reporting
from unconstrain.cli.constraints import constraints
from unconstrain.cli.demo import demo
from unconstrain.cli.diagnose import diagnose
from unconstrain.cli.evaluate import evaluate
from unconstrain.cli.fit import fit
from unconstrain.cli.rollout import rollout
from unconstrain.errors import UnconstrainError

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
    help="Learn the policy behind constrained demonstrations.",
)


def _version(asked: bool) -> None:
    if asked:
        print(unconstrain.__version__)
        raise typer.Exit


@app.callback()
def program(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Learn the policy behind constrained demonstrations."""


for command in (demo, fit, evaluate, diagnose, constraints, rollout):
    app.command()(command)


def main() -> None:
    """Run the program. A user's mistake is one sentence on stderr and exit code 2; Ctrl-C is exit code 130."""
    try:
        app()
    except UnconstrainError as error:
        Console(stderr=True).print(
            f"[bold red]error:[/] {_plain(str(error))}", soft_wrap=True, highlight=False
        )
        sys.exit(2)
    except SystemExit as end:
        if end.code == reporting.INTERRUPTED:  # typer turns Ctrl-C into this without a word
            print("interrupted: nothing was left half written", file=sys.stderr)
        raise
    except BrokenPipeError:
        sys.exit(1)


def _plain(text: str) -> str:
    return text.replace("[", r"\[")
