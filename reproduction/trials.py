"""Many trials of one experiment, in several processes; what is finished is kept.

Each finished trial is a line of JSON, appended at once, that names its seed and the settings it was made with. A second
call with the same settings goes on from them; trials made with other settings are never used, and stay in the file.
"""

import hashlib
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from joblib import Parallel, delayed, parallel_config
from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from threadpoolctl import threadpool_limits

from unconstrain.errors import UnconstrainError

Result = dict[str, Any]


def run_trials(
    trial: Callable[[int], Result],
    trials: int,
    kept: Path,
    *,
    settings: dict[str, Any],
    jobs: int = 1,
    console: Console | None = None,
    label: str = "trials",
) -> list[Result]:
    """Run `trial(0)` to `trial(trials - 1)`, and return their results in that order.

    Ctrl-C stops after saying how many trials are kept.

    Parameters
    ----------
    trial : callable
        A picklable function of the seed; its result must be JSON.
    trials : int
        How many.
    kept : Path
        The file of finished trials, made if it is not there.
    settings : dict
        What the results depend on besides the seed, as JSON.
    jobs : int
        Processes; BLAS has one thread in each, so that results do not depend on `jobs`.
    console : Console, optional
        Where progress is shown.
    label : str
        Beside the progress bar.

    Returns
    -------
    list of dict
        A result a seed.

    Raises
    ------
    UnconstrainError
        If `trials` or `jobs` is not positive, or `kept` cannot be read or written.
    """
    if trials < 1 or jobs < 1:
        raise UnconstrainError(f"at least one trial and one job are needed, not {trials} and {jobs}")
    console = console or Console()
    key = hashlib.sha256(json.dumps(settings, sort_keys=True).encode()).hexdigest()[:16]
    done = {seed: result for seed, result in _read(kept, key).items() if seed < trials}
    missing = [seed for seed in range(trials) if seed not in done]
    if done:
        console.print(f"{label}: {len(done)} of {trials} are kept from before in {kept}")
    if not missing:
        return [done[seed] for seed in range(trials)]
    try:
        kept.parent.mkdir(parents=True, exist_ok=True)
        _end_torn_line(kept)
        file = kept.open("a", encoding="utf-8")
    except OSError as error:
        raise UnconstrainError(f"cannot keep trials in {kept}: {error.strerror}") from error
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    with file, Progress(*columns, TimeElapsedColumn(), TimeRemainingColumn(), console=console) as progress:
        bar = progress.add_task(label, total=trials, completed=len(done))
        try:
            for seed, result in _run(trial, missing, jobs):
                file.write(json.dumps({"settings": key, "seed": seed, "result": result}) + "\n")
                file.flush()
                done[seed] = result
                progress.advance(bar)
        except KeyboardInterrupt:
            progress.stop()
            console.print(
                f"stopped: {len(done)} of {trials} are kept in {kept}; the same command goes on from them"
            )
            raise
    # Through JSON as those read back are, so that an interrupted run ends with the same values to the letter.
    return [json.loads(json.dumps(done[seed])) for seed in range(trials)]


def _run(trial: Callable[[int], Result], seeds: list[int], jobs: int) -> Iterator[tuple[int, Result]]:
    if jobs == 1 or len(seeds) == 1:
        with threadpool_limits(1):
            for seed in seeds:
                yield seed, trial(seed)
        return
    with parallel_config("loky", n_jobs=min(jobs, len(seeds)), inner_max_num_threads=1):
        yield from Parallel(return_as="generator_unordered")(
            delayed(_with_seed)(trial, seed) for seed in seeds
        )


def _with_seed(trial: Callable[[int], Result], seed: int) -> tuple[int, Result]:
    """Run a trial in another process; results arrive in any order."""
    return seed, trial(seed)


def _read(kept: Path, key: str) -> dict[int, Result]:
    if not kept.is_file():
        return {}
    try:
        lines = kept.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError as error:
        raise UnconstrainError(f"cannot read the trials kept in {kept}: {error.strerror}") from error
    results = {}
    for line in lines:
        try:
            entry = json.loads(line)
            if entry["settings"] == key:
                results[entry["seed"]] = entry["result"]
        except (ValueError, KeyError, TypeError):
            continue  # a line cut short when the process was killed: that trial is run again
    return results


def _end_torn_line(kept: Path) -> None:
    if kept.is_file() and kept.stat().st_size and not kept.read_bytes().endswith(b"\n"):
        with kept.open("a", encoding="utf-8") as file:
            file.write("\n")
