"""Regressors of others as policies: what each learns by itself, wrapped, told the projections, and from the truth."""

from functools import partial
from pathlib import Path

from rich.console import Console

from reproduction.outcome import Outcome, make_folder, write_results
from reproduction.regressors import problems, tables
from reproduction.regressors.kinds import CHOSEN_ON, KINDS
from reproduction.regressors.problems import PLANTS
from reproduction.regressors.trial import PRIORS, Result, run_trial
from reproduction.trials import run_trials
from unconstrain.errors import UnconstrainError

TRIALS = 3
"""Data sets of each row."""

CHOICES = (
    "Direct: the regressor fitted to the actions as recorded. Wrapped: `uc.RegressorPolicy`, risk adaptive. Told: the "
    "same by inconsistency, knowing the true projection of every sample. Truth: the regressor is fitted to the true "
    "policy.",
    f"Noise is {problems.NOISE:.0%} of the root mean square of all components of the clean actions, on recorded "
    "actions alone; data tested on have none.",
    f"Options of the regressors were chosen on data sets {CHOSEN_ON[0]} and {CHOSEN_ON[1]} of the limit cycle and of "
    "the grasps, told the projections; those reported begin at 0.",
    "The arm is tested on samples held out of the same movements, as in Table I; the others on other movements.",
)


def reproduce(
    out: Path,
    *,
    trials: int | None = None,
    jobs: int = 1,
    console: Console,
    plant: str | None = None,
    regressor: str | None = None,
) -> Outcome:
    """Run the regressors, and write tables and the JSON of all trials into `out`.

    Parameters
    ----------
    out : Path
        The folder to write into. Finished trials are kept there.
    trials : int, optional
        Data sets of each row; by default three.
    jobs : int
        Processes.
    console : Console
        Where progress is shown.
    plant : str, optional
        The only plant: "cycle", "arm" or "grasp".
    regressor : str, optional
        The only regressor, of `KINDS`.

    Returns
    -------
    Outcome
        With the tables as Markdown. What lacks an extra is left out, and that is said.

    Raises
    ------
    UnconstrainError
        If there is no such plant or regressor, or the only one lacks what it needs.
    """
    for given, known, what in ((plant, PLANTS, "plant"), (regressor, KINDS, "regressor")):
        if given is not None and given not in known:
            raise UnconstrainError(f"there is no {what} {given!r}: choose one of {', '.join(known)}")
    make_folder(out)
    results: dict[str, dict[str, list[Result]]] = {}
    missing: list[str] = []
    kinds = _list_installed(regressor, missing)
    for each in PLANTS if plant is None else (plant,):
        try:
            results[each] = {kind: _run(each, kind, out, trials, jobs, console) for kind in kinds}
        except UnconstrainError as error:
            if plant is not None:
                raise
            missing.append(f"{problems.TITLES[each]} is left out: {error}.")
    table = "\n".join(tables.write_plant(name, of_plant) for name, of_plant in results.items())
    return Outcome(
        title="Any regression technique",
        table=table,
        choices=CHOICES,
        findings=(*tables.list_findings(results), *missing),
        files=write_results(out, results, table),
    )


def _list_installed(regressor: str | None, missing: list[str]) -> list[str]:
    """List the regressors that can be made here, and say of the others why not."""
    kinds = []
    for kind in KINDS if regressor is None else (regressor,):
        try:
            KINDS[kind]()
        except UnconstrainError as error:
            if regressor is not None:
                raise
            missing.append(f"{kind} is left out: {error}.")
        else:
            kinds.append(kind)
    return kinds


def _run(plant: str, kind: str, out: Path, trials: int | None, jobs: int, console: Console) -> list[Result]:
    settings = {
        "experiment": "regressors",
        "plant": plant,
        "rows": list(PLANTS[plant]),
        "movements": problems.ARM_EPISODES if plant == "arm" else None,
        "regressor": " ".join(repr(KINDS[kind]()).split()),
        "priors": PRIORS,
    }
    return run_trials(
        partial(run_trial, plant, kind),
        trials or TRIALS,
        out / f"{plant}.jsonl",
        settings=settings,
        jobs=jobs,
        console=console,
        label=f"regressors, {plant}, {kind}",
    )
