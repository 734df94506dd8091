"""Sheets of Excel workbooks, read as the text table that they are."""

import datetime
import io
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property
from typing import Any, ClassVar

from unconstrain.errors import DataError
from unconstrain.memory import check_memory
from unconstrain.recordings.files import File
from unconstrain.recordings.formats.base import damage_named, find_part, note_part
from unconstrain.recordings.formats.text import Text

BOOK = "xl/workbook.xml"
LONGEST_ABOUT = 60
"""Rows of other sheets in which the rate may stand."""


class Xlsx(Text):
    """The sheet of a workbook that holds the largest table; titles, units and the rest are found as in text.

    Parameters
    ----------
    file : File
    """

    suffixes: ClassVar[tuple[str, ...]] = (".xlsx", ".xlsm")

    @classmethod
    def matches(cls, file: File) -> bool:
        """Whether the content is a workbook."""
        if file.magic[:4] != b"PK\x03\x04":
            return False
        try:
            with file.open() as opened, zipfile.ZipFile(opened) as archive:
                return BOOK in archive.namelist()
        except Exception:  # a damaged archive; which one its suffix tells
            return False

    def parts(self) -> tuple[str, ...]:
        """Return the sheets."""
        return self._sheets

    def place(self, index: int) -> str:
        """Say in which row of the sheet a sample is."""
        return super().place(index).replace("line", "row")

    @property
    def _has_tables(self) -> bool:
        return True

    @property
    def _beside(self) -> list[str]:
        return self._sheet[2]

    def _read(self) -> tuple[bytes, tuple[str, ...]]:
        return self._sheet[:2]

    def _begin(self) -> tuple[bytes, bool]:
        return self._sheet[0], True

    @property
    def _may_be_plain(self) -> bool:
        return False

    @cached_property
    def _sheets(self) -> tuple[str, ...]:
        with self._book() as book:
            return tuple(sheet.title for sheet in book.worksheets)

    @cached_property
    def _sheet(self) -> tuple[bytes, tuple[str, ...], list[str]]:
        """The text of the sheet that is read, what was guessed, and the first lines of the others."""
        shown = self.file.shown
        chosen = find_part(self.part, self._sheets, shown)
        about: dict[str, list[str]] = {}
        best: tuple[int, str, list[list[str]]] = (1, "", [])
        with self._book() as book:
            for sheet in book.worksheets:
                about[sheet.title] = [
                    "\t".join(map(_text, row))
                    for row in sheet.iter_rows(max_row=LONGEST_ABOUT, values_only=True)
                ]
                if chosen not in (None, sheet.title):
                    continue
                rows = [[_text(cell) for cell in row] for row in sheet.iter_rows(values_only=True)]
                size = sum(any(row) for row in rows)
                # Of tables that are as long the first one is read.
                if size > best[0]:
                    best = size, sheet.title, rows
        _, title, rows = best
        if not rows:
            raise DataError(f"{shown} is empty: no sheet in it has a header and samples")
        width = max(max((i for i, cell in enumerate(row, start=1) if cell), default=0) for row in rows)
        filled = (row[:width] + [""] * (width - len(row)) if any(row) else [] for row in rows)
        text = "\n".join("\t".join(row) for row in filled) + "\n"
        several = len(self._sheets) > 1 and chosen is None
        beside = [line for other, lines in about.items() if other != title for line in lines]
        return text.encode(), (note_part(title, self._sheets),) if several else (), beside

    @contextmanager
    def _book(self) -> Iterator[Any]:
        """Open the workbook."""
        try:
            import openpyxl
        except ImportError:
            raise DataError(
                f"reading {self.file.shown} needs the package openpyxl, which is not installed: "
                "pip install 'unconstrain[xlsx]'"
            ) from None
        shown = self.file.shown
        with damage_named(shown, "an Excel workbook"):
            content = self.file.read()
            with zipfile.ZipFile(io.BytesIO(content)) as archive:
                unpacked = sum(member.file_size for member in archive.infolist())
            check_memory(4.0 * unpacked, f"reading {shown}", "save its sheet as CSV")
            yield openpyxl.load_workbook(io.BytesIO(content), read_only=True, data_only=True)


def _text(cell: Any) -> str:
    """Write a cell as a text table would hold it."""
    if cell is None:
        return ""
    if isinstance(cell, datetime.datetime):
        return cell.isoformat(" ")
    if isinstance(cell, datetime.timedelta):
        return repr(cell.total_seconds())
    if isinstance(cell, str):
        return " ".join(cell.replace('"', "'").split())
    return str(cell)
