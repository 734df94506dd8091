"""`unconstrain view`: a policy and its recordings in the browser."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import click

from unconstrain.cli import constraining, outputs, recordings, reporting, trusting
from unconstrain.cli.command import command, in_words_of_program
from unconstrain.cli.declared import option
from unconstrain.progress import working

if TYPE_CHECKING:
    from unconstrain.demonstrations import Demonstrations
    from unconstrain.policies.base import Policy
    from unconstrain.viewer import Page

SECTION = "Page"
HOST, PORT = "127.0.0.1", 8080
"""Those of `viewer.server`, which is not imported before it is needed."""


@command(
    short_help="Look at a policy and its recordings in the browser.",
    epilog="For example:\n\n\b\nunconstrain view wipe.skops wipe.csv",
)
@click.argument("policy", type=click.Path(path_type=Path))
@recordings.recorded
@constraining.constraint
@option(
    "--shown",
    metavar="COLUMNS",
    help='Which two or three states are shown first, by name: "x,z". By default the first three.',
    section=SECTION,
)
@option(
    "--robot",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="The robot (MJCF or URDF) whose joints the states are: its hand is shown.",
    section=SECTION,
)
@option(
    "--site", metavar="FRAME", help="Which frame of the robot is shown; by default its last.", section=SECTION
)
@option(
    "--lock",
    multiple=True,
    metavar="JOINT",
    help="A joint of the robot that holds still, at 0. May be given several times.",
    section=SECTION,
)
@option(
    "--port",
    type=click.IntRange(0, 65535),
    metavar="NUMBER",
    default=PORT,
    show_default=True,
    help="The port of the page; 0 for any that is free.",
    section=SECTION,
)
@option(
    "--host",
    default=HOST,
    show_default=True,
    metavar="ADDRESS",
    help="Where the page can be opened: on this computer only, or with 0.0.0.0 by all that reach it.",
    section=SECTION,
)
@option(
    "--rerun",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Write a file for Rerun's viewer (.rrd) instead of serving the page; `rerun FILE` opens it.",
    section=outputs.SECTION,
)
@outputs.overwrite
@trusting.trusted
def view(
    policy: Path,
    recorded: recordings.Recorded,
    constraint: Path | None,
    shown: str | None,
    robot: Path | None,
    site: str | None,
    lock: tuple[str, ...],
    port: int,
    host: str,
    rerun: Path | None,
    overwrite: bool,
    trusted: tuple[str, ...],
) -> None:
    """Look at a policy in the browser, and drag the start of a rollout.

    POLICY was saved by `unconstrain fit`, and FILES are read as those it was learnt from, unless an option says
    otherwise. The page is served until Ctrl-C is pressed. With --constraint the rollout may be under it, too.
    """
    from unconstrain.constraints.learnt import load_constraint
    from unconstrain.viewer import server
    from unconstrain.viewer import view as open_page

    if rerun is None:
        server.check_port(host, port)  # before minutes of reading
    else:
        page_only = {"robot": robot, "site": site, "lock": lock}
        _check_rerun(rerun, policy, recorded, page_only, overwrite=overwrite)
    learnt = trusting.load(policy, trusted)
    with working("reading"):
        recorded = recorded.like(getattr(learnt, "recording_", None))
        demos = constraining.tell(recorded.load(), constraint)
    recordings.describe(demos)
    recorded.check_names(learnt, demos)
    coordinates = None if shown is None else _positions(shown, demos.state_names)
    if rerun is not None:
        _write_rerun(learnt, demos, rerun, coordinates)
        return
    with working("drawing"):
        page = open_page(
            learnt,
            demos,
            coordinates=coordinates,
            robot=robot,
            site=site,
            lock=lock,
            constraint=None if constraint is None else load_constraint(constraint).rows,
            host=host,
            port=port,
        )
    for note in page.notes:
        reporting.say(f"note: {in_words_of_program(note)}")
    try:
        _say_where(page, host)
        page.wait()
    except KeyboardInterrupt:  # before it waits for one
        page.close()


def _check_rerun(
    rerun: Path,
    policy: Path,
    recorded: recordings.Recorded,
    page_only: Mapping[str, object],
    *,
    overwrite: bool,
) -> None:
    from unconstrain.errors import DataError
    from unconstrain.viewer.rerun_log import check_suffix, import_rerun

    check_suffix(rerun)
    for name in (name for name, given in page_only.items() if given):
        raise DataError(
            f"{name}= is for the page, and rerun= writes states as they are: leave one of them out"
        )
    outputs.check_outputs([policy, *recorded.files], {"rerun": rerun}, overwrite=overwrite)
    import_rerun()


def _write_rerun(
    learnt: "Policy", demos: "Demonstrations", path: Path, coordinates: list[int] | None
) -> None:
    from unconstrain.viewer import log_rerun

    with working("writing"):
        notes = log_rerun(learnt, demos, path, coordinates=coordinates, overwrite=True)
    for note in notes:
        reporting.say(f"note: {in_words_of_program(note)}")
    reporting.say(f"for Rerun's viewer: {path}")


def _positions(text: str, names: tuple[str, ...]) -> list[int]:
    from unconstrain.errors import DataError

    wanted = [name.strip() for name in text.split(",")]
    unknown = [name for name in wanted if name not in names]
    if unknown:
        raise DataError(f"there is no state {', '.join(unknown)} for shown=: there are {', '.join(names)}")
    if len(set(wanted)) < len(wanted) or len(wanted) > 3:
        raise DataError(
            f"shown= is two or three different states, not {text!r}: there are {', '.join(names)}"
        )
    return [names.index(name) for name in wanted]


def _say_where(page: "Page", host: str) -> None:
    port = page.stage.server.get_port()
    reporting.say(f"page: {page.url}")
    if host == HOST:
        reporting.say(
            f"from another computer: ssh -L {port}:localhost:{port} this-computer, then open http://localhost:{port}"
        )
    reporting.say("Ctrl-C ends it")
