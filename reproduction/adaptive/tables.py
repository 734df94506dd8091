"""The parts' results as Markdown, and what is to be said about them."""

from collections.abc import Mapping, Sequence

from reproduction import markdown
from reproduction.adaptive.judgement import MEAN, average, average_cells, bound_ratio, has_noise, judge_part
from reproduction.adaptive.settings import Part, Result
from reproduction.adaptive.ways import ADAPTIVE, COLUMNS, CORRECTED, TOLD, Cell

FACTS = (
    "adaptive / told",
    "corrected / told",
    "bound / told's",
    "told + bound",
    "in the 90 % interval",
    "half width / rms error",
)
FOUND = ("σ found / true", "τ found", "free found / true", "contact right")


def write_part(part: Part, results: Sequence[Result]) -> str:
    """Write the table of a part under its heading."""
    means = average(results)
    verdicts = judge_part(part, means)
    if part.overall is not None:
        means = means | {MEAN: average_cells(means)}
    rows = {name: _row(cell) for name, cell in means.items()}
    columns = [c for c in (*COLUMNS, *FACTS, *FOUND) if any(row.get(c) for row in rows.values())]
    verdict = [verdict.reach for verdict in verdicts.values()]
    shown = [
        *(column for column in columns if column not in FOUND),
        *(["reach", "reached"] if any(verdict) else []),
        *(column for column in columns if column in FOUND),
    ]
    for name, row in rows.items():
        row |= {"reach": verdicts[name].reach, "reached": str(verdicts[name])}
    table = markdown.table(
        ["", *shown], [[name, *(row.get(c, "") for c in shown)] for name, row in rows.items()]
    )
    many = "splits" if part.fixed else "data sets"
    mean = "Measured: " if len(results) == 1 else f"Means over {len(results)} {many}: "
    told = f" Told: {part.told}." if any(TOLD in cell for cell in means.values()) else ""
    below = f"{mean}{part.measure}.{told}"
    return f"### {part.title}\n\n{table}\n\n{below}\n"


def list_findings(parts: Mapping[str, Part], results: Mapping[str, Sequence[Result]]) -> tuple[str, ...]:
    """Say of every part how many of its goals were reached, and name those that were not."""
    findings = []
    for name, trials in results.items():
        verdicts = judge_part(parts[name], average(trials))
        judged = {cell: verdict for cell, verdict in verdicts.items() if verdict.reached is not None}
        if not judged:
            continue
        missed = [cell for cell, verdict in judged.items() if not verdict.reached]
        sentence = f"{parts[name].title}: reached in {len(judged) - len(missed)} of {len(judged)} rows"
        weak = sum(bool(verdict.reached) and verdict.weak for verdict in judged.values())
        if weak:
            sentence += (
                f", in {weak} of them because little was asked (the limit is above another risk's error)"
            )
        if missed:
            sentence += f"; missed: {'; '.join(missed)}"
        below = sum(verdict.impossible for verdict in judged.values())
        if below:
            sentence += f"; in {below} the limit lies below the Cramér-Rao bound"
        findings.append(sentence + ".")
    return tuple(findings)


def _row(cell: Cell) -> dict[str, str]:
    row = {way: _number(cell[way]) for way in COLUMNS if way in cell}
    for way in (ADAPTIVE, CORRECTED):
        if way in cell and cell.get(TOLD):
            row[f"{way} / told"] = f"{cell[way] / cell[TOLD]:.2g}"
    ratio = bound_ratio(cell)
    if ratio is not None:
        row["bound / told's"] = f"{ratio:.3g}"
    if has_noise(cell):
        row["told + bound"] = _number(cell[TOLD] + cell["bound"] - cell["told bound"])
    if "inside" in cell:
        row["in the 90 % interval"] = f"{cell['inside']:.0%}"
        row["half width / rms error"] = f"{cell['width']:.2g}"
    if "noise" in cell:
        row["σ found / true"] = _number(cell["noise"])
        if "true noise" in cell:
            row["σ found / true"] += f" / {_number(cell['true noise'])}"
    if "free" in cell:
        row["τ found"] = _number(cell["speed noise"])
        row["free found / true"] = f"{cell['free']:.0%}"
        if "true free" in cell:
            row["free found / true"] += f" / {cell['true free']:.0%}"
    if "contact right" in cell:
        row["contact right"] = f"{cell['contact right']:.1%}"
    return row


def _number(value: float) -> str:
    return f"{value:.3g}"
