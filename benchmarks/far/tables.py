"""The tables of docs/how_far.md."""

from rich.console import Console
from rich.table import Table

from benchmarks.far.designs import DESIGNS, OURS, carry_out
from benchmarks.far.measured import measure

SIZES = (10**9, 10**12)
WORKERS = (1, 10, 100, 1000)
MANY = 10_000
DESIGNED_FOR = ((100, 10**9, 100), (100, 10**9, 1000), (1000, 10**9, 1000), (10_000, 10**9, 100))
SHARES = ("computing", "storage", "adding", "fetching", "idle")


def print_tables() -> None:
    """Print what was measured, and what follows for clusters."""
    console = Console(width=140)
    for make in (_measured, _passes, _designs, _fits):
        console.print(make())


def _measured() -> Table:
    machine = measure()
    table = Table(
        "P", "row", "adding", "packing", "sum on its way", "eigendecomposition",
        title=f"measured, one core, one fold; decoding {1e6 * machine.decoding:.3f} µs a row; P = 10,000 from 1,000",
    )  # fmt: skip
    for P, model in machine.models.items():
        table.add_row(
            f"{P:,}", f"{1e6 * model.row:.3g} µs", f"{1e3 * model.adding:.3g} ms", f"{1e3 * model.packing:.3g} ms",
            f"{model.packed / 1e6:.3g} MB", _span(model.solving),
        )  # fmt: skip
    return table


def _passes() -> Table:
    table = Table(
        "rows", "P", "workers", "parts", "a pass", *SHARES, "scheduler busy", "moved", "ms a task",
        title="one pass of the inconsistency, five folds: shares of the workers' time",
    )  # fmt: skip
    cases = [(rows, P, n) for rows in SIZES for P in measure().models for n in WORKERS]
    for rows, P, n in [*cases, (10**12, 1000, MANY)]:
        done = carry_out(P, rows, n)
        parts = [done.share(each) for each in (done.computing, done.reading, done.adding, done.fetching)]
        shares = [f"{share:.1%}" for share in (*parts, 1.0 - sum(parts))]
        table.add_row(
            f"{rows:.0e}", f"{P:,}", f"{n:,}", f"{done.n_tasks // 2:,}", _span(done.seconds), *shares,
            f"{done.scheduler / done.seconds:.1%}", _size(done.moved), f"{1e3 * done.scheduler / done.n_tasks:.2f}",
        )  # fmt: skip
    return table


def _designs() -> Table:
    table = Table(
        "design", *(f"P = {P:,}, {rows:.0e} rows, {n:,} workers" for P, rows, n in DESIGNED_FOR),
        title="one pass by design: how long it takes, and which share of the workers' time they compute",
    )  # fmt: skip
    for design in DESIGNS:
        done = [carry_out(P, rows, n, design) for P, rows, n in DESIGNED_FOR]
        table.add_row(
            design.name, *(f"{_span(each.seconds)}, {each.share(each.computing):.0%}" for each in done)
        )
    return table


def _fits() -> Table:
    machine = measure()
    table = Table(
        "rows", "P", "workers", "one pass", "its solution", f"adaptive, {machine.passes} passes", "of it solving",
        title=f"whole fits; a pass of the adaptive risk takes {machine.adaptive:.1f} times as long a row",
    )  # fmt: skip
    for rows, n in ((10**9, 100), (10**9, 1000), (10**12, 1000)):
        for P, model in machine.models.items():
            once, often = carry_out(P, rows, n), carry_out(P, rows, n, OURS, machine.adaptive)
            # λ is chosen in every fifth pass, from all samples and without each fold.
            solution = (OURS.folds + 1) * model.solving
            solving = machine.passes / 5 * solution
            table.add_row(
                f"{rows:.0e}", f"{P:,}", f"{n:,}", _span(once.seconds), _span(solution),
                _span(machine.passes * often.seconds + solving), _span(solving),
            )  # fmt: skip
    return table


def _span(seconds: float) -> str:
    for unit, size in (("years", 3.156e7), ("days", 86400.0), ("h", 3600.0), ("min", 60.0), ("s", 1.0)):
        if seconds >= 2 * size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds:.2g} s" if seconds >= 0.1 else f"{1e3 * seconds:.2g} ms"


def _size(n: float) -> str:
    for unit, size in (("TB", 1e12), ("GB", 1e9), ("MB", 1e6)):
        if n >= size:
            return f"{n / size:.3g} {unit}"
    return f"{n / 1e3:.3g} kB"
