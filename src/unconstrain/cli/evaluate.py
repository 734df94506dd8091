"""`unconstrain evaluate`: a policy against recordings it has not seen."""

import math
from pathlib import Path
from typing import TYPE_CHECKING

import click

from unconstrain.cli import recordings, reporting
from unconstrain.cli.command import command
from unconstrain.progress import working

if TYPE_CHECKING:
    from unconstrain.evaluation import Line

SHOWN_EPISODES = 20
COLUMNS = (
    "episode",
    "samples",
    "free",
    "error of the action (rms)",
    "angle to it",
    "share of what is shown explained",
)


@command(epilog="For example:\n\n\b\nunconstrain evaluate wipe.skops other_day.csv")
@click.argument("policy", type=click.Path(path_type=Path))
@recordings.recorded
def evaluate(policy: Path, recorded: recordings.Recorded) -> None:
    """Hold a saved policy against other recordings.

    POLICY was saved by `unconstrain fit`, and FILES are read as those it was learnt from, unless an option says
    otherwise; --state names all columns anew. Where something was in the way even the true policy differs from the
    recorded action: what is shown is the whole action of free samples, and the motion of others.
    """
    from unconstrain import evaluation
    from unconstrain.policies import load_policy
    from unconstrain.policies.inferred import describe_inferred

    learnt = load_policy(policy)
    with working("reading"):
        demos = recorded.like(getattr(learnt, "recording_", None)).load()
    recordings.describe(demos)
    recorded.check_names(learnt, demos)
    found = evaluation.evaluate(learnt, demos, SHOWN_EPISODES)
    learnt_from = describe_inferred(learnt)
    if learnt_from:
        reporting.say(f"of the recordings it was learnt from,\n{learnt_from}")
    rows = [_cells(line) for line in found.episodes]
    if found.n_more:
        rows.append((f"... {found.n_more} more", *[""] * (len(COLUMNS) - 1)))
    reporting.say_table(COLUMNS, [*rows, _cells(found.total)])
    if found.free_rmse < math.inf and found.total.free < 1:
        reporting.say(f"root mean square error of the action where samples were free: {found.free_rmse:.4g}")
    if found.nupe is not None:
        reporting.say(f"these recordings carry the true policy: nUPE {found.nupe:.4g}")


def _cells(line: "Line") -> tuple[str, ...]:
    share = "nothing moves" if math.isnan(line.explained) else f"{line.explained:.2%}"
    angle = "" if math.isnan(line.angle) else f"{math.degrees(line.angle):.3g}°"
    return line.label, str(line.n_samples), f"{line.free:.2f}", f"{line.rmse:.4g}", angle, share
