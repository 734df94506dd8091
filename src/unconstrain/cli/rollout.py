"""`unconstrain rollout`: where a policy leads, free or with something in the way."""

from pathlib import Path
from typing import Annotated

import numpy as np
import pyarrow as pa
import pyarrow.csv
import typer

from unconstrain import atomic, plot
from unconstrain.cli import recordings, reporting
from unconstrain.errors import DataError
from unconstrain.fitting.posterior import Unsure
from unconstrain.policies import load_policy
from unconstrain.simulation import rollout as integrate


def rollout(
    policy: Annotated[Path, typer.Argument(help="A policy saved by `unconstrain fit`.", metavar="POLICY")],
    start: Annotated[
        str, typer.Option("--start", help='Where to start, one number a state: --start="0.1,-0.2".')
    ],
    steps: Annotated[int, typer.Option("--steps", help="How many steps.")] = 500,
    dt: Annotated[float, typer.Option("--dt", help="Seconds a step.")] = 0.02,
    block: Annotated[
        list[str] | None,
        typer.Option(
            "--block", help='A row of the constraint A, A u = 0: --block="1,0,0". May be given several times.'
        ),
    ] = None,
    out: Annotated[Path, typer.Option("--out", help="Where the movement is written (CSV).")] = Path(
        "rollout.csv"
    ),
    stop_when_unsure: Annotated[
        float | None,
        typer.Option(
            "--stop-when-unsure",
            help="End where the policy's standard deviation exceeds this share of its speed: 0.5, say.",
        ),
    ] = None,
    figure: Annotated[Path, typer.Option("--figure", help="Where it is drawn (PNG, SVG, PDF).")] = Path(
        "rollout.png"
    ),
) -> None:
    """Integrate a saved policy from a start, free or under a constraint."""
    recordings.check_writable(out, figure)
    plot.check_suffix(figure)
    learnt = load_policy(policy)
    rows = np.array([_numbers(row, "--block", learnt.n_actions_) for row in block]) if block else None
    unsure = None if stop_when_unsure is None else Unsure(learnt, stop_when_unsure)
    begin = _numbers(start, "--start", learnt.n_features_in_)
    movement = integrate(learnt, begin, steps, dt, rows, stop_when=unsure)
    taken = len(movement) - 1
    if unsure is not None and taken == 0:
        raise DataError(
            f"at the start already {_unsure_at(unsure, movement.states[0])}: start nearer to the recordings, or give a "
            "larger share to --stop-when-unsure"
        )

    names = _names(learnt)
    columns = {"t": movement.time}
    columns |= {name: movement.states[:, i] for i, name in enumerate(names)}
    columns |= {f"{name}_velocity": movement.actions[:, i] for i, name in enumerate(names)}
    with atomic.replacing(out) as temporary:
        pyarrow.csv.write_csv(pa.table(columns), temporary)
    plot.save(plot.rollout_figure(movement, names), figure)
    console = reporting.console()
    end = ", ".join(f"{name} {value:.4g}" for name, value in zip(names, movement.states[-1], strict=True))
    console.print(f"after {taken * dt:g} s: {end}")
    if unsure is not None and taken < steps:
        console.print(f"stopped after {taken} of {steps} steps: {_unsure_at(unsure, movement.states[-1])}")
    console.print(f"movement: {out}\nfigure: {figure}")


def _unsure_at(unsure: Unsure, state: np.ndarray) -> str:
    deviation, speed = unsure.measure(state[None])
    known = f"±{deviation[0]:.3g}"
    return (
        f"the policy is known to within {known} only, more than {unsure.share:g} of its speed, {speed[0]:.3g}"
    )


def _numbers(text: str, option: str, wanted: int) -> np.ndarray:
    try:
        numbers = np.array([float(part) for part in text.split(",")])
    except ValueError:
        raise DataError(f"{option} must be numbers separated by commas, got {text!r}") from None
    if len(numbers) != wanted:
        raise DataError(f"{option} must have {wanted} numbers for this policy, got {len(numbers)}: {text}")
    return numbers


def _names(policy) -> list[str]:
    """The states' names where the recordings had them and they tell columns apart, else x1, x2, ..."""
    known = getattr(policy, "state_names_", None) or getattr(policy, "recording_", {}).get("state") or []
    distinct = {"t", *known, *(f"{name}_velocity" for name in known)}
    named = len(known) == policy.n_features_in_ and all(isinstance(name, str) for name in known)
    if named and len(distinct) == 2 * len(known) + 1:
        return list(known)
    return [f"x{i + 1}" for i in range(policy.n_features_in_)]
