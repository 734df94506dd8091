"""The toy limit cycle over 100 data sets."""

from functools import partial
from pathlib import Path

from rich.console import Console

from reproduction.adaptive_column import ADAPTIVE, run_adaptive
from reproduction.outcome import Outcome, write_figures, write_results
from reproduction.toy.figures import plot_fields, plot_sweeps
from reproduction.toy.tables import list_findings, write_table
from reproduction.toy.trial import SETTINGS, run_trial
from reproduction.trials import run_trials
from unconstrain.demo import WIDTH

TRIALS, ADAPTIVE_TRIALS = 100, 20
"""Data sets, and how many of them are learnt by risk "adaptive" as well."""

CHOICES = (
    "Starts are uniform in [-1, 1]² (the region is not given).",
    f"The 36 RBFs stand on a 6 x 6 grid over [-1, 1]² with width σ = {WIDTH}, the same for every fit "
    '("suitable overlap").',
    "λ is chosen among 25 values by the inconsistency held out in five folds of movements (four with four movements), "
    "which stands for the validation subset.",
    "Errors are taken on 40 other movements under other constraints of the same kind.",
)


def reproduce(
    out: Path,
    *,
    trials: int | None = None,
    jobs: int = 1,
    console: Console,
    adaptive: int | None = None,
) -> Outcome:
    """Run the trials, and write Figs. 3 and 4, the table, and the JSON of all trials into `out`.

    `adaptive` is the number of data sets that are learnt by risk "adaptive" as well, by default 20.
    """
    count = trials or TRIALS
    results = run_trials(
        run_trial, count, out / "trials.jsonl", settings=SETTINGS, jobs=jobs, console=console, label="toy"
    )
    inferred = run_adaptive(
        partial(run_trial, ways=(ADAPTIVE,)),
        adaptive,
        ADAPTIVE_TRIALS,
        count,
        out,
        settings=SETTINGS,
        jobs=jobs,
        console=console,
        label="toy",
    )
    table = write_table(results, inferred)
    shown, drawn = write_figures(
        out,
        {
            "fig3": (
                plot_fields(results),
                "Fig. 3 anew: the true policy; learnt from 4 and from 40 constrained movements; ordinary regression "
                "on the same 40. Dotted: movements.",
            ),
            "fig4": (
                plot_sweeps(results, inferred),
                "Fig. 4 anew: errors against the size of the data set without noise (left, the paper's top) and "
                "against noise (right, the paper's bottom), means over the data sets. Shaded: the nUPE from the 10th "
                "to the 90th percentile.",
            ),
        },
    )
    return Outcome(
        title="The toy limit cycle (Figs. 3 and 4)",
        table=table,
        figures=shown,
        choices=CHOICES,
        findings=list_findings(results, inferred),
        files=(
            *write_results(out, {"settings": SETTINGS, "trials": results, ADAPTIVE: inferred}, table),
            *drawn,
        ),
    )
