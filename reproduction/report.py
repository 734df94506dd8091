"""Every experiment on one page of Markdown, with its pictures."""

import os
import platform
from collections.abc import Mapping, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from urllib.parse import quote

from rich.console import Console

from reproduction.experiments import EXPERIMENTS, RECORDED, find_experiment
from reproduction.outcome import Outcome, make_folder, write_text
from reproduction.recordings import check_surfaces
from unconstrain.errors import UnconstrainError

INTRODUCTION = """\
# The paper, reproduced

Every experiment of Howard, Klanke, Gienger, Goerick, Vijayakumar, *A Novel Method for Learning Policies from
Constrained Motion*, ICRA 2009, and those that go beyond it. Published figures stand beside ours. Made by
`{command}`; trial k of an experiment has the seed k.
"""

PACKAGES = ("unconstrain", "numpy", "scipy", "scikit-learn", "mujoco", "mink")
"""Whose versions the page names."""


def reproduce_all(
    out: Path,
    *,
    trials: int | None,
    jobs: int,
    console: Console,
    recordings: Path | None = None,
    only: Sequence[str] = (),
) -> Path:
    """Run all experiments into folders of `out`, and write a page about them.

    An experiment that cannot run here, because an extra is not installed, is left out, and the page says so.

    Parameters
    ----------
    out : Path
        The folder to write into. Finished trials are kept there.
    trials : int, optional
        Data sets of each experiment; by default as many as published.
    jobs : int
        Processes.
    console : Console
        Where progress is shown.
    recordings : Path, optional
        The folder of the recorded surfaces, and perhaps of what else `adaptive` looks at.
    only : sequence of str
        Names of experiments to run; by default all.

    Returns
    -------
    Path
        Of `report.md`.

    Raises
    ------
    UnconstrainError
        If there is no such experiment or recording.
    """
    for name in only:
        find_experiment(name)
    check_surfaces(recordings)
    make_folder(out)
    outcomes, missing = [], {}
    for name in EXPERIMENTS:
        if only and name not in only:
            continue
        console.rule(name)
        options = {RECORDED[name]: recordings} if name in RECORDED else {}
        try:
            outcomes.append(
                find_experiment(name)(out / name, trials=trials, jobs=jobs, console=console, **options)
            )
        except UnconstrainError as error:
            console.print(f"{name} is left out: {error}")
            missing[name] = str(error)
    command = "python -m reproduction all"
    command += "".join(f" --only {name}" for name in only)
    command += "" if recordings is None else " --recordings FOLDER"
    command += "" if trials is None else f" --trials {trials}"
    return write_report(outcomes, missing, out, command)


def write_report(outcomes: Sequence[Outcome], missing: Mapping[str, str], out: Path, command: str) -> Path:
    """Write `report.md`, whose pictures are links, into the folder `out`, and return its path.

    Parameters
    ----------
    outcomes : sequence of Outcome
        In the order of the page.
    missing : mapping of str to str
        Why an experiment is left out, by its name.
    out : Path
        The folder.
    command : str
        That made the page.
    """
    page = [
        INTRODUCTION.format(command=command),
        *(_write_section(outcome, out) for outcome in outcomes),
        *(f"## {name}\n\nLeft out: {reason}\n" for name, reason in missing.items()),
        _list_versions(),
    ]
    return write_text(out / "report.md", "\n".join(page))


def _write_section(outcome: Outcome, out: Path) -> str:
    parts = [f"## {outcome.title}\n", outcome.table.strip() + "\n"]
    parts += [
        f"![{caption}]({_link(picture, out)})\n\n*{caption}*\n"
        for picture, caption in outcome.figures.items()
    ]
    for heading, sentences in (
        ("Found", outcome.findings),
        ("Chosen where the paper is silent", outcome.choices),
    ):
        if sentences:
            parts.append(f"**{heading}:**\n\n" + "".join(f"- {sentence}\n" for sentence in sentences))
    return "\n".join(parts)


def _list_versions() -> str:
    lines = [f"- Python {platform.python_version()} on {platform.machine()}, {os.cpu_count()} processors"]
    for package in PACKAGES:
        try:
            lines.append(f"- {package} {version(package)}")
        except PackageNotFoundError:
            lines.append(f"- {package} not installed")
    return "## Versions\n\n" + "\n".join(lines) + "\n"


def _link(picture: Path, out: Path) -> str:
    return quote(Path(os.path.relpath(picture, out)).as_posix())
