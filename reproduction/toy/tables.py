"""The toy's results as Markdown, and what is to be said about them."""

from reproduction import published
from reproduction.markdown import mean_and_deviation, table
from reproduction.toy.trial import Result, collect


def write_table(results: list[Result]) -> str:
    """Write the errors of every way to learn: published | ours."""
    rows = []
    for row in results[0]:
        if row.startswith(("share", "noise")):
            continue
        cells = [row]
        for error in ("nUPE", "nCPE"):
            known = published.TOY.get(row, {}).get(error)
            cells += [
                f"{known[0]:.4f} ± {known[1]:.4f}" if known else "",
                mean_and_deviation(collect(results, row, error)),
            ]
        rows.append(cells)
    header = ["", "nUPE published", "nUPE ours", "nCPE published", "nCPE ours"]
    return table(header, rows) + f"\n\nMean ± standard deviation over {len(results)} data sets.\n"


def list_findings(results: list[Result]) -> tuple[str, ...]:
    """Compare our means with the published ones, a sentence each."""
    ours, oracle, direct, few = (
        collect(results, row, "nUPE").mean()
        for row in (
            "inconsistency, 40 trajectories",
            "oracle, 40 trajectories",
            "direct, 40 trajectories",
            "inconsistency, 4 trajectories",
        )
    )
    cpe = collect(results, "inconsistency, 40 trajectories", "nCPE").mean()
    return (
        f"40 trajectories: mean nUPE {ours:.2g} (published 0.0027), mean nCPE {cpe:.2g} (published 0.0002).",
        f"4 trajectories: mean nUPE {few:.2g} (published 0.38).",
        f"The same model shown the true policy itself reaches {oracle:.2g}: ours is {ours / oracle:.2f} times that.",
        f"Ordinary regression on the same 40 trajectories: {direct:.2g}, {direct / ours:.0f} times ours.",
    )
