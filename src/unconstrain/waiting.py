"""What is shown of work that takes longer than a second: what goes on, how much of it is done, and the time left.

Whatever may take long says so where it is done, by `stage` or `each`. That is seen where someone has asked for it: the
command line always, in Python after `unconstrain.verbose()`. It is written to standard error if that is a terminal, or
below the cell of a notebook, and goes away at the end. Stages within stages are a line each, and none is shown that
does not last.
"""

import itertools
import sys
import threading
import time
from collections.abc import Iterable, Iterator, Sized
from contextlib import contextmanager
from types import TracebackType
from typing import Any, Protocol, Self, TypeVar

from unconstrain.notebook import NotebookBar, is_notebook

T = TypeVar("T")

DELAY = 1.0
"""Seconds that a stage has to last before it is shown."""


class Stage(Protocol):
    """Is told how far a stage has come."""

    def __call__(self, done: int, total: int | None = None) -> None:
        """Say what is done, and what there is in all, where that is known."""
        ...

    def begin(self, text: str) -> None:
        """Say what goes on from now on."""
        ...


class _Silent:
    """A stage that nobody sees."""

    def __call__(self, done: int, total: int | None = None) -> None:
        pass

    def begin(self, text: str) -> None:
        pass


class _Row:
    """A stage on a terminal."""

    def __init__(self, bars: Any, text: str, total: int | None, unit: str) -> None:
        self._bars, self._unit = bars, unit
        self.task = bars.add_task(text, total=total, told="" if total is None else self._tell(0, total))

    def __call__(self, done: int, total: int | None = None) -> None:
        self._bars.update(self.task, completed=done, total=total, told=self._tell(done, total))

    def begin(self, text: str) -> None:
        self._bars.update(self.task, description=text, refresh=True)

    def _tell(self, done: int, total: int | None) -> str:
        of = f" of {total:,}" if total else ""
        return f"{done:,}{of} {self._unit}".rstrip()


class _Terminal:
    """Lines on standard error, from `DELAY` on."""

    def __init__(self) -> None:
        from rich.console import Console  # rich takes a while to import, and is not always needed
        from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

        class Late(Progress):
            def get_renderables(self) -> Iterable[Any]:
                # Within the first, what only has a name says nothing more.
                counted = [task for task in self.tasks if task.fields["told"] or task is self.tasks[0]]
                return [self.make_tasks_table([task for task in counted if (task.elapsed or 0.0) >= DELAY])]

        text, told = (
            TextColumn(form, markup=False) for form in ("{task.description}", "{task.fields[told]}")
        )
        columns = (text, BarColumn(), told, TimeRemainingColumn())
        self._bars = Late(*columns, console=Console(stderr=True), transient=True)
        self._lock, self._ended = threading.Lock(), False
        self._timer = threading.Timer(DELAY, self._start)
        self._timer.daemon = True
        if DELAY:
            self._timer.start()
        else:
            self._bars.start()

    def open(self, text: str, total: int | None, unit: str) -> Stage:
        return _Row(self._bars, text, total, unit)

    def close(self, row: Any) -> None:
        self._bars.remove_task(row.task)

    def end(self) -> None:
        self._timer.cancel()
        with self._lock:
            self._ended = True
            self._bars.stop()

    def _start(self) -> None:
        with self._lock:
            if not self._ended:
                self._bars.start()


class _CellRow:
    """A stage in a notebook, whose bar is made once it has lasted."""

    def __init__(self, cell: "_Cell", text: str, unit: str) -> None:
        self._cell, self._text, self._unit = cell, text, unit
        self._begun = time.monotonic()

    def __call__(self, done: int, total: int | None = None) -> None:
        if time.monotonic() - self._begun >= DELAY:
            self._cell.show(self, self._text, self._unit, done, total)

    def begin(self, text: str) -> None:
        self._text = text


class _Cell:
    """One bar below a cell, of the stage that was told of last."""

    def __init__(self) -> None:
        self._bar: NotebookBar | None = None
        self._shown: tuple[Any, str] | None = None

    def open(self, text: str, total: int | None, unit: str) -> Stage:
        return _CellRow(self, text, unit)

    def show(self, row: _CellRow, text: str, unit: str, done: int, total: int | None) -> None:
        self._bar = self._bar or NotebookBar(unit)
        if self._shown != (row, text):
            self._shown = (row, text)
            self._bar.begin(text, unit)
        self._bar(done, total)

    def close(self, row: Any) -> None:
        pass

    def end(self) -> None:
        if self._bar is not None:
            self._bar.clear()


class _State:
    """Whether stages are shown, and where: one place for all, of the thread that began."""

    is_on = False
    display: _Terminal | _Cell | None = None
    owner = 0


class verbose:
    """Show what takes longer than a second, with the time left: from now on, or within a `with` block.

    It is shown on standard error if that is a terminal, and below the cell of a notebook.

    Parameters
    ----------
    on : bool
        False shows nothing any more.

    Examples
    --------
    >>> import unconstrain as uc
    >>> with uc.verbose():
    ...     pass  # policy.fit(demos)
    """

    def __init__(self, on: bool = True) -> None:
        self._before = _State.is_on
        _State.is_on = bool(on)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        _State.is_on = self._before

    def __repr__(self) -> str:
        return f"verbose({_State.is_on})"


@contextmanager
def within(text: str, total: int | None = None, unit: str = "") -> Iterator[Stage]:
    """Say that something goes on that is part of a stage; see `stage`. By itself it is not shown.

    Parameters
    ----------
    text : str
        What goes on.
    total : int, optional
        How much there is to be done, where that is known.
    unit : str
        What is counted.

    Yields
    ------
    Stage
        To be called with what is done and what there is in all.
    """
    if _State.display is None:
        yield _Silent()
        return
    with stage(text, total, unit) as report:
        yield report


@contextmanager
def stage(text: str, total: int | None = None, unit: str = "") -> Iterator[Stage]:
    """Say that something goes on which may take long.

    Parameters
    ----------
    text : str
        What goes on.
    total : int, optional
        How much there is to be done, where that is known.
    unit : str
        What is counted.

    Yields
    ------
    Stage
        To be called with what is done and what there is in all.
    """
    display, is_first = _State.display, False
    if display is None and _State.is_on:
        display, is_first = _open(), True
    if display is None or (not is_first and threading.get_ident() != _State.owner):
        yield _Silent()
        return
    if is_first:
        _State.display, _State.owner = display, threading.get_ident()
    row = display.open(text, total, unit)
    try:
        yield row
    finally:
        display.close(row)
        if is_first:
            _State.display = None
            display.end()


def each(items: Iterable[T], text: str, total: int | None = None, unit: str = "") -> Iterator[T]:
    """Go through some items, and say how far one has come, within a stage.

    A loop that ends early, by an error, leaves its line to the stage around it, so this is none by itself.

    Parameters
    ----------
    items : iterable
        What is worked on, one after the other.
    text : str
        What goes on.
    total : int, optional
        How many there are; by default their length, where they have one.
    unit : str
        What they are.

    Yields
    ------
    object
        Each item.
    """
    if total is None and isinstance(items, Sized):
        total = len(items)
    with within(text, total, unit) as report:
        for number, item in zip(itertools.count(), items):
            report(number, total)
            yield item


def is_shown() -> bool:
    """Tell whether stages are shown by someone.

    Returns
    -------
    bool
        True within a stage that is.
    """
    return _State.display is not None


def _open() -> _Terminal | _Cell | None:
    if is_notebook():
        return _Cell()
    return _Terminal() if sys.stderr.isatty() else None
