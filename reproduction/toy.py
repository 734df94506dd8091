"""The toy limit cycle (section 4.1): Figs. 3 and 4 over 100 data sets."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from rich.console import Console

from reproduction import published
from reproduction.outcome import Outcome, write_results
from reproduction.trials import run_trials
from unconstrain import demo, plot
from unconstrain.demo import FEW, MOVEMENTS, WIDTH, draw_data, learn, measure_errors
from unconstrain.plot.colors import DIRECT, LEARNT, RECORDED

TRIALS = 100
SHARES = (0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
"""Of the 40 movements, in Fig. 4 (top). 5 % are two movements, the fewest that can be cross-validated."""
NOISE = (0.0, 0.025, 0.05, 0.075, 0.1, 0.125, 0.15, 0.175, 0.2)
"""Standard deviation of noise on the actions as a share of their scale, in Fig. 4 (bottom)."""

CHOICES = (
    "Starts are uniform in [-1, 1]² (the region is not given).",
    f"The 36 RBFs stand on a 6 x 6 grid over [-1, 1]² with width σ = {WIDTH}, the same for every fit "
    '("suitable overlap").',
    "λ is chosen among 25 values by the inconsistency held out in five folds of movements (four with four movements), "
    "which stands for the validation subset.",
    "Errors are taken on 40 other movements under other constraints of the same kind.",
)


def trial(seed: int) -> dict[str, dict[str, float]]:
    """Errors of one data set: the table's rows, and both sweeps."""
    training, test = draw_data(seed)
    result = {
        f"{kind}, {movements} trajectories": measure_errors(learn(training, kind, movements), test)
        for kind in ("inconsistency", "direct", "oracle")
        for movements in (FEW, MOVEMENTS)
    }
    for share in SHARES:
        result[f"share {share}"] = measure_errors(learn(training, movements=round(share * MOVEMENTS)), test)
    for noise in NOISE:
        noisy, test = draw_data(seed, noise)
        result[f"noise {noise}"] = measure_errors(learn(noisy), test)
    return result


def reproduce(out: Path, *, trials: int | None = None, jobs: int = 1, console: Console) -> Outcome:
    """Run the trials, and write Figs. 3 and 4, the table, and the JSON of all trials into `out`."""
    trials = trials or TRIALS
    settings = {"experiment": "toy", "width": WIDTH, "shares": SHARES, "noise": NOISE, "version": 1}
    results = run_trials(
        trial, trials, out / "trials.jsonl", settings=settings, jobs=jobs, console=console, label="toy"
    )
    table = _table(results)
    files = write_results(out, {"settings": settings, "trials": results}, table)
    written = {
        name: [plot.save(figure, out / f"{name}{suffix}") for suffix in (".png", ".svg")]
        for name, figure in (("fig3", figure_3(results)), ("fig4", figure_4(results)))
    }
    captions = {
        "fig3": "Fig. 3 anew: the true policy; learnt from 4 and from 40 constrained movements; ordinary regression on "
        "the same 40. Dotted: movements.",
        "fig4": f"Fig. 4 anew: errors against the size of the data set and against noise; mean over {trials} data "
        "sets, from the 10th to the 90th percentile shaded.",
    }
    return Outcome(
        title="The toy limit cycle (Figs. 3 and 4)",
        table=table,
        figures={paths[0]: captions[name] for name, paths in written.items()},
        choices=CHOICES,
        findings=_findings(results),
        files=(*files, *(paths[1] for paths in written.values())),
    )


def _collected(results: list[dict], row: str, error: str) -> NDArray[np.float64]:
    return np.array([result[row][error] for result in results])


def _table(results: list[dict]) -> str:
    lines = [
        "| | nUPE published | nUPE ours | nCPE published | nCPE ours |",
        "| --- | --- | --- | --- | --- |",
    ]
    for row in results[0]:
        if row.startswith(("share", "noise")):
            continue
        cells = [row]
        for error in ("nUPE", "nCPE"):
            known = published.TOY.get(row, {}).get(error)
            values = _collected(results, row, error)
            cells += [
                f"{known[0]:.4f} ± {known[1]:.4f}" if known else "",
                f"{values.mean():.2g} ± {values.std():.2g}",
            ]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + f"\n\nMean ± standard deviation over {len(results)} data sets.\n"


def _findings(results: list[dict]) -> tuple[str, ...]:
    ours, oracle, direct, few = (
        _collected(results, row, "nUPE").mean()
        for row in (
            "inconsistency, 40 trajectories",
            "oracle, 40 trajectories",
            "direct, 40 trajectories",
            "inconsistency, 4 trajectories",
        )
    )
    cpe = _collected(results, "inconsistency, 40 trajectories", "nCPE").mean()
    return (
        f"40 trajectories: mean nUPE {ours:.2g} (published 0.0027), mean nCPE {cpe:.2g} (published 0.0002).",
        f"4 trajectories: mean nUPE {few:.2g} (published 0.38).",
        f"The same model shown the true policy itself reaches {oracle:.2g}: ours is {ours / oracle:.2f} times that.",
        f"Ordinary regression on the same 40 trajectories: {direct:.2g}, {direct / ours:.0f} times ours.",
    )


def figure_3(results: list[dict]) -> Figure:
    """The true field, those learnt from 4 and from 40 movements, and the direct one; errors of all data sets."""
    captions = {}
    for row in results[0]:
        errors = {error: _collected(results, row, error) for error in ("nUPE", "nCPE")}
        captions[row] = "\n".join(f"{error} {v.mean():.2g} ± {v.std():.2g}" for error, v in errors.items())
    return demo.plot_fields(captions)


def figure_4(results: list[dict]) -> Figure:
    """nUPE and nCPE against the share of the data (log scale), and against noise on the actions."""
    figure = Figure(figsize=(10.0, 4.0), layout="constrained")
    left, right = figure.subplots(1, 2)
    for ax, name, values, title in (
        (left, "share", SHARES, "size of the data set (% of 40 trajectories)"),
        (right, "noise", NOISE, "noise on the actions (% of their scale)"),
    ):
        for error, color, marker in (("nUPE", LEARNT, "o"), ("nCPE", DIRECT, "s")):
            all_values = np.array([_collected(results, f"{name} {value}", error) for value in values])
            percent = 100 * np.array(values)
            low, high = np.percentile(all_values, [10, 90], axis=1)
            ax.fill_between(percent, low, high, color=color, alpha=0.15, lw=0)
            ax.plot(percent, all_values.mean(axis=1), f"{marker}-", color=color, label=error, ms=4)
        ax.set(xlabel=title, ylabel="normalised error")
        ax.legend(frameon=False)
        ax.grid(alpha=0.3)
    left.set_yscale("log")
    right.plot(100 * np.array(NOISE), np.square(NOISE), color=RECORDED, ls="--", label="noise variance")
    right.legend(frameon=False)
    return figure
