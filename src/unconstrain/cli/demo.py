"""`unconstrain demo`: the toy experiment once, from data to picture."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
import pyarrow as pa
import pyarrow.csv
import typer
from rich.table import Table

from unconstrain import atomic, metrics, plot
from unconstrain import demo as experiment
from unconstrain.cli import reporting
from unconstrain.cli.reporting import quoted
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import UnconstrainError

ROWS = {
    "inconsistency": "the policy behind them (inconsistency)",
    "direct": "ordinary regression (direct)",
    "oracle": "shown the true policy itself (oracle)",
}


def demo(
    out: Annotated[
        Path, typer.Option("--out", help="Folder for the picture, the table and the data.")
    ] = Path("unconstrain-demo"),
) -> None:
    """Simulate 40 constrained movements, learn the policy behind them, draw it."""
    console = reporting.console()
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UnconstrainError(f"cannot make the folder {out}: {error.strerror}") from error
    with console.status("40 movements around a limit cycle, each bent by three unknown constraints"):
        training, test = experiment.draw_data(0)
        rows = []
        for kind, name in ROWS.items():
            policy = experiment.learn(training, kind)
            errors = experiment.measure_errors(policy, test)
            share = metrics.explained(test.actions, policy.predict(test.states))
            rows.append((name, f"{errors['nUPE']:.2g}", f"{errors['nCPE']:.2g}", f"{share:.2%}"))
        picture = plot.save(experiment.plot_fields(), out / "limit-cycle.png")
        _write_csv(training, out / "movements.csv")
    columns = ("learnt from the same 40 movements", "nUPE", "nCPE", "motion explained")
    _write_markdown(columns, rows, out / "table.md")
    table = Table(*columns, title="40 other movements, held out")
    for row in rows:
        table.add_row(*row)
    console.print(table)
    console.print(
        "nUPE, nCPE: squared error without and with constraints, as a share of the policy's variance"
    )
    console.print(f"picture: {picture}\ntable: {out / 'table.md'}\ndata: {out / 'movements.csv'}")
    console.print("\nnext, the same from a file (put your own in its place):")
    console.print(
        f"  unconstrain fit {quoted(out / 'movements.csv')} --state x1,x2 --action u1,u2 --episode episode --model rbf "
        f"--out {quoted(out / 'policy.skops')}",
    )


def _write_csv(demos: Demonstrations, path: Path) -> None:
    """What a recording would hold: no true policy, no projections."""
    columns = {"episode": demos.episodes, "t": demos.time}
    columns |= {name: demos.states[:, i] for i, name in enumerate(demos.state_names)}
    columns |= {name: demos.actions[:, i] for i, name in enumerate(demos.action_names)}
    with atomic.replacing(path) as temporary:
        pyarrow.csv.write_csv(
            pa.table({name: np.asarray(values) for name, values in columns.items()}), temporary
        )


def _write_markdown(columns: tuple[str, ...], rows: Sequence[tuple[str, ...]], path: Path) -> None:
    lines = [columns, ("---",) * len(columns), *rows]
    with atomic.replacing(path) as temporary:
        temporary.write_text("\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n", encoding="utf-8")
