"""How long it takes until the program does something: whole processes, against those that import what it needs.

Nothing heavy may be imported before it is used. What is heavy is counted here, and not only named in a test, because
time is lost in small pieces too.
"""

import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

from benchmarks.ratio import Ratio, medians
from unconstrain.limit_cycle import demonstrate
from unconstrain.recordings.text import write_csv

PROGRAM = (sys.executable, "-m", "unconstrain")
MISTAKES = (
    ("fry",),
    ("fit",),
    ("fit", "a.csv", "--bogus"),
    ("fit", "a.csv", "--model", "forest"),
    ("fit", "a.csv", "--alpha", "some"),
    ("fit", "a.csv", "--state", "x,,y"),
    ("fit", "a.csv", "--model", "linear", "--width", "1"),
    ("fit", __file__, "--out", __file__),
    ("rollout", "p.skops", "--start", "a,b"),
)


def start_help() -> Ratio:
    """The list of commands."""
    return _against_typer("start-help", "unconstrain --help", [("--help",)])


def start_help_of_fit() -> Ratio:
    """The options of the command that has most."""
    return _against_typer("start-help-fit", "unconstrain fit --help", [("fit", "--help")])


def start_version() -> Ratio:
    """The version."""
    return _against_typer("start-version", "unconstrain --version", [("--version",)])


def start_mistake() -> Ratio:
    """The slowest of several mistakes on the command line."""
    return _against_typer("start-mistake", f"slowest of {len(MISTAKES)} usage errors", MISTAKES)


def start_import() -> Ratio:
    """The package."""
    ours, theirs = medians(_python("import unconstrain"), _python("import numpy"))
    return Ratio("start-import", "import unconstrain", "import numpy", ours / theirs, 1.5, ours, theirs)


def start_fit() -> Ratio:
    """A fit on a small CSV file, with its comparison and its warning."""
    with tempfile.TemporaryDirectory() as folder:
        recording, policy = Path(folder) / "movements.csv", Path(folder) / "policy.skops"
        write_csv(demonstrate(40, random_state=0), recording)
        columns = ("--state", "x1,x2", "--action", "u1,u2", "--episode", "episode")
        fit = _run((*PROGRAM, "fit", str(recording), *columns, "--out", str(policy), "--overwrite"))
        ours, theirs = medians(fit, _python("import sklearn.linear_model"))
        assert policy.exists()
    work = "fit of 1600 samples in CSV"
    return Ratio("start-fit", work, "import sklearn.linear_model", ours / theirs, 1.6, ours, theirs)


def _against_typer(name: str, work: str, several: Sequence[tuple[str, ...]]) -> Ratio:
    *each, theirs = medians(*(_run((*PROGRAM, *given)) for given in several), _python("import typer, rich"))
    ours = max(each)
    return Ratio(name, work, "import typer, rich", ours / theirs, 2.0, ours, theirs)


def _python(code: str) -> Callable[[], object]:
    return _run((sys.executable, "-c", code))


def _run(command: Sequence[str]) -> Callable[[], object]:
    return lambda: subprocess.run(command, capture_output=True, check=False)


BENCHMARKS: dict[str, Callable[[], Ratio]] = {
    "start-help": start_help,
    "start-help-fit": start_help_of_fit,
    "start-version": start_version,
    "start-mistake": start_mistake,
    "start-import": start_import,
    "start-fit": start_fit,
}
