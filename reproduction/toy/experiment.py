"""The toy limit cycle over 100 data sets."""

from pathlib import Path

from rich.console import Console

from reproduction.outcome import Outcome, write_figures, write_results
from reproduction.toy.figures import plot_fields, plot_sweeps
from reproduction.toy.tables import list_findings, write_table
from reproduction.toy.trial import SETTINGS, run_trial
from reproduction.trials import run_trials
from unconstrain.demo import WIDTH

TRIALS = 100

CHOICES = (
    "Starts are uniform in [-1, 1]² (the region is not given).",
    f"The 36 RBFs stand on a 6 x 6 grid over [-1, 1]² with width σ = {WIDTH}, the same for every fit "
    '("suitable overlap").',
    "λ is chosen among 25 values by the inconsistency held out in five folds of movements (four with four movements), "
    "which stands for the validation subset.",
    "Errors are taken on 40 other movements under other constraints of the same kind.",
)


def reproduce(out: Path, *, trials: int | None = None, jobs: int = 1, console: Console) -> Outcome:
    """Run the trials, and write Figs. 3 and 4, the table, and the JSON of all trials into `out`."""
    results = run_trials(
        run_trial,
        trials or TRIALS,
        out / "trials.jsonl",
        settings=SETTINGS,
        jobs=jobs,
        console=console,
        label="toy",
    )
    table = write_table(results)
    shown, drawn = write_figures(
        out,
        {
            "fig3": (
                plot_fields(results),
                "Fig. 3 anew: the true policy; learnt from 4 and from 40 constrained movements; ordinary regression "
                "on the same 40. Dotted: movements.",
            ),
            "fig4": (
                plot_sweeps(results),
                "Fig. 4 anew: errors against the size of the data set and against noise; mean over "
                f"{len(results)} data sets, from the 10th to the 90th percentile shaded.",
            ),
        },
    )
    return Outcome(
        title="The toy limit cycle (Figs. 3 and 4)",
        table=table,
        figures=shown,
        choices=CHOICES,
        findings=list_findings(results),
        files=(*write_results(out, {"settings": SETTINGS, "trials": results}, table), *drawn),
    )
