"""The program: its commands, and how it ends."""

from collections.abc import Sequence

import click

import unconstrain
from unconstrain.cli import reporting
from unconstrain.cli.command import Group, Interrupted
from unconstrain.cli.constraints import constraints
from unconstrain.cli.convert import convert
from unconstrain.cli.demo import demo
from unconstrain.cli.diagnose import diagnose
from unconstrain.cli.evaluate import evaluate
from unconstrain.cli.fit import fit
from unconstrain.cli.inspect import inspect
from unconstrain.cli.rollout import rollout
from unconstrain.cli.view import view

WIDTH = 100
"""Of the help, in columns, where the terminal has as many."""


def _print_version(context: click.Context, option: click.Parameter, asked: bool) -> None:
    if asked:
        reporting.say(unconstrain.__version__)
        context.exit()


@click.group(cls=Group, context_settings={"max_content_width": WIDTH, "help_option_names": ["-h", "--help"]})
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_print_version,
    help="Print the version.",
)
def program() -> None:
    """Learn the policy behind constrained demonstrations."""


for command in (demo, inspect, fit, evaluate, diagnose, constraints, rollout, view, convert):
    program.add_command(command)


def run(arguments: Sequence[str] | None = None) -> int:
    """Run the program with the arguments given, or those of the process.

    Parameters
    ----------
    arguments : sequence of str, optional
        What follows the program's name.

    Returns
    -------
    int
        The exit code: 0, 1 if standard output could not be written, 2 after a mistake of the user's, or 3 where a
        movement had to stop.

    Raises
    ------
    KeyboardInterrupt
        The user pressed Ctrl-C.
    """
    with reporting.warnings_as_sentences(), reporting.forgiving_output() as output:
        code = _run(arguments)
        output.flush()
        if output.failure is not None:
            reporting.say_error(
                f"standard output could not be written ({output.failure}), so not all was said; files were written as "
                "they would be otherwise"
            )
            code = code or 1
    return code


def _run(arguments: Sequence[str] | None) -> int:
    try:
        # A command returns nothing; click returns the code that `Context.exit` was given.
        return program.main(arguments, prog_name="unconstrain", standalone_mode=False) or 0
    except Interrupted as stop:
        raise KeyboardInterrupt(stop.message) from None
    except click.exceptions.NoArgsIsHelpError as asked:
        reporting.say(asked.format_message())
        return asked.exit_code
    except click.UsageError as error:
        hint = None if error.ctx is None else f"see {error.ctx.command_path} --help"
        reporting.say_error(error.format_message(), hint)
        return error.exit_code
    except click.ClickException as error:
        reporting.say_error(error.format_message())
        return error.exit_code
    except click.Abort:  # what click makes of Ctrl-C before the command begins
        raise KeyboardInterrupt from None
