"""Run the benchmarks, print one table, write one JSON.

python -m benchmarks                      all
python -m benchmarks local-fit growth     some
python -m benchmarks models               which kind of policy for which data: errors and times, no ratios to reach
python -m benchmarks how-far              a pass over 10^9 and 10^12 rows on simulated clusters, in ten minutes
python -m benchmarks rivals               our policies beside GMR, LPV-DS, DMP and behaviour cloning, simulated
python -m benchmarks rivals-handwriting   the same and SEDS on handwriting; needs --data=FOLDER
python -m benchmarks rivals-wiping        those without a goal on wiping; needs --data=FOLDER
python -m benchmarks wider                100,000 parameters on 200,000 samples, the better part of an hour
python -m benchmarks --out FILE           where the JSON goes (default out/benchmarks.json)
"""

import argparse
import json
import platform
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import numpy as np
import scipy
import sklearn
from rich.console import Console
from rich.progress import track
from rich.table import Table

import unconstrain as uc
from benchmarks import (
    cluster,
    fits,
    identifiability,
    latency,
    loading,
    models,
    passes,
    predict,
    start,
    step,
    stream,
    viewer,
    warm,
    wide,
)
from benchmarks.far import tables as how_far
from benchmarks.ratio import Ratio
from benchmarks.rivals import handwriting, simulated, wiping
from unconstrain.errors import UnconstrainError

BENCHMARKS: dict[str, Callable[[], Ratio]] = {
    "local-fit": fits.local_fit,
    "adaptive-fit": fits.adaptive_fit,
    "parametric-fit": fits.parametric_fit,
    "wide-fit": fits.wide_fit,
    "iterative-fit": wide.fit,
    "iterative-memory": wide.memory,
    "iterative-path": wide.path,
    "lambda-path": fits.lambda_path,
    "lambda-path-wide": fits.lambda_path_wide,
    "lambda-path-local": fits.lambda_path_local,
    **passes.BENCHMARKS,
    "loop": fits.loop,
    "growth": fits.growth,
    "report": identifiability.report,
    "report-of-moments": identifiability.report_of_moments,
    "deviations": identifiability.deviations,
    "stream-linear": stream.linear,
    "stream-local": stream.local,
    "stream-linear-memory": stream.linear_memory,
    "stream-local-memory": stream.local_memory,
    **loading.BENCHMARKS,
    **warm.BENCHMARKS,
    **cluster.BENCHMARKS,
    **step.BENCHMARKS,
    **latency.BENCHMARKS,
    **predict.BENCHMARKS,
    **start.BENCHMARKS,
    **viewer.BENCHMARKS,
}

TABLES: dict[str, Callable[[Path | None], None]] = {
    "models": lambda _: models.print_tables(),
    "wider": lambda _: wide.wider(),
    "how-far": lambda _: how_far.print_tables(),
    "rivals": lambda _: simulated.print_tables(),
    "rivals-handwriting": handwriting.print_table,
    "rivals-wiping": wiping.print_table,
}
"""What is compared, not judged, given the folder of recordings; only run by name."""


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join([*BENCHMARKS, *TABLES]))
    parser.add_argument("--out", type=Path, default=Path("out/benchmarks.json"))
    parser.add_argument(
        "--data", type=Path, metavar="FOLDER", help="recordings, for rivals-handwriting and rivals-wiping"
    )
    given = parser.parse_args()
    unknown = set(given.names) - set(BENCHMARKS) - set(TABLES)
    if unknown:
        parser.error(
            f"no benchmark is called {', '.join(sorted(unknown))}; there are "
            f"{', '.join([*BENCHMARKS, *TABLES])}"
        )
    for name in given.names:
        if name in TABLES:
            try:
                TABLES[name](given.data)
            except UnconstrainError as error:
                parser.error(str(error))
    names = [name for name in given.names or BENCHMARKS if name in BENCHMARKS]
    if not names:
        return
    ratios = [BENCHMARKS[name]() for name in track(names, "benchmarks", transient=True)]
    given.out.parent.mkdir(parents=True, exist_ok=True)
    versions = {"unconstrain": uc.__version__, "numpy": np.__version__, "scipy": scipy.__version__}
    versions |= {"scikit-learn": sklearn.__version__, "python": platform.python_version()}
    given.out.write_text(
        json.dumps({"versions": versions, "ratios": [asdict(r) for r in ratios]}, indent=1) + "\n"
    )

    table = Table(
        "name", "work", "measured against", "ratio", "reach", "", title="unconstrain, speed as ratios"
    )
    for r in ratios:
        sign = ">=" if r.more_is_better else "<="
        verdict = "reached" if r.reached else "missed"
        table.add_row(r.name, r.work, r.against, f"{r.value:.3g}", f"{sign} {r.reach:g}", verdict)
    console = Console()
    console.print(table)
    console.print(f"written to {given.out}")


if __name__ == "__main__":
    main()
