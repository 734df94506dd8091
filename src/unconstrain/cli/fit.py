"""`unconstrain fit`: from recordings to a policy, and by how much it beats ordinary regression."""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.table import Table
from sklearn.base import clone

from unconstrain import plot
from unconstrain import selection as comparison
from unconstrain.arrays import check_choice
from unconstrain.cli import models, recordings, reporting, streams
from unconstrain.cli.reporting import quoted
from unconstrain.constraints import from_recording
from unconstrain.demonstrations import Demonstrations
from unconstrain.diagnostics import identifiability
from unconstrain.errors import DataError, PolicyError
from unconstrain.fitting.observation import unknown
from unconstrain.policies.base import Policy

WORTH_A_WARNING = 0.1
"""Share of the policy that recordings leave undetermined."""

Model = Annotated[str, typer.Option("--model", help=f"One of {', '.join(models.MODELS)}.")]
Out = Annotated[Path, typer.Option("--out", help="Where the policy is saved.")]
Risk = Annotated[str, typer.Option("--risk", help="inconsistency, or direct for ordinary regression.")]
Figure = Annotated[
    Path | None, typer.Option("--figure", help="Draw recorded movement and learnt policy (PNG, SVG, PDF).")
]


def fit(
    context: typer.Context,
    files: recordings.Files,
    state: recordings.State = None,
    action: recordings.Action = None,
    time: recordings.Time = None,
    episode: recordings.Episode = None,
    model: Model = "locally-linear",
    out: Out = Path("policy.skops"),
    figure: Figure = None,
    risk: Risk = "inconsistency",
    alpha: models.Alpha = "cv",
    centers: models.Centers = None,
    n_centers: models.NCenters = None,
    width: models.Width = None,
    folds: recordings.Folds = None,
    force: recordings.Force = None,
    force_threshold: recordings.ForceThreshold = None,
    free: recordings.Free = None,
    time_unit: recordings.TimeUnit = None,
    window: recordings.Window = None,
    gap: recordings.Gap = None,
    max_speed: recordings.MaxSpeed = None,
    min_speed: recordings.MinSpeed = None,
    min_duration: recordings.MinDuration = None,
    checkpoint: streams.Checkpoint = None,
    cluster: streams.Cluster = None,
    resumable: Annotated[
        bool,
        typer.Option(
            "--resumable", help="Keep the moments too: for learning on, and for rollout --stop-when-unsure."
        ),
    ] = False,
) -> None:
    """Learn the unconstrained policy behind recordings, and save it.

    `unconstrain fit wipe.csv --state x,y,z --time t --episode run --out wipe.skops`
    """
    recordings.check_writable(out, figure)
    plot.check_suffix(figure)
    check_choice(model, "--model", models.MODELS)
    check_choice(risk, "--risk", ("inconsistency", "direct"))
    if folds is not None:
        check_choice(folds, "--folds", recordings.FOLDS)
    _check_known(force, force_threshold, free, risk)
    how, told = recordings.asked(context.params), recordings.told(context.params)
    named = _candidates(
        model, risk=risk, alpha=models.decay(alpha), centers=centers, n_centers=n_centers, width=width
    )
    if told:
        risk = "auto"
        named = named and {name: policy.set_params(risk=risk) for name, policy in named.items()}
    console = reporting.console()
    needs_memory = {"figure": figure, "folds": folds, "min_speed": min_speed}
    at_once = named is None or any(value is not None for value in needs_memory.values())
    if streams.is_meant(files, checkpoint, cluster, at_once):
        if force_threshold is not None:
            told["force_threshold"] = force_threshold
        streamed = streams.learn(
            console, named[model] if named else None, files, how | told, checkpoint, cluster, **needs_memory
        )
        streamed.recording_ = how
        streamed.save(out, resumable=resumable)
        _point_on(console, out)
        return
    with console.status("reading"):
        demos = recordings.read(files, how | told)
    recordings.describe(console, demos)
    groups = recordings.folds_of(demos, folds)
    known = None
    if told:
        known = from_recording(demos, force_threshold=force_threshold)
        _describe_known(console, known)

    chosen, found = _compare(console, demos, groups, model, named, risk, known)
    policy = found.policies[chosen]
    policy.recording_ = how
    policy.state_names_ = list(demos.state_names)
    console.print(
        f"zero actions: {policy.n_zero_actions_} without a direction, left out by the inconsistency"
    )
    console.print(
        f"λ: {policy.alpha_:.3g}" + (" (chosen by cross-validation)" if policy.alpha == "cv" else "")
    )
    _report(console, found, policy.risk)
    undetermined = (
        1.0 - identifiability(policy, demos.states, demos.actions, projections=known).determined_share
    )
    if undetermined >= WORTH_A_WARNING:
        console.print(
            f"warning: {undetermined:.0%} of the policy is not determined by these recordings; `unconstrain diagnose` "
            "says where, and what to record next",
            soft_wrap=True,
        )
    if figure is not None:
        plot.save(plot.policy_figure(policy, demos), figure)
        console.print(f"figure: {figure}")
    policy.save(out, resumable=resumable)
    _point_on(console, out)
    start = ",".join(f"{value:.3g}" for value in demos.states[0])
    if demos.states.shape[1] == demos.actions.shape[1]:
        console.print(
            f'  unconstrain rollout {quoted(out)} --start="{start}" --steps 500 --dt 0.02',
        )


def _point_on(console: Console, out: Path) -> None:
    console.print(f"policy: {out}")
    console.print("\nnext, on recordings the policy has not seen, or to see where it leads:")
    console.print(f"  unconstrain evaluate {quoted(out)} OTHER_FILES...")


def _candidates(model: str, **options) -> dict[str, Policy] | None:
    """The model by its name; None for "auto", whose candidates depend on the data."""
    if model != "auto":
        return {model: models.build(model, **options)}
    given = [name for name in ("centers", "n_centers", "width") if options[name] is not None]
    if given or options["alpha"] != "cv" or options["risk"] != "inconsistency":
        raise PolicyError(
            "--model auto makes its own choices: leave out --risk, --alpha, --centers, --n-centers, --width"
        )
    return None


def _check_known(force: str | None, threshold: float | None, free: str | None, risk: str) -> None:
    if force is not None and threshold is None:
        raise DataError(
            "--force needs --force-threshold, above which a force is a contact, in the forces' unit"
        )
    if threshold is not None and force is None:
        raise DataError("--force-threshold is for forces: name their columns with --force")
    if risk == "direct" and (force is not None or free is not None):
        raise PolicyError(
            "ordinary regression makes no use of constraints: leave out --risk direct, or --force and --free"
        )


def _describe_known(console: Console, N: np.ndarray) -> None:
    """Say of how many samples the constraint is known."""
    hidden, free = unknown(N), (np.eye(N.shape[1]) == N).all(axis=(1, 2))
    console.print(
        f"constraints: known of {np.mean(~hidden):.1%} of the samples ({np.mean(~hidden & ~free):.1%} in contact, "
        f"{np.mean(free):.1%} free), not of {np.mean(hidden):.1%}"
    )


def _compare(
    console: Console,
    demos: Demonstrations,
    groups: np.ndarray,
    model: str,
    named: dict[str, Policy] | None,
    risk: str,
    known: np.ndarray | None,
) -> tuple[str, comparison.Selection]:
    """The name of the policy asked for, and the comparison that holds it next to the other risk's.

    named: the model by its name, or None for a choice of models; known: projections (N, d, d), NaN where not known.
    """
    data = (demos.states, demos.actions, groups)
    with console.status("fitting") as status:

        def progress(row: comparison.Row) -> None:
            status.update(f"fitted {row.name} in {row.seconds:.1f} s")

        if named is None:
            found = comparison.select_policy("auto", *data, projections=known, progress=progress)
            console.print(str(found.table))
            model, named = found.name, {found.name: found.policy}
        other = "inconsistency" if risk in ("direct", "auto") else "direct"
        pair = {
            f"{model}, {risk}": clone(named[model]),
            f"{model}, {other}": clone(named[model]).set_params(risk=other),
        }
        result = comparison.select_policy(pair, *data, projections=known, progress=progress)
    asked = f"{model}, {risk}"
    if result.table[asked].problem:
        raise PolicyError(str(result.table[asked].problem))
    return asked, result


def _report(console: Console, result: comparison.Selection, kept: str) -> None:
    table = Table("learnt by", result.table.measure, "share of observed motion explained")
    for row in sorted(result.table, key=lambda row: row.name.endswith("direct")):
        name = row.name.split(", ")[-1] + (" (saved)" if row.name.endswith(kept) else "")
        table.add_row(name, f"{row.inconsistency:.4g}", f"{row.explained:.2%}")
    console.print(table)
