"""`unconstrain fit`: from recordings to a policy, and by how much it beats ordinary regression."""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.table import Table
from sklearn.base import clone

from unconstrain import comparison, figures
from unconstrain.cli import models, recordings, reporting
from unconstrain.cli.recordings import (
    Action,
    Episode,
    Files,
    Gap,
    MaxSpeed,
    MinDuration,
    MinSpeed,
    State,
    Time,
    Window,
)
from unconstrain.cli.recordings import TimeUnit as Unit
from unconstrain.cli.reporting import quoted
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError, PolicyError
from unconstrain.identifiability import identifiability
from unconstrain.policies.base import Policy
from unconstrain.validation import check_choice

WORTH_A_WARNING = 0.1
"""Share of the policy that recordings leave undetermined."""

BLOCKS = 5
FOLDS = ("episodes", "blocks")

Model = Annotated[str, typer.Option("--model", help=f"One of {', '.join(models.MODELS)}.")]
Out = Annotated[Path, typer.Option("--out", help="Where the policy is saved.")]
Risk = Annotated[str, typer.Option("--risk", help="inconsistency, or direct for ordinary regression.")]
Alpha = Annotated[str, typer.Option("--alpha", help='Weight decay λ: a number, or "cv" to choose it.')]
Centers = Annotated[
    str | None, typer.Option("--centers", help="kmeans, grid or coverage, for models with centres.")
]
NCenters = Annotated[int | None, typer.Option("--n-centers", help="How many centres.")]
Width = Annotated[
    float | None, typer.Option("--width", help="σ of the receptive fields, in the states' unit.")
]
Folds = Annotated[
    str | None,
    typer.Option(
        "--folds", help="What is held out: whole episodes, or blocks of each. Default: episodes, if several."
    ),
]
Figure = Annotated[
    Path | None, typer.Option("--figure", help="Draw recorded movement and learnt policy (PNG, SVG, PDF).")
]


def fit(
    files: Files,
    state: State = None,
    action: Action = None,
    time: Time = None,
    episode: Episode = None,
    model: Model = "locally-linear",
    out: Out = Path("policy.skops"),
    figure: Figure = None,
    risk: Risk = "inconsistency",
    alpha: Alpha = "cv",
    centers: Centers = None,
    n_centers: NCenters = None,
    width: Width = None,
    folds: Folds = None,
    time_unit: Unit = None,
    window: Window = None,
    gap: Gap = None,
    max_speed: MaxSpeed = None,
    min_speed: MinSpeed = None,
    min_duration: MinDuration = None,
) -> None:
    """Learn the unconstrained policy behind recordings, and save it.

    `unconstrain fit wipe.csv --state x,y,z --time t --episode run --out wipe.skops`
    """
    recordings.check_writable(out, figure)
    figures.check_suffix(figure)
    check_choice(model, "--model", models.MODELS)
    check_choice(risk, "--risk", ("inconsistency", "direct"))
    if folds is not None:
        check_choice(folds, "--folds", FOLDS)
    how = recordings.asked(
        state,
        action,
        time,
        episode,
        time_unit=time_unit,
        window=window,
        gap=gap,
        max_speed=max_speed,
        min_speed=min_speed,
        min_duration=min_duration,
    )
    named = _candidates(
        model, risk=risk, alpha=models.decay(alpha), centers=centers, n_centers=n_centers, width=width
    )
    console = reporting.console()
    with console.status("reading"):
        demos = recordings.read(files, how)
    describe(console, demos)
    groups = folds_of(demos, folds)

    chosen, table = _compare(console, demos, groups, model, named, risk)
    policy = table.policies[chosen]
    policy.recording_ = how
    console.print(
        f"zero actions: {policy.n_zero_actions_} without a direction, left out by the inconsistency"
    )
    console.print(
        f"λ: {policy.alpha_:.3g}" + (" (chosen by cross-validation)" if policy.alpha == "cv" else "")
    )
    _report(console, table, policy.risk)
    undetermined = 1.0 - identifiability(policy, demos.states, demos.actions).determined_share
    if undetermined >= WORTH_A_WARNING:
        console.print(
            f"warning: {undetermined:.0%} of the policy is not determined by these recordings; `unconstrain diagnose` "
            "says where, and what to record next",
            soft_wrap=True,
        )
    if figure is not None:
        figures.save(figures.learned_field(demos, policy), figure)
        console.print(f"figure: {figure}")
    policy.save(out)
    console.print(f"policy: {out}")
    start = ",".join(f"{value:.3g}" for value in demos.states[0])
    console.print("\nnext, on recordings the policy has not seen, or to see where it leads:")
    console.print(f"  unconstrain evaluate {quoted(out)} OTHER_FILES...")
    if demos.states.shape[1] == demos.actions.shape[1]:
        console.print(
            f'  unconstrain rollout {quoted(out)} --start="{start}" --steps 500 --dt 0.02',
        )


def describe(console: Console, demos: Demonstrations) -> None:
    """Say what was read: samples, episodes, and what the reader did to them."""
    console.print(
        f"read: {len(demos)} samples, {demos.n_episodes} episode{'s' if demos.n_episodes != 1 else ''}, "
        f"states {', '.join(demos.state_names)}, actions {', '.join(demos.action_names)}"
    )
    for note in demos.notes:
        console.print(f"note: {note}")


def _candidates(model: str, **options) -> dict[str, Policy] | None:
    """The model by name; None for "auto", whose candidates depend on the data."""
    if model != "auto":
        return {model: models.build(model, **options)}
    given = [name for name in ("centers", "n_centers", "width") if options[name] is not None]
    if given or options["alpha"] != "cv" or options["risk"] != "inconsistency":
        raise PolicyError(
            "--model auto makes its own choices: leave out --risk, --alpha, --centers, --n-centers, --width"
        )
    return None


def folds_of(demos: Demonstrations, folds: str | None) -> np.ndarray:
    """Episodes to be held out together, or blocks of each."""
    folds = folds or ("episodes" if demos.n_episodes > 1 else "blocks")
    check_choice(folds, "--folds", FOLDS)
    if folds == "episodes" and demos.n_episodes < 2:
        raise DataError("there is one episode, and none is left when it is held out: use --folds blocks")
    return demos.episodes if folds == "episodes" else demos.blocks(BLOCKS)


def _compare(console, demos, groups, model, named, risk) -> tuple[str, comparison.Selection]:
    """The name of the policy asked for, and the comparison that holds it next to the other risk's."""
    data = (demos.states, demos.actions, groups)
    with console.status("fitting") as status:

        def progress(row: comparison.Row) -> None:
            status.update(f"fitted {row.name} in {row.seconds:.1f} s")

        if named is None:
            found = comparison.select_policy("auto", *data, progress=progress)
            console.print(str(found.table))
            model, named = found.name, {found.name: found.policy}
        other = "direct" if risk == "inconsistency" else "inconsistency"
        pair = {
            f"{model}, {risk}": clone(named[model]),
            f"{model}, {other}": clone(named[model]).set_params(risk=other),
        }
        result = comparison.select_policy(pair, *data, progress=progress)
    asked = f"{model}, {risk}"
    if result.table[asked].problem:
        raise PolicyError(str(result.table[asked].problem))
    return asked, result


def _report(console: Console, result: comparison.Selection, kept: str) -> None:
    table = Table("learnt by", "held-out inconsistency", "share of observed motion explained")
    for row in sorted(result.table, key=lambda row: row.name.endswith("direct")):
        name = row.name.split(", ")[-1] + (" (saved)" if row.name.endswith(kept) else "")
        table.add_row(name, f"{row.inconsistency:.4g}", f"{row.explained:.2%}")
    console.print(table)
