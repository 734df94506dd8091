"""Table I: as published, and with a choice of models that know more about policies."""

import re
from functools import partial
from pathlib import Path

from rich.console import Console

from reproduction.adaptive_column import ADAPTIVE, run_adaptive
from reproduction.arm import tables, trial
from reproduction.arm.figures import plot_table
from reproduction.outcome import Outcome, write_figures, write_json
from reproduction.trials import run_trials
from unconstrain.errors import UnconstrainError
from unconstrain.robots import TaskConstraint

TRIALS, ADAPTIVE_TRIALS = 100, 10
"""Data sets, and how many of them are learnt by risk "adaptive" as well."""

MODELS = ("published", "auto")

CHOICES = (
    "An action lasts one step, x ← x + u: the paper gives no step, and with this one its number of local models "
    "and its errors result.",
    f"{trial.TRAINING_SHARE:.0%} of the {trial.EPISODES} x {trial.LENGTH} samples, drawn at random, "
    "are learnt from and the others are the test: the paper speaks of a training subset and a subset held out, and "
    "this gives its figures and their spread. Testing on whole trajectories from new starts is harder; those errors "
    "stand beside.",
    f"The complementary constraint is tested on {trial.COMPLEMENTARY_EPISODES} trajectories from starts of the "
    "same data set, "
    f"the new starts are {trial.NEW_EPISODES} more.",
    "Local models decay to the linear policy of all data. λ is the same for all of them, that of 25 with the least "
    "inconsistency on episodes held out, five folds.",
    "Risk adaptive chooses λ by the library's rule; Table I's own risk takes the λ of least held-out inconsistency.",
    "Jacobians are those of the hand in the base's frame, geometric, so rows 4 to 6 are angular velocities.",
)
CHOICES_AUTO = (
    "Episodes are held out whole when candidates are compared, as a user would; the data sets and tests are those of "
    "Table I.",
    "Candidates: the paper's local models; 50 normalised RBFs (σ² = 3); cubic splines of each joint for each action; "
    "decoupled splines with 15 and 31 knots; the gradient of 100 RBFs.",
)


def reproduce(
    out: Path,
    *,
    trials: int | None = None,
    jobs: int = 1,
    console: Console,
    model: str = "published",
    constraint: str | None = None,
    physics: bool = False,
    adaptive: int | None = None,
) -> Outcome:
    """Reproduce Table I: published | ours.

    Parameters
    ----------
    out : Path
        The folder to write into. Finished trials are kept there.
    trials : int, optional
        Number of data sets; by default 100, as published (50 in physics).
    jobs : int
        Processes.
    console : Console
        Where progress is shown.
    model : str
        "published" for the paper's local linear models, "auto" for a choice among six by inconsistency alone.
    constraint : str, optional
        One instead of the published four: task rows "1-2-3", a plane's normal "0,0,1", or a matrix; see
        `TaskConstraint.parse`.
    physics : bool
        The arm moves by MuJoCo's dynamics instead, and is constrained by contact; needs the extra `sim`.
    adaptive : int, optional
        Data sets of Table I that are learnt by risk "adaptive" as well; by default 10.

    Returns
    -------
    Outcome
        With the table as Markdown.

    Raises
    ------
    UnconstrainError
        If the model or the constraint is not known, or an option does not belong to the model or to the physics.
    """
    if model not in MODELS:
        raise UnconstrainError(f"there is no model {model!r} for the arm: choose {' or '.join(MODELS)}")
    if adaptive is not None and (physics or model != "published"):
        raise UnconstrainError(
            "adaptive= belongs to the published model: leave it out, or leave out model= and physics="
        )
    if physics:
        if constraint is not None or model != "published":
            raise UnconstrainError(
                "in physics the hand is gripped or on a table, and all models are compared: leave out constraint= "
                "and model="
            )
        from reproduction.arm.physics import experiment

        return experiment.reproduce(out, trials=trials, jobs=jobs, console=console)
    return _reproduce_table(out, trials or TRIALS, jobs, console, model, constraint, adaptive)


def _reproduce_table(
    out: Path,
    count: int,
    jobs: int,
    console: Console,
    model: str,
    constraint: str | None,
    adaptive: int | None,
) -> Outcome:
    constraints = trial.CONSTRAINTS if constraint is None else (_check_constraint(constraint),)
    auto = model == "auto"
    name = "auto" if auto else "table1"
    if constraint is not None:
        name += "_" + re.sub("[^0-9]+", "_", constraints[0]).strip("_")
    kept = out / f"{name}.jsonl"
    settings = {"model": model, "constraints": constraints, **trial.SETTINGS}
    results = run_trials(
        partial(trial.run_auto_rows if auto else trial.run_published_rows, constraints),
        count,
        kept,
        settings=settings,
        jobs=jobs,
        console=console,
        label=f"arm, {model}",
    )
    inferred = run_adaptive(
        partial(trial.run_adaptive_rows, constraints),
        0 if auto else adaptive,
        ADAPTIVE_TRIALS,
        count,
        out,
        settings=settings,
        jobs=jobs,
        console=console,
        label="arm",
        file=f"{name}_{ADAPTIVE}.jsonl",
    )
    caption = (
        f"Errors of the {'chosen' if auto else 'local linear'} models over {len(results)} data sets: mean and "
        "standard deviation, published and ours."
    )
    shown, drawn = write_figures(out, {name: (plot_table(results, inferred), caption)})
    everything = {"settings": settings, "trials": results, ADAPTIVE: inferred}
    files = (write_json(out / f"{name}.json", everything), *drawn, kept)
    if auto:
        return Outcome(
            title="The arm, model chosen by inconsistency alone",
            table=tables.write_auto_table(results),
            figures=shown,
            choices=(*CHOICES_AUTO, *CHOICES[:3]),
            findings=tables.list_auto_findings(results),
            files=files,
        )
    return Outcome(
        title="The arm (Table I)",
        table=tables.write_published_table(results, inferred),
        figures=shown,
        choices=CHOICES,
        findings=tables.list_published_findings(results, inferred),
        files=files,
    )


def _check_constraint(constraint: str) -> str:
    """Return the constraint's text, once it and its complement are known to make sense."""
    understood = TaskConstraint.parse(constraint)
    understood.complement()
    return understood.name
