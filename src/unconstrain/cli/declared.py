"""Options of the program, made from the dataclasses in which the library declares them.

A field is declared once, with its type, default and description; the option has the same name, with hyphens, the same
default, and that description as its help.
"""

import csv
import functools
import inspect
import math
import re
from collections.abc import Callable, Sequence
from dataclasses import fields
from typing import Any, get_args

import click
from click.core import ParameterSource


class ColumnNames(click.ParamType):
    """Names or positions of columns, separated by commas as in a CSV file.

    ``x,y`` are two names, ``0,1`` two positions counted from 0, ``"x, in m",y`` two names of which one has a comma.
    """

    name = "columns"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> str | int | list[str | int]:
        """Parse the text into one column, or a list of several; an empty name is a mistake."""
        if not isinstance(value, str):
            return value
        try:
            names = [n.strip() for row in csv.reader([value], skipinitialspace=True) for n in row]
        except csv.Error as error:
            self.fail(f"{value!r} is no list of columns ({error})", param, ctx)
        if not names or not all(names):
            self.fail(
                f"{value!r} has an empty column name: separate names or positions by single commas",
                param,
                ctx,
            )
        columns = [int(name) if name.isdecimal() and name.isascii() else name for name in names]
        return columns if len(columns) > 1 else columns[0]


class ColumnName(ColumnNames):
    """The name or position of one column, written as `ColumnNames` are."""

    name = "column"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Parse the text; more than one column is a mistake."""
        column = super().convert(value, param, ctx)
        if isinstance(column, list):
            self.fail(f"it takes one column, got {len(column)}: {value}", param, ctx)
        return column


class Names(click.ParamType):
    """Names of other things than columns, separated by commas as in a CSV file."""

    name = "names"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> list[str]:
        """Parse the text; an empty name is a mistake."""
        if isinstance(value, list):
            return value
        names = [name.strip() for row in csv.reader([value], skipinitialspace=True) for name in row]
        if not names or not all(names):
            self.fail(f"{value!r} has an empty name: separate names by single commas", param, ctx)
        return names


class Number(click.ParamType):
    """A finite number above zero, or where `zero` is true, not below it; or one of some words.

    Parameters
    ----------
    zero : bool
        Whether zero is allowed.
    words : sequence of str
        What may stand in place of a number.
    """

    name = "number"

    def __init__(self, *, zero: bool = False, words: Sequence[str] = ()) -> None:
        self.zero = zero
        self.words = tuple(words)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float | str:
        """Parse the text."""
        if value in self.words:
            return value
        try:
            number = float(value)
        except ValueError:
            number = math.nan
        if not (math.isfinite(number) and (number > 0 or (self.zero and number == 0))):
            wanted = "a finite number of at least zero" if self.zero else "a positive number"
            choice = "".join(f' or "{word}"' for word in self.words)
            self.fail(f"it must be {wanted}{choice}, got {value!r}", param, ctx)
        return number


class Numbers(click.ParamType):
    """Finite numbers, separated by commas; or one of some words.

    Parameters
    ----------
    words : sequence of str
        What may stand in place of numbers.
    """

    name = "numbers"

    def __init__(self, *, words: Sequence[str] = ()) -> None:
        self.words = tuple(words)

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> list[float] | str:
        """Parse the text."""
        if isinstance(value, list) or value in self.words:
            return value
        try:
            numbers = [float(part) for part in value.split(",")]
        except ValueError:
            self.fail(f"it must be numbers separated by commas, got {value!r}", param, ctx)
        if not all(map(math.isfinite, numbers)):
            self.fail(f"its numbers must be finite, got {value!r}", param, ctx)
        return numbers


class Option(click.Option):
    """An option that the help lists in a section of its own.

    Parameters
    ----------
    section : str
        The heading.
    """

    def __init__(self, *args: Any, section: str = "Options", **attributes: Any) -> None:
        super().__init__(*args, **attributes)
        self.section = section


option = functools.partial(click.option, cls=Option)
"""`click.option` that takes a `section`."""


def declared_options(*declarations: type, section: str) -> list[Callable]:
    """Make a decorator, as `click.option` does, for each field of some dataclasses.

    Parameters
    ----------
    *declarations : dataclass
        Their docstrings describe their fields under Parameters, as numpydoc has it. A field may hold a column or
        columns, a number, a truth value, text, several texts, or one of the choices that its description lists in
        braces.
    section : str
        Of the help.

    Returns
    -------
    list of decorators
        In the order of the fields.
    """
    names = [field.name for declaration in declarations for field in fields(declaration)]
    made = []
    for declaration in declarations:
        described = parameters(declaration)
        for field in fields(declaration):
            kind, text = described.get(field.name, ("", ""))
            for name in names:
                text = text.replace(f"`{name}`", f"--{name.replace('_', '-')}")
            attributes = _type_of(field.type, kind)
            if field.default is not None and "is_flag" not in attributes:
                attributes["show_default"] = True
            attributes |= {"default": field.default, "help": text.replace("`", ""), "section": section}
            made.append(option(f"--{field.name.replace('_', '-')}", field.name, **attributes))
    return made


def _type_of(annotation: Any, kind: str) -> dict[str, Any]:
    """Choose the type of a field's option, by its annotation and by the type in its description."""
    held = set(get_args(annotation)) - {type(None)} or {annotation}
    if int in held and str in held:
        return {"type": ColumnNames() if len(held) > 2 else ColumnName()}
    if str in held and len(held) > 1:
        return {"type": Names(), "multiple": True, "callback": _one_list}
    if float in held:
        return {"type": Number()}
    if held == {int}:
        return {"type": click.IntRange(min=1), "metavar": "NUMBER"}
    if bool in held:
        return {"is_flag": True}
    return {"type": click.Choice(re.findall(r'"([^"]*)"', kind)) if "{" in kind else str}


def _one_list(
    context: click.Context, parameter: click.Parameter, values: Sequence[list[str]]
) -> str | list[str] | None:
    """Join what an option was given each time; one name stands by itself."""
    names = [name for each in values for name in each]
    return names if len(names) > 1 else names[0] if names else None


def gathered(
    name: str, decorators: Sequence[Callable], make: Callable[..., Any]
) -> Callable[[Callable], Callable]:
    """Make a decorator that gives a command several options, and hands them to it as one object.

    Parameters
    ----------
    name : str
        The command's argument for the object.
    decorators : sequence
        `click.option` and `click.argument` decorators.
    make : callable
        Is called with the options' values by name, and returns the object.
    """

    def decorate(command: Callable) -> Callable:
        own = [parameter.name for parameter in click.command()(_with(decorators, lambda: None)).params]

        @functools.wraps(command)
        def call(**values: Any) -> Any:
            values[name] = make(**{option: values.pop(option) for option in own})
            return command(**values)

        return _with(decorators, call)

    return decorate


def is_given(option: str) -> bool:
    """Whether an option of the current command was given, rather than left to its default."""
    source = click.get_current_context().get_parameter_source(option)
    return source not in (None, ParameterSource.DEFAULT)


def parameters(declaration: type) -> dict[str, tuple[str, str]]:
    """Read the Parameters of a numpydoc docstring.

    Returns
    -------
    dict
        By name the type and the description, each as it is written, in one line.

    Examples
    --------
    >>> class Box:
    ...     '''A box.
    ...
    ...     Parameters
    ...     ----------
    ...     size : float
    ...         How large it is,
    ...         in metres.
    ...     '''
    >>> parameters(Box)
    {'size': ('float', 'How large it is, in metres.')}
    """
    lines = inspect.cleandoc(declaration.__doc__ or "").splitlines()
    found: dict[str, tuple[str, str]] = {}
    if "Parameters" not in lines:
        return found
    name = kind = ""
    for line, following in zip(
        lines[lines.index("Parameters") + 2 :], [*lines[lines.index("Parameters") + 3 :], ""], strict=True
    ):
        if following.startswith("---"):
            break  # the heading of the next section
        if line and not line.startswith(" "):
            name, _, kind = line.partition(" : ")
            found[name] = (kind, "")
        elif line:
            found[name] = (kind, f"{found[name][1]} {line.strip()}".strip())
    return found


def _with(decorators: Sequence[Callable], command: Callable) -> Callable:
    for decorator in reversed(decorators):
        command = decorator(command)
    return command
