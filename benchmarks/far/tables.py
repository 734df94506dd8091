"""The tables of docs/how_far.md."""

import logging

from rich.console import Console
from rich.table import Table

from benchmarks.far.designs import DESIGNS, OURS, carry_out
from benchmarks.far.measured import measure
from benchmarks.far.sampled import measure_sampled

SIZES = (10**9, 10**12)
WORKERS = (1, 10, 100, 1000)
DESIGNED_FOR = ((100, 10**9, 100), (100, 10**9, 1000), (1000, 10**9, 1000), (10_000, 10**9, 100))
SAMPLE = 10**6
MANY_ROWS, SHARES_SAMPLED = 100_000, (0.01, 0.1)
SHARES = ("computing", "storage", "adding", "fetching", "idle")


def print_tables() -> None:
    """Print what was measured, and what follows for clusters."""
    logging.getLogger("distributed").setLevel(logging.ERROR)
    console = Console(width=160)
    for make in (_measured, _passes, _designs, _fits, _sampled):
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
        "rows", "P", "workers", "parts", "a pass", *SHARES, "scheduler busy", "moved", "held", "ms a task",
        title="one pass of the inconsistency, five folds: shares of the workers' time",
    )  # fmt: skip
    cases = [(rows, P, n) for rows in SIZES for P in measure().models for n in WORKERS]
    for rows, P, n in cases:
        done = carry_out(P, rows, n)
        held = done.most_held * OURS.folds * measure().models[P].in_memory
        parts = [done.share(each) for each in (done.computing, done.reading, done.adding, done.fetching)]
        shares = [f"{share:.1%}" for share in (*parts, 1.0 - sum(parts))]
        table.add_row(
            f"{rows:.0e}", f"{P:,}", f"{n:,}", f"{done.n_tasks // 2:,}", _span(done.seconds), *shares,
            f"{done.scheduler / done.seconds:.1%}", _size(done.moved), _size(held),
            f"{1e3 * done.scheduler / done.n_tasks:.2f}",
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
        f"adaptive on {SAMPLE:.0e} rows by one core, then one pass",
        title=f"whole fits; a pass of the adaptive risk takes {machine.adaptive:.1f} times as long a row",
    )  # fmt: skip
    for rows, n in ((10**9, 100), (10**9, 1000), (10**12, 1000)):
        for P, model in machine.models.items():
            once, often = carry_out(P, rows, n), carry_out(P, rows, n, OURS, machine.adaptive)
            # λ is chosen in every fifth pass, from all samples and without each fold.
            solution = (OURS.folds + 1) * model.solving
            solving = machine.passes / 5 * solution
            sample = machine.passes * SAMPLE * model.row * machine.adaptive + solving
            table.add_row(
                f"{rows:.0e}", f"{P:,}", f"{n:,}", _span(once.seconds), _span(solution),
                _span(machine.passes * often.seconds + solving), _span(solving),
                _span(sample + often.seconds + solution),
            )  # fmt: skip
    return table


def _sampled() -> Table:
    table = Table(
        "rows that contact is inferred from", "then", "error", "beside all of them",
        title=f"contact inferred from a sample: {MANY_ROWS:,} rows, 14 local models in 7 dimensions, half free",
    )  # fmt: skip
    errors = measure_sampled(MANY_ROWS, SHARES_SAMPLED)
    for (rows, then), error in errors.items():
        table.add_row(f"{rows:,}", then, f"{error:.4f}", f"{error / errors[MANY_ROWS, '']:.3f}")
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
