"""`unconstrain rollout`: where a policy leads, free or under a constraint."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from unconstrain.cli import outputs, reporting
from unconstrain.cli.command import command
from unconstrain.cli.declared import Number, Numbers
from unconstrain.errors import DataError
from unconstrain.progress import working

if TYPE_CHECKING:
    import numpy as np

    from unconstrain.policies.unsure import Unsure


@command(
    short_help="Follow a saved policy from a start.",
    epilog='For example:\n\n\b\nunconstrain rollout wipe.skops --start="0.1,0.2,0.3" --block="0,0,1"',
)
@click.argument("policy", type=click.Path(path_type=Path))
@click.option(
    "--start", type=Numbers(), required=True, help='Where to start, one number a state: --start="0.1,-0.2".'
)
@click.option(
    "--steps",
    type=click.IntRange(min=1),
    metavar="NUMBER",
    default=500,
    show_default=True,
    help="How many steps.",
)
@click.option("--dt", type=Number(), default=0.02, show_default=True, help="Seconds a step.")
@click.option(
    "--block",
    type=Numbers(),
    multiple=True,
    help='A row of the constraint A, A u = 0: --block="1,0,0". May be given several times.',
)
@click.option(
    "--stop-when-unsure",
    type=Number(),
    help="End where the policy's standard deviation exceeds this share of its speed: 0.5, say.",
)
@outputs.out("rollout.csv", "Where the movement is written (CSV).")
@outputs.figure("Where it is drawn", "rollout.png")
@outputs.overwrite
def rollout(
    policy: Path,
    start: list[float],
    steps: int,
    dt: float,
    block: tuple[list[float], ...],
    stop_when_unsure: float | None,
    out: Path,
    figure: Path,
    overwrite: bool,
) -> None:
    """Integrate a saved policy from a start, free or under a constraint.

    POLICY was saved by `unconstrain fit`.
    """
    outputs.check_outputs([policy], {"out": out, "figure": figure}, overwrite=overwrite)
    from unconstrain import plot
    from unconstrain.policies import load_policy
    from unconstrain.policies.unsure import Unsure
    from unconstrain.recordings.text import write_csv
    from unconstrain.simulation import rollout as integrate

    learnt = load_policy(policy)
    _check_length(start, "start=", learnt.n_features_in_, "states")
    for row in block:
        _check_length(row, "block=", learnt.n_actions_, "actions")
    unsure = None if stop_when_unsure is None else Unsure(learnt, stop_when_unsure)
    with working("rolling out"):
        movement = integrate(learnt, start, steps, dt, list(block) or None, stop_when=unsure)
    taken = len(movement) - 1
    if unsure is not None and taken == 0:
        raise DataError(
            f"at the start already {_unsure_at(unsure, movement.states[0])}: start nearer to the recordings, or give a "
            "larger share to stop_when_unsure="
        )
    write_csv(movement, out)
    plot.save(plot.rollout_figure(movement), figure)
    end = zip(movement.state_names, movement.states[-1], movement.states.std(axis=0), strict=True)
    reached = ", ".join(f"{name} {reporting.shown_number(value, scale)}" for name, value, scale in end)
    reporting.say(f"after {taken * dt:g} s: {reached}")
    if unsure is not None and taken < steps:
        reporting.say(f"stopped after {taken} of {steps} steps: {_unsure_at(unsure, movement.states[-1])}")
    reporting.say(f"movement: {out}\nfigure: {figure}")


def _check_length(numbers: list[float], option: str, wanted: int, of: str) -> None:
    if len(numbers) != wanted:
        raise DataError(f"{option} must have {wanted} numbers, as the policy has {of}, got {len(numbers)}")


def _unsure_at(unsure: "Unsure", state: "np.ndarray") -> str:
    deviation, speed = unsure.measure(state[None])
    return (
        f"the policy is known to within ±{deviation[0]:.3g} only, more than {unsure.share:g} of its speed, "
        f"{speed[0]:.3g}"
    )
