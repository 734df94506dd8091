"""Show how far work has come, on standard error, so that results on standard output stay clean."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

Report = Callable[[int, int | None], None]
"""Called with what is done and what there is in all, None where that is not known."""


@contextmanager
def reporting(progress: bool | Report | None, unit: str = "rows") -> Iterator[Report]:
    """Open what progress is reported to.

    Parameters
    ----------
    progress : bool, function or None
        True shows a bar, with rate and time left; a function is itself called; False and None show nothing.
    unit : str
        What is counted.

    Yields
    ------
    function
        To be called with what is done and what there is in all, or None.
    """
    if callable(progress):
        yield progress
        return
    if not progress:
        yield lambda done, total: None
        return
    from rich.console import Console  # rich takes a while to import, and is not always needed
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("learning"), BarColumn(), TextColumn("{task.fields[told]}"), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task("", total=None, told="")
        begun: int | None = None

        def report(done: int, total: int | None) -> None:
            nonlocal begun
            begun = done if begun is None else begun
            # What an earlier run did is no part of the rate of this one.
            left = None if total is None else total - begun
            bar.update(task, completed=done - begun, total=left)
            speed = bar.tasks[0].speed
            rate = f", {speed:,.0f} {unit}/s" if speed else ""
            of = f" of {total:,}" if total else ""
            bar.update(task, told=f"{done:,}{of} {unit}{rate}")

        yield report


@contextmanager
def working(text: str) -> Iterator[Callable[[str], None]]:
    """Show that something goes on, where standard error is a terminal.

    Parameters
    ----------
    text : str
        What goes on.

    Yields
    ------
    function
        To be called with another text, once something else goes on.
    """
    if not sys.stderr.isatty():
        yield lambda text: None
        return
    from rich.console import Console
    from rich.text import Text

    with Console(stderr=True).status(Text(text)) as status:
        yield lambda text: status.update(Text(text))
