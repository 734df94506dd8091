"""`unconstrain demo`: the toy experiment once, from data to picture."""

from collections.abc import Sequence
from pathlib import Path

import click

from unconstrain import atomic
from unconstrain.cli import outputs, reporting
from unconstrain.cli.command import command, in_words_of_program
from unconstrain.errors import UnconstrainError
from unconstrain.progress import working

WAYS = {
    "direct": "ordinary regression (direct)",
    "inconsistency": "as if none of it were free (inconsistency)",
    "adaptive": "what was free is inferred (adaptive)",
    "told": "told every constraint (told)",
}
COLUMNS = ("learnt from the same 40 movements", "nUPE", "nCPE")


@command(short_help="Learn from simulated movements, and draw it.")
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    default="unconstrain-demo",
    show_default=True,
    help="Folder for the picture, the table and the data.",
)
@click.option("--overwrite", is_flag=True, help="Replace what an earlier demo left in that folder.")
def demo(out: Path, overwrite: bool) -> None:
    """Simulate 40 movements, noisy and half of them constrained, learn the policy behind them, draw it."""
    out = atomic.as_path(out)
    picture, table = out / "limit-cycle.png", out / "table.md"
    data, others = out / "movements.csv", out / "others.csv"
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UnconstrainError(f"cannot make the folder {out}: {error.strerror}") from error
    for path in (picture, table, data, others):
        outputs.check_new(path, "out", overwrite=overwrite)
    from unconstrain import datasets, plot
    from unconstrain import demo as experiment
    from unconstrain.policies.inferred import describe_inferred
    from unconstrain.recordings.text import write_csv

    with working("40 movements around a limit cycle, half of them bent by unknown constraints"):
        training, test = experiment.draw_recordings(0)
        policies = {way: experiment.learn_shown(training, way) for way in WAYS}
        rows = []
        for way, name in WAYS.items():
            errors = experiment.measure_errors(policies[way], test)
            rows.append((name, f"{errors['nUPE']:.2g}", f"{errors['nCPE']:.2g}"))
        plot.save(experiment.plot_shown(policies), picture)
        write_csv(training, data)
        write_csv(test, others)
        _write_markdown(COLUMNS, rows, table)
    reporting.say_table(COLUMNS, rows, title="40 other movements, held out")
    reporting.say(
        "nUPE, nCPE: squared error without and with constraints, as a share of the policy's variance"
    )
    reporting.say(in_words_of_program(describe_inferred(policies["adaptive"])))
    reporting.say(f"picture: {picture}\ntable: {table}\ndata: {data}\nheld out: {others}")
    wiping = reporting.shell_word(datasets.path("wiping.csv"))
    reporting.say(f"another recording, a hand that wipes boards, with a force sensor: {wiping}")
    reporting.say("\nnext, the same from a file (put your own in its place):")
    reporting.say(
        f"  unconstrain fit {reporting.shell_word(data)} --state x1,x2 --action u1,u2 --time t --episode episode "
        f"--model rbf --width {experiment.WIDTH} --out {reporting.shell_word(out / 'policy.skops')} --overwrite"
    )


def _write_markdown(columns: Sequence[str], rows: Sequence[Sequence[str]], path: Path) -> None:
    lines = [columns, ("---",) * len(columns), *rows]
    with atomic.replacing(path) as temporary:
        temporary.write_text("\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n", encoding="utf-8")
