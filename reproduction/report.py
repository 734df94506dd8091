"""Every experiment on one page: Markdown, and HTML with its pictures inside."""

import base64
import os
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from urllib.parse import quote

from markdown_it import MarkdownIt
from rich.console import Console

from reproduction import EXPERIMENTS, experiment
from reproduction.outcome import Outcome
from unconstrain import atomic
from unconstrain.errors import UnconstrainError

INTRODUCTION = """\
# The paper, reproduced

Every experiment of Howard, Klanke, Gienger, Goerick, Vijayakumar, *A Novel Method for Learning Policies from
Constrained Motion*, ICRA 2009, and those that go beyond it. Published figures stand beside ours. Made by
`{command}`; trial k of an experiment has the seed k.
"""

STYLE = """\
body { max-width: 60rem; margin: 2rem auto; padding: 0 1rem; font: 16px/1.5 system-ui, sans-serif; color: #222 }
table { border-collapse: collapse; margin: 1rem 0; font-size: 14px } img { max-width: 100% }
th, td { border-bottom: 1px solid #ddd; padding: .25rem .75rem; text-align: right } th:first-child, td:first-child
{ text-align: left } code { background: #f4f4f4 } figure { margin: 1rem 0 } figcaption { color: #555 }
"""

PACKAGES = ("unconstrain", "numpy", "scipy", "scikit-learn", "mujoco", "mink")


def reproduce_all(out: Path, *, trials: int | None, jobs: int, console: Console) -> list[Outcome]:
    """Run all experiments into folders of `out`, then write `report.md` and `report.html` there.

    An experiment that cannot run here (an extra is not installed) is left out, and the page says so.
    """
    outcomes, missing = [], {}
    for name in EXPERIMENTS:
        console.rule(name)
        try:
            outcomes.append(experiment(name).reproduce(out / name, trials=trials, jobs=jobs, console=console))
        except UnconstrainError as error:
            console.print(f"{name} is left out: {error}")
            missing[name] = str(error)
    command = "unconstrain reproduce all" + ("" if trials is None else f" --trials {trials}")
    write(outcomes, missing, out, command)
    return outcomes


def write(outcomes: list[Outcome], missing: dict[str, str], out: Path, command: str) -> None:
    """Write `report.md`, whose pictures are links, and `report.html`, which stands alone, into the folder `out`."""
    page = "\n".join(
        [
            INTRODUCTION.format(command=command),
            *(_section(outcome, out) for outcome in outcomes),
            *(f"## {name}\n\nLeft out: {reason}\n" for name, reason in missing.items()),
            _versions(),
        ]
    )
    body = MarkdownIt("commonmark").enable("table").render(page)
    for outcome in outcomes:
        for picture in outcome.figures:
            data = base64.b64encode(picture.read_bytes()).decode()
            body = body.replace(f'src="{_link(picture, out)}"', f'src="data:image/png;base64,{data}"')
    html = (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>unconstrain: the paper, reproduced</title>\
<meta name="viewport" content="width=device-width"><style>{STYLE}</style><body>{body}</body></html>\n'
    )
    for name, text in (("report.md", page), ("report.html", html)):
        with atomic.replacing(out / name) as temporary:
            temporary.write_text(text, encoding="utf-8")


def _section(outcome: Outcome, out: Path) -> str:
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


def _versions() -> str:
    lines = [f"- Python {platform.python_version()} on {platform.machine()}, {os.cpu_count()} processors"]
    for package in PACKAGES:
        try:
            lines.append(f"- {package} {version(package)}")
        except PackageNotFoundError:
            lines.append(f"- {package} not installed")
    return "## Versions\n\n" + "\n".join(lines) + "\n"


def _link(picture: Path, out: Path) -> str:
    return quote(Path(os.path.relpath(picture, out)).as_posix())
