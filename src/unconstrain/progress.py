"""How far a stream has come: rows, rate and time left, on standard error."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, Task, TextColumn, TimeRemainingColumn
from rich.text import Text

Report = Callable[[int, int | None], None]
"""Called with the rows done and the rows there are, None where that is not known."""


@contextmanager
def reporting(progress: bool | Report | None) -> Iterator[Report]:
    """What to report to: a bar for True, nothing for None or False, or the function given."""
    if callable(progress):
        yield progress
        return
    if not progress:
        yield lambda done, total: None
        return
    columns = (TextColumn("{task.description}"), BarColumn(), _Rows(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task("learning", total=None)
        begun: int | None = None

        def report(done: int, total: int | None) -> None:
            nonlocal begun
            begun = done if begun is None else begun
            # What an earlier run did is no part of the rate of this one.
            left = None if total is None else total - begun
            bar.update(task, completed=done - begun, total=left, done=done, of=total)

        yield report


class _Rows(ProgressColumn):
    def render(self, task: Task) -> Text:
        done, total = task.fields.get("done", 0), task.fields.get("of")
        rate = f", {task.speed:,.0f} rows/s" if task.speed else ""
        return Text(f"{done:,}" + (f" of {total:,}" if total else "") + f" rows{rate}")
