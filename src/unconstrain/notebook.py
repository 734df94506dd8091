"""What notebooks show: small tables in HTML, and progress that is updated in its place."""

import html
import sys
import time
from collections.abc import Iterable, Sequence
from typing import Any

MOST_OFTEN = 0.1
"""Seconds between updates of progress: each is a message to the browser."""


def is_notebook() -> bool:
    """Whether this runs in a notebook's kernel.

    Returns
    -------
    bool
        False in a terminal, also in IPython's.
    """
    ipython = sys.modules.get("IPython")
    shell = None if ipython is None else ipython.get_ipython()
    return getattr(shell, "kernel", None) is not None


def format_table(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Write a table in HTML.

    Parameters
    ----------
    columns : sequence of str
        The head.
    rows : iterable of sequence of str
        Cells, which are escaped.

    Returns
    -------
    str
        HTML.
    """

    def line(cells: Sequence[str], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{html.escape(cell)}</{tag}>" for cell in cells) + "</tr>"

    body = "".join(line(row, "td") for row in rows)
    return f"<table><thead>{line(columns, 'th')}</thead><tbody>{body}</tbody></table>"


def format_sentences(sentences: Iterable[str]) -> str:
    """Write sentences in HTML, a paragraph each.

    Parameters
    ----------
    sentences : iterable of str
        Texts, which are escaped.

    Returns
    -------
    str
        HTML.
    """
    return "".join(f"<p>{html.escape(each)}</p>" for each in sentences)


class NotebookBar:
    """A bar of one pass after the other, as `progress.reporting` yields it in a notebook.

    Parameters
    ----------
    unit : str
        What is counted.
    """

    def __init__(self, unit: str) -> None:
        from IPython.display import HTML, display  # there, as this runs in it

        self._html, self._unit, self._text = HTML, unit, "learning"
        self._handle: Any = display(HTML(""), display_id=True)
        self._begun: tuple[float, int] | None = None
        self._updated = 0.0

    def begin(self, text: str, unit: str | None = None) -> None:
        """Say what is done from now on, and what is counted, where that is something else."""
        self._text, self._begun, self._unit = text, None, self._unit if unit is None else unit
        self._show(f"<progress></progress> {html.escape(text)}")

    def clear(self) -> None:
        """Show nothing any more."""
        self._show("")

    def __call__(self, done: int, total: int | None) -> None:
        """Show what is done, and what there is in all."""
        now = time.monotonic()
        self._begun = self._begun or (now, done)
        if now - self._updated < MOST_OFTEN and done != total:
            return
        self._updated = now
        seconds, counted = now - self._begun[0], done - self._begun[1]
        of = f" of {total:,}" if total else ""
        said = f"{self._text}: {done:,}{of} {self._unit}"
        if seconds > 0 and counted > 0:
            said += f", {counted / seconds:,.0f} {self._unit}/s"
            if total and done < total:
                said += f", {(total - done) * seconds / counted:.0f} s left"
        bar = f'<progress value="{done}" max="{total}"></progress>' if total else "<progress></progress>"
        self._show(f"{bar} {html.escape(said)}")

    def _show(self, text: str) -> None:
        self._handle.update(self._html(text))
