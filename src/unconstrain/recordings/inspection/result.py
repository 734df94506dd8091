"""What an inspection found."""

from dataclasses import dataclass
from typing import Any

from unconstrain.recordings.inspection.kinds import ColumnReport


@dataclass(frozen=True)
class Inspection:
    """What is in a recording, and the command that learns from it.

    Parameters
    ----------
    source : str
        What was looked at.
    rows : int
        How many samples there are.
    episodes : int
        As an episode column or the files tell them apart.
    rate_hz : float or None
        Samples a second; None where no time is known.
    duration_s : float or None
        Of all episodes together.
    columns : tuple of ColumnReport
        In their order.
    notes : tuple of str
        What is odd, what was guessed, and why there is no command, if there is none.
    next : str or None
        The command that learns from it; None where no movement was found.
    """

    source: str
    rows: int
    episodes: int
    rate_hz: float | None
    duration_s: float | None
    columns: tuple[ColumnReport, ...]
    notes: tuple[str, ...]
    next: str | None

    def to_dict(self) -> dict[str, Any]:
        """Return what was found as plain values, as ``unconstrain inspect --json`` prints it.

        Returns
        -------
        dict
            With `rows`, `episodes`, `rate_hz`, `duration_s`, `columns` (each `name`, `kind`, `unit`), `notes`, `next`.
        """
        return {
            "rows": self.rows,
            "episodes": self.episodes,
            "rate_hz": self.rate_hz,
            "duration_s": self.duration_s,
            "columns": [
                {"name": column.name, "kind": column.kind, "unit": column.unit} for column in self.columns
            ],
            "notes": list(self.notes),
            "next": self.next,
        }

    def _headline(self) -> str:
        """Say in one line how much there is."""
        told = [f"{self.rows} rows", f"{self.episodes} episode{'' if self.episodes == 1 else 's'}"]
        if self.rate_hz is not None:
            told.append(f"{self.rate_hz:.4g} Hz")
        if self.duration_s is not None:
            told.append(f"{self.duration_s:.4g} s")
        return f"{self.source}: {', '.join(told)}"

    def _table(self) -> list[tuple[str, str, str, str, str]]:
        """Return a row for each column: position, name, kind, unit and what else there is to say."""
        return [
            (str(i), column.name, column.kind, column.unit or "", _details(column))
            for i, column in enumerate(self.columns)
        ]

    def __str__(self) -> str:
        """Return all of it as text."""
        rows = [("", "column", "kind", "unit", "values"), *self._table()]
        widths = [max(len(row[i]) for row in rows) for i in range(4)]
        lines = [
            "  ".join(
                [*(cell.ljust(width) for cell, width in zip(row, widths, strict=False)), row[4]]
            ).rstrip()
            for row in rows
        ]
        said = [self._headline(), *lines, *(f"note: {note}" for note in self.notes)]
        return "\n".join(said if self.next is None else [*said, "next:", f"  {self.next}"])


def _details(column: ColumnReport) -> str:
    told = []
    if column.low is not None and column.high is not None:
        same = column.low == column.high
        digits = 12 if column.kind in ("time", "index", "episode") else 5
        low, high = f"{column.low:.{digits}g}", f"{column.high:.{digits}g}"
        told.append(low if same else f"{low} to {high}")
    if column.missing:
        told.append(f"{column.missing} missing")
    if column.detail:
        told.append(column.detail)
    return ", ".join(told)
