"""`unconstrain fit`: from recordings to a policy, and by how much it beats ordinary regression."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from unconstrain.cli import comparing, constraining, models, outputs, recordings, reporting, stabilizing
from unconstrain.cli.command import command, in_words_of_program
from unconstrain.cli.declared import option
from unconstrain.errors import PolicyError
from unconstrain.progress import working
from unconstrain.recordings.columns import START

if TYPE_CHECKING:
    from unconstrain.demonstrations import Demonstrations
    from unconstrain.policies.base import Policy
    from unconstrain.recordings import Recordings


@command(
    short_help="Learn the policy behind recordings, and save it.",
    epilog="For example:\n\n\b\nunconstrain fit wipe.csv --state x,y,z --time t --episode run --out wipe.skops",
)
@recordings.recorded
@constraining.constraint
@models.model
@recordings.folds
@stabilizing.stable_at(
    'Make the policy end there: a state, "0.1,0.2", or "end", the mean of where episodes end. Actions are changed as '
    "little as that takes.",
    "Model",
)
@outputs.out("policy.skops", "Where the policy is saved.")
@outputs.figure("Draw recorded movement and learnt policy")
@outputs.overwrite
@option(
    "--resumable",
    is_flag=True,
    help="Keep the moments too: for learning on, and for rollout --stop-when-unsure.",
    section=outputs.SECTION,
)
@option(
    "--checkpoint",
    type=click.Path(path_type=Path),
    help="Read as a stream, note here how far it has come, and go on from there if the file exists.",
    section="More data than memory",
)
@option(
    "--cluster",
    metavar="ADDRESS",
    help='Read on a Dask cluster: the address of its scheduler, tcp://HOST:PORT, or "local".',
    section="More data than memory",
)
def fit(
    recorded: recordings.Recorded,
    constraint: Path | None,
    model: models.Model,
    folds: str | None,
    stable_at: list[float] | str | None,
    out: Path,
    figure: Path | None,
    overwrite: bool,
    resumable: bool,
    checkpoint: Path | None,
    cluster: str | None,
) -> None:
    """Learn the unconstrained policy behind recordings, and save it.

    FILES are recordings in text, NPZ, NPY, MATLAB, HDF5, C3D, XLSX or Parquet files, folders of Parquet files, ROS
    bags, or LeRobot datasets, here or at URIs such as s3://bucket/folder. What does not fit into memory, and what has a
    --checkpoint or a --cluster, is read as a stream: without a comparison with ordinary regression.
    """
    outputs.check_outputs(
        (*recorded.files, *(() if constraint is None else (constraint,))),
        {"out": out, "figure": figure},
        overwrite=overwrite,
        continued={"checkpoint": checkpoint},
    )
    if model.risk == "direct" and (recorded.tells_constraints or constraint is not None):
        raise PolicyError(
            "ordinary regression makes no use of constraints: leave out --risk direct, or else force=, free=, "
            "projections= and constraint="
        )
    if checkpoint is not None and cluster is not None:
        raise PolicyError("a cluster makes up for workers it loses: leave out checkpoint= or cluster=")
    needs_memory = {
        "--model auto": model.is_chosen,
        "figure=": figure,
        "folds=": folds,
        "constraint=": constraint,
        "stable_at=": stable_at,
    }
    named = [option for option, given in needs_memory.items() if given]
    is_stream = checkpoint is not None or cluster is not None
    if is_stream and named:
        raise PolicyError(
            f"{named[0]} needs all data in memory, and a stream is read block by block: leave it out"
        )
    with working("reading"):
        opened = recorded.open()
        demos = opened.load() if named or (not is_stream and opened.fits_in_memory) else None
    if demos is None:
        from unconstrain.policies.inferred import describe_inferred
        from unconstrain.scaling.summary import describe_fit

        policy = _fit_stream(opened, model, checkpoint, cluster)
        policy.recording_ = recorded.kept(opened)
        policy.state_names_ = list(opened.names[0])
        policy.save(out, resumable=resumable)
        recordings.describe_notes(opened.notes, *opened.names)
        reporting.say(describe_fit(policy))
        inferred = describe_inferred(policy)
        if inferred:
            reporting.say(in_words_of_program(inferred))
        reporting.say(
            "not compared with ordinary regression, as this was a stream: `unconstrain evaluate` compares both on "
            "recordings that were held back"
        )
        _suggest(out)
        return
    demos = constraining.tell(demos, constraint)
    recordings.describe(demos)
    comparison = comparing.compare(demos, model, folds)
    policy = comparison.policy
    policy.recording_ = recorded.kept(opened)
    policy.state_names_ = list(demos.state_names)
    if stable_at is not None:
        with working("making it end at the goal"):
            policy = stabilizing.stabilize(policy, stable_at, recorded.columns, demos)
    stable = None if stable_at is None else policy
    evaluation = comparing.evaluate(comparison, demos, recorded.options_used, stable=stable, label="saved")
    policy.determined_share_ = comparison.policy.determined_share_
    policy.save(out, resumable=resumable)
    if figure is not None:
        from unconstrain import plot
        from unconstrain.plot import figures

        plot.save(figures.draw_policy(policy, demos), figure)
    comparing.describe(comparison, evaluation)
    if stable_at is not None:
        stabilizing.describe(policy)
    if figure is not None:
        reporting.say(f"figure: {figure}")
    to = recorded.columns.relative_to
    _suggest(out, demos if evaluation.verdict.is_of_use else None, needs_goal=to is not None and to != START)


def _suggest(out: Path, demos: "Demonstrations | None" = None, *, needs_goal: bool = False) -> None:
    """Name the commands that come next; with the recordings, a start for a rollout."""
    reporting.say(f"policy: {out}")
    reporting.say("\nnext, on recordings the policy has not seen, or to see where it leads:")
    reporting.say(f"  unconstrain evaluate {reporting.shell_word(out)} OTHER_FILES...")
    if demos is not None and demos.space.n_actions == demos.actions.shape[1]:
        first, scales = demos.states[0], demos.states.std(axis=0)
        start = ",".join(reporting.shown_number(*pair) for pair in zip(first, scales, strict=True))
        # The start is one of those learnt from, so it is relative already, to a goal at the origin.
        goal = f' --goal="{",".join(f"{x:g}" for x in demos.space.origin)}"' if needs_goal else ""
        steps, dt = _find_steps(demos)
        reporting.say(
            f'  unconstrain rollout {reporting.shell_word(out)} --start="{start}"{goal} '
            f"--steps {steps} --dt {dt:g} --overwrite"
        )


def _find_steps(demos: "Demonstrations") -> tuple[int, float]:
    """Return how many steps the first episode takes, and how long they are (s)."""
    if demos.time is None:
        return 500, 0.02
    time = demos.time[demos.episodes == demos.episodes[0]]
    duration = float(time[-1] - time[0])
    if duration <= 0:
        return 500, 0.02
    dt = float(f"{duration / (len(time) - 1):.2g}")
    return max(1, round(duration / dt)), dt


def _fit_stream(
    opened: "Recordings", model: models.Model, checkpoint: Path | None, cluster: str | None
) -> "Policy":
    from unconstrain.scaling import cluster as distributed
    from unconstrain.scaling.stream import fit_stream

    if cluster is None:
        return fit_stream(model.build(), opened, checkpoint=checkpoint, progress=True)
    with distributed.connected(cluster) as client:
        return distributed.fit(model.build(), opened, client, progress=True)
