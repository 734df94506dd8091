"""What every command does with a mistake: one sentence in the words of the command line."""

import functools
import os
import re
from collections.abc import Mapping
from typing import Any

import click

from unconstrain.errors import UnconstrainError

MISTAKE = 2
"""The exit code after a mistake of the user's."""


class Mistake(click.ClickException):
    """A mistake of the user's, told in one sentence."""

    exit_code = MISTAKE


class Interrupted(click.ClickException):
    """The user pressed Ctrl-C; click itself would end the line on standard error first."""


class Command(click.Command):
    """A command whose errors name options where the library names arguments, and whose help has sections."""

    def format_options(self, context: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options into the help, by section."""
        sections: dict[str, list[tuple[str, str]]] = {}
        for option in self.get_params(context):
            record = option.get_help_record(context)
            if record is not None and isinstance(option, click.Option):
                sections.setdefault(getattr(option, "section", "Options"), []).append(record)
        for heading, records in sections.items():
            with formatter.section(heading):
                formatter.write_dl(records)

    def invoke(self, context: click.Context) -> Any:
        """Call the command; what it raises becomes a `Mistake`, unless it is a fault of the program's own."""
        try:
            return super().invoke(context)
        except KeyboardInterrupt as stop:
            raise Interrupted(str(stop)) from None
        except UnconstrainError as error:
            sentence = str(error)
        except MemoryError as error:
            reason = f" ({error})" if str(error) else ""
            sentence = (
                f"there is not enough memory for this{reason}: give less data, or ask for a smaller model"
            )
        except EOFError:
            sentence = "a file ends too early, so it is damaged or still being written"
        except RecursionError:
            sentence = "something in the files is nested too deeply to be read"
        except OverflowError as error:
            sentence = f"a number is too large to compute with ({error})"
        except OSError as error:
            if error.errno is None:
                raise
            place = f" {error.filename}" if error.filename is not None else ""
            sentence = f"cannot read or write{place}: {os.strerror(error.errno).lower()}"
        raise Mistake(in_words_of_options(sentence, _options(context)))


command = functools.partial(click.command, cls=Command)
"""`click.command` that makes a `Command`."""


class Group(click.Group):
    """A group that lists its commands in the order in which they were added."""

    def list_commands(self, context: click.Context) -> list[str]:
        """Return the names of the commands."""
        return list(self.commands)


def in_words_of_options(sentence: str, options: Mapping[str, str]) -> str:
    """Write a sentence of the library's in the words of the command line.

    Parameters
    ----------
    sentence : str
        In which arguments are written ``name=``, or ``snake_case``, or begin a sentence that says what they must be.
    options : mapping
        The options that stand for arguments, by the argument's name.

    Returns
    -------
    str
        The sentence with options in their place.

    Examples
    --------
    >>> options = {"action": "--action", "time_unit": "--time-unit", "alpha": "--alpha", "resumable": "--resumable"}
    >>> in_words_of_options("give action= or time_unit", options)
    'give --action or --time-unit'
    >>> in_words_of_options('choose alpha="cv" and resumable=True', options)
    'choose --alpha "cv" and --resumable'
    """
    for name, option in options.items():
        start = r"(?<![\w'\"/.=-])"  # neither part of a word, nor in quotes, nor of a path
        sentence = re.sub(rf"{start}{name}=(?:True\b)?(?=$|[\s,;:)]|\.(?:\s|$))", option, sentence)
        sentence = re.sub(rf"{start}{name}=", f"{option} ", sentence)
        if "_" in name:
            sentence = re.sub(rf"{start}{name}(?![\w'\"/.])", option, sentence)
        sentence = re.sub(rf"^{name}(?= must )", option, sentence)
    return sentence


def in_words_of_program(sentence: str) -> str:
    """Write a sentence of the library's in the words of the options that the program has."""
    return in_words_of_options(sentence, _options(click.get_current_context()))


def _options(context: click.Context) -> dict[str, str]:
    """Name the options of all commands by the arguments they are given to; those of this one come first."""
    program = context.find_root().command
    commands = [*program.commands.values()] if isinstance(program, click.Group) else []
    found: dict[str, str] = {}
    for each in (*commands, context.command):
        options = (option for option in each.params if isinstance(option, click.Option))
        found |= {option.name: option.opts[-1] for option in options if option.name is not None}
    return found
