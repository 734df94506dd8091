"""`unconstrain convert`: recordings of any format as one Parquet file, or as a LeRobot dataset."""

from pathlib import Path

import click

from unconstrain import atomic
from unconstrain.cli import outputs, recordings, reporting
from unconstrain.cli.command import command
from unconstrain.cli.declared import Number, option
from unconstrain.errors import DataError
from unconstrain.progress import working

FILES = (".parquet", ".pq", ".npz")


@command(
    short_help="Write recordings as Parquet or as a LeRobot dataset.",
    epilog="For example:\n\n\b\nunconstrain convert wipe.csv --state x,y,z --time t --episode run --out wipe.parquet",
)
@recordings.recorded
@option(
    "--out",
    type=click.Path(path_type=Path),
    required=True,
    help="Where it is written: a name that ends in .parquet or .npz, or a folder for a LeRobot dataset.",
    section=outputs.SECTION,
)
@option(
    "--fps",
    type=Number(),
    help="Samples a second of the LeRobot dataset, to which states and actions are interpolated. By default the rate "
    "that the samples have, if it is even and a whole number.",
    section=outputs.SECTION,
)
@outputs.overwrite
def convert(recorded: recordings.Recorded, out: Path, fps: float | None, overwrite: bool) -> None:
    """Write recordings of any format as one Parquet file, or as a LeRobot dataset.

    FILES are read as `unconstrain fit` reads them. A Parquet or NPZ file holds all of it and knows its columns, so that
    no option is needed to read it. A folder becomes a LeRobot dataset of version 3.0: states, actions (velocities),
    times, episodes, one task, and statistics of the whole; not written are statistics of each episode, forces, flags,
    projections and notes.
    """
    out = atomic.as_path(out)
    is_file = out.suffix.lower() in FILES
    if not is_file and out.suffix and not out.is_dir():
        raise DataError(
            f"{out} is neither a folder nor a name that ends in .parquet or .npz: choose another name with out="
        )
    if is_file and fps is not None:
        raise DataError("fps= is for LeRobot datasets: leave it out, or name a folder with out=")
    from unconstrain.recordings import lerobot_dataset

    if is_file:
        outputs.check_outputs(recorded.files, {"out": out}, overwrite=overwrite)
    else:
        outputs.check_apart(recorded.files, out)
        lerobot_dataset.check_folder(out, overwrite=overwrite)
    with working("reading"):
        demos = recorded.load()
    recordings.describe(demos)
    if is_file:
        with working("writing"):
            demos.save(out)
        reporting.say(f"written: {out}")
    else:
        with working("writing"):
            written = lerobot_dataset.write_lerobot(demos, out, fps=fps, overwrite=overwrite)
        told = f"{len(written)} samples, {written.n_episodes} episode{'' if written.n_episodes == 1 else 's'}"
        reporting.say(f"written: {out}, a LeRobot dataset of {told}")
    reporting.say(f"\nnext:\n  unconstrain fit {reporting.shell_word(out)}")
