"""Show how far work has come, on standard error, so that results on standard output stay clean."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from unconstrain.notebook import NotebookBar, is_notebook
from unconstrain.waiting import is_shown, stage, verbose

Report = Callable[[int, int | None], None]
"""Called with what is done and what there is in all, None where that is not known.

Where it has a method `begin`, that is called before each pass over the data with what the pass is for.
"""


def begin(report: Report, text: str) -> None:
    """Say what is reported from now on, to reports that have a place for it.

    Parameters
    ----------
    report : function
        As `reporting` yields it.
    text : str
        What begins.
    """
    told = getattr(report, "begin", None)
    if callable(told):
        told(text)


@contextmanager
def reporting(progress: bool | Report | None, unit: str = "rows") -> Iterator[Report]:
    """Open what progress is reported to.

    Parameters
    ----------
    progress : bool, function or None
        True shows a bar, with rate and time left, in a notebook below the cell; a function is itself called; False and
        None show nothing but to whoever has asked for all that takes long (`waiting.verbose`).
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
    if not progress or is_shown():
        with stage("learning", unit=unit) as shown:  # whoever asked for all that takes long sees this too
            yield shown
        return
    if is_notebook():  # where rich shows nothing without a package that few have
        yield NotebookBar(unit)
        return
    from rich.console import Console  # rich takes a while to import, and is not always needed
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.fields[told]}"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True)) as bar:
        yield _Bar(bar, unit)


class _Bar:
    """A bar, of one pass after the other."""

    def __init__(self, bar: Any, unit: str) -> None:
        self._bar, self._unit = bar, unit
        self._task = bar.add_task("learning", total=None, told="")
        self._begun: int | None = None

    def begin(self, text: str) -> None:
        self._begun = None
        self._bar.reset(self._task, total=None, description=text, told="")

    def __call__(self, done: int, total: int | None) -> None:
        self._begun = done if self._begun is None else self._begun
        # What an earlier run did is no part of the rate of this one.
        left = None if total is None else total - self._begun
        self._bar.update(self._task, completed=done - self._begun, total=left)
        speed = self._bar.tasks[0].speed
        rate = f", {speed:,.0f} {self._unit}/s" if speed else ""
        of = f" of {total:,}" if total else ""
        self._bar.update(self._task, told=f"{done:,}{of} {self._unit}{rate}")


@contextmanager
def working(text: str) -> Iterator[Callable[[str], None]]:
    """Show what goes on, where that takes longer than a second and standard error is a terminal.

    Parameters
    ----------
    text : str
        What goes on.

    Yields
    ------
    function
        To be called with another text, once something else goes on.
    """
    with verbose(), stage(text) as shown:
        yield shown.begin
