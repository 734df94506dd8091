"""Fits of more data than fit into memory: folders, object stores, LeRobot datasets; on one machine or a cluster."""

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from unconstrain.cli import reporting
from unconstrain.errors import PolicyError
from unconstrain.fitting.moments import Moments
from unconstrain.policies.base import Policy
from unconstrain.scaling import cluster as distributed
from unconstrain.scaling.stream import fit_stream

Checkpoint = Annotated[
    Path | None,
    typer.Option(
        "--checkpoint",
        help="Read as a stream, note here how far it has come, and go on from there if it exists.",
    ),
]
Cluster = Annotated[
    str | None,
    typer.Option(
        "--cluster",
        help='Read on a Dask cluster: its scheduler\'s address, or "local".',
        metavar="tcp://HOST:PORT",
    ),
]


def is_meant(files: list[str], checkpoint: Path | None, cluster: str | None, at_once: bool) -> bool:
    """Whether these are to be read as a stream: URIs are, and whatever needs a stream.

    So are folders, unless something is asked `at_once` that needs all data in memory.
    """
    streams = checkpoint is not None or cluster is not None or any("://" in name for name in files)
    return streams or (not at_once and any(Path(name).expanduser().is_dir() for name in files))


def learn(
    console: Console,
    policy: Policy | None,
    files: list[str],
    how: dict[str, Any],
    checkpoint: Path | None,
    cluster: str | None,
    **needs_memory: Any,
) -> Policy:
    """The policy, fitted in one pass; says what was learnt. `needs_memory` are the options that streams do not have."""
    given = [name for name, value in needs_memory.items() if value is not None]
    if policy is None or given:
        what = "--model auto" if policy is None else f"--{given[0].replace('_', '-')}"
        raise PolicyError(f"{what} needs all data in memory, and a stream is read once: leave it out")
    if checkpoint is not None and cluster is not None:
        raise PolicyError("a cluster makes up for workers it loses, so leave out --checkpoint, or --cluster")
    source = files[0] if len(files) == 1 else files
    try:
        if cluster is None:
            fit_stream(policy, source, **how, checkpoint=checkpoint, progress=True)
        else:
            with distributed.connected(cluster) as client:
                distributed.fit(policy, source, client, **how, progress=True)
    except KeyboardInterrupt as stop:
        if str(stop):
            Console(stderr=True).print(str(stop), soft_wrap=True, highlight=False)
        raise typer.Exit(reporting.INTERRUPTED) from None
    _describe(console, policy)
    return policy


def _describe(console: Console, policy: Policy) -> None:
    folds = getattr(policy, "folds_", None)
    episodes = f" in {len(folds.fold_of):,} episodes" if folds is not None else ""
    console.print(f"read: {policy.n_samples_seen_:,} samples{episodes}")
    if policy.risk == "auto":
        share = policy.n_known_constraints_ / policy.n_samples_seen_
        console.print(f"constraints: known of {share:.1%} of the samples")
    console.print(f"zero actions: {policy.n_zero_actions_:,} without a direction")
    if not hasattr(policy, "held_out_risk_"):
        return
    total = Moments.sum(part for part in policy.moments_ if part is not None)
    error = float(policy.held_out_risk_[policy.alphas_ == policy.alpha_][0])
    motion = float(total.squares.sum() / total.weight.sum())
    each = ", of the local models each by itself" if total.weight.ndim else ""
    explained = f", {1 - error / motion:.2%} of observed motion explained" if motion else ""
    console.print(f"λ: {policy.alpha_:.3g} (chosen by cross-validation)")
    console.print(f"held-out risk{each}: {error:.4g}{explained}")
