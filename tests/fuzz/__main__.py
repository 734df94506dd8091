"""Make inputs and judge what comes of them: `python -m tests.fuzz --number 20000 --seed 1`."""

import argparse
import os
import secrets
import shutil
import sys
from pathlib import Path

# Many small processes at a time do better with a thread each.
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"
os.environ |= {"COLUMNS": "200", "MPLBACKEND": "agg", "NO_COLOR": "1"}

from tests.fuzz import engine  # noqa: E402


def main() -> int:
    """Run the fuzzer as the arguments of the process say, and return 1 if anything failed."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--number", "-n", type=int, default=1000, help="how many inputs in all")
    parser.add_argument("--seed", type=int, default=None, help="of the inputs; by default a new one")
    parser.add_argument("--area", action="append", choices=engine.AREAS, help="of these areas only")
    parser.add_argument("--jobs", "-j", type=int, default=os.cpu_count(), help="how many at a time")
    parser.add_argument(
        "--keep", type=Path, default=Path("out/fuzz"), help="where inputs that failed are kept"
    )
    parser.add_argument(
        "--replay", metavar="NAME", help="make one again: its folder's name, AREA-SEED-NUMBER"
    )
    given = parser.parse_args()
    keep = given.keep.resolve()
    if given.replay:
        area, seed, number = Path(given.replay).name.split("-")
        wanted, seed = {area: range(int(number), int(number) + 1)}, int(seed)
    else:
        seed = secrets.randbelow(10**6) if given.seed is None else given.seed
        areas = given.area or list(engine.AREAS)
        wanted = {
            area: range(given.number // len(areas) + (i < given.number % len(areas)))
            for i, area in enumerate(areas)
        }
    print(f"seed: {seed}", flush=True)
    shutil.rmtree(keep / "stock", ignore_errors=True)
    engine.import_all()
    made = {}
    for area in wanted:
        module = engine.area(area)
        engine.prepare(module.stock, keep / "stock" / area)
        made[area] = module.case
    counts, failures = engine.run_all(made, seed, wanted, keep, given.jobs)
    shutil.rmtree(keep / "stock", ignore_errors=True)
    for area in wanted:
        told = ", ".join(f"{n} {outcome}" for (own, outcome), n in sorted(counts.items()) if own == area)
        print(f"{area}: {told}")
    for (area, outcome, kind), names in failures.items():
        print(f"{area}: {outcome}, {len(names)} times: {kind}\n    {keep / names[0]}")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
