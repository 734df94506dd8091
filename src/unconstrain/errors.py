"""Errors that a user can cause, each one sentence.

Each message names the file, column or row, and says what to do. A message speaks of an argument or option as ``name=``,
which the command line turns into ``--name``. The command line prints the sentence and exits with 2; in Python all
of them are `ValueError`, as scikit-learn expects of bad input.
"""

__all__ = [
    "ArchiveError",
    "DataError",
    "NotNumbersError",
    "PolicyError",
    "RobotError",
    "UnconstrainError",
    "UntrustedArchiveError",
]


def printable(text: str) -> str:
    r"""Spell out the control characters of a text, of which terminals would make something.

    Parameters
    ----------
    text : str
        A name or a sentence.

    Returns
    -------
    str
        The text, with ``\x1b`` in place of an escape character, for example.
    """
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def show(value: object) -> str:
    """Write a value that was given into a sentence: on one line, and not all of it where it is long.

    Parameters
    ----------
    value : object
        Of any type.

    Returns
    -------
    str
        At most 60 characters.
    """
    return f"{' '.join(repr(value).split()):.60}"


class UnconstrainError(ValueError):
    """A mistake in what the user gave, told in one sentence. Base of the family."""

    def __str__(self) -> str:
        # Names of files and columns are the user's, or a stranger's: no escape sequence reaches the terminal.
        return printable(super().__str__())


class DataError(UnconstrainError):
    """A recording, or an array standing for one, that cannot be used: missing, NaN, of the wrong shape.

    Parameters
    ----------
    message : str
        The sentence.
    row, column : int, optional
        Where in an array the mistake is, counted from 0, for programs that leave it out.
    """

    def __init__(self, message: str = "", *, row: int | None = None, column: int | None = None) -> None:
        super().__init__(message)
        self.row, self.column = row, column


class NotNumbersError(DataError, TypeError):
    """Things in place of numbers; a `TypeError` too, as scikit-learn expects of these.

    Parameters
    ----------
    message : str
        The sentence.
    row, column : int, optional
        As for `DataError`.
    """


class PolicyError(UnconstrainError):
    """A policy asked for what it cannot do: an unknown option, or states of the wrong dimension."""


class ArchiveError(DataError):
    """A saved file that is missing, damaged, of another kind, not of unconstrain, or from a newer release.

    Parameters
    ----------
    message : str
        The sentence.
    row, column : int, optional
        None, since a file is refused as a whole.
    """


class UntrustedArchiveError(ArchiveError):
    """A saved file that holds classes, functions or parts of regressors that are not trusted.

    Parameters
    ----------
    message : str
        The sentence.
    names : tuple of str
        What it holds: "module:name" for classes and functions, "package.module.Class" for parts of regressors.
    """

    def __init__(self, message: str, names: tuple[str, ...]):
        super().__init__(message)
        self.names = names


class RobotError(UnconstrainError):
    """A robot file that cannot be used, or a joint or frame that is not in it."""
