"""How the program talks: text as it is, on streams that may be closed, and commands that can be pasted."""

import io
import math
import os
import shlex
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import TextIO

WIDTH = 120
"""Of tables that do not go to a terminal, at most, in letters."""


@contextmanager
def forgiving_output() -> Iterator["ForgivingOutput"]:
    """Let standard output fail, or be closed, without stopping the work or losing its result: see `ForgivingOutput`."""
    given, errors = sys.stdout, sys.stderr
    output = ForgivingOutput(given if isinstance(given, io.TextIOWrapper) else _nowhere())
    sys.stdout, sys.stderr = output, errors or _nowhere()
    try:
        yield output
    finally:
        sys.stdout, sys.stderr = given, errors
        output.flush()
        output.detach()


class ForgivingOutput(io.TextIOWrapper):
    r"""A text stream over another that notes the first failure to write, and drops what comes after it.

    A pipe whose reader has gone and a full disk are such failures. Letters that the encoding lacks are written as
    Python writes them, ``\u03bb``.

    Parameters
    ----------
    stream : text stream
        Where to write.

    Attributes
    ----------
    failure : str or None
        The reason of the first failure.
    """

    def __init__(self, stream: io.TextIOWrapper) -> None:
        stream.flush()
        super().__init__(
            stream.buffer, stream.encoding, "backslashreplace", line_buffering=stream.line_buffering
        )
        self.stream = stream  # which would close the buffer if it were gone
        self.failure: str | None = None

    def write(self, text: str) -> int:
        """Write text, unless writing has failed before."""
        if self.failure is None:
            try:
                return super().write(text)
            except OSError as error:
                self._fail(error)
        return len(text)

    def flush(self) -> None:
        """Flush, unless writing has failed before."""
        if self.failure is None:
            try:
                super().flush()
            except OSError as error:
                self._fail(error)

    def _fail(self, error: OSError) -> None:
        self.failure = os.strerror(error.errno).lower() if error.errno else str(error)
        # Buffers are flushed once more when Python ends: what is left in them goes nowhere.
        with suppress(OSError), open(os.devnull, "wb") as nowhere:
            os.dup2(nowhere.fileno(), self.fileno())
            super().flush()


@contextmanager
def warnings_as_sentences() -> Iterator[None]:
    """Print warnings of Python's to standard error as one sentence each, without the line of code they come from."""

    def show(
        message: Warning | str,
        category: type[Warning],
        filename: str,
        lineno: int,
        file: TextIO | None = None,
        line: str | None = None,
    ) -> None:
        print(f"warning: {visible(str(message))}", file=sys.stderr)

    with warnings.catch_warnings():
        warnings.showwarning = show
        yield


def _nowhere() -> io.TextIOWrapper:
    """Open what takes the place of a stream that is closed."""
    return open(os.devnull, "w", encoding="utf-8")


def say(text: str = "") -> None:
    """Print text to standard output as it is, control characters made visible."""
    print(visible(text), flush=True)  # so that a reader of a pipe hears of it while the work goes on


def say_table(columns: Sequence[str], rows: Sequence[Sequence[str]], title: str | None = None) -> None:
    """Print a table to standard output, its cells as they are, control characters made visible."""
    from rich.console import Console
    from rich.table import Table

    table = Table(*columns, title=title)
    table.columns[0].no_wrap = True  # names stand in one line
    for row in rows:
        table.add_row(*map(visible, row))
    width = (
        None if sys.stdout.isatty() else WIDTH
    )  # a file or a pipe has none, and cutting words short helps nobody
    Console(markup=False, highlight=False, width=width).print(table)


def say_error(text: str, hint: str | None = None) -> None:
    """Print a mistake to standard error, and where to read more."""
    style, plain = ("\x1b[1;31m", "\x1b[0m") if _is_colored(sys.stderr) else ("", "")
    with suppress(OSError):
        print(f"{style}error:{plain} {visible(text, line=True)}", file=sys.stderr)
        if hint is not None:
            print(hint, file=sys.stderr)


def visible(text: str, *, line: bool = False) -> str:
    r"""Write out what cannot be printed, so that no name of a file or column steers the terminal.

    Parameters
    ----------
    text : str
    line : bool
        Whether line breaks are written out as well.

    Returns
    -------
    str

    Examples
    --------
    >>> visible("a\x1b[2Jb")
    'a\\x1b[2Jb'
    """
    if text.isprintable():
        return text
    return "".join(
        c
        if c.isprintable() or (c == "\n" and not line)
        else c.encode("unicode_escape", "surrogatepass").decode()
        for c in text
    )


def shell_word(path: str | os.PathLike[str]) -> str:
    """Write a path so that a shell takes it for one word, and a program for no option.

    >>> shell_word("-a b.csv")
    "'./-a b.csv'"
    """
    name = os.fspath(path)
    return shlex.quote(f"./{name}" if name.startswith("-") else name)


def shown_number(value: float, scale: float) -> str:
    """Write a number with as many digits as matter where numbers differ by `scale`, and at least three.

    >>> shown_number(5512345.678, 20.0), shown_number(0.123456, 0.5), shown_number(0.0, 0.0)
    ('5512345.68', '0.1235', '0')
    """
    least = min((size for size in (abs(value), scale) if size > 0), default=1.0)
    return f"{round(float(value), 3 - math.floor(math.log10(least))) + 0.0:.15g}"


def _is_colored(stream: TextIO) -> bool:
    return stream.isatty() and "NO_COLOR" not in os.environ and os.environ.get("TERM") != "dumb"
