"""No link of the documentation is dead, and every command and name in it exists."""

import re
import shlex
from pathlib import Path
from urllib.parse import unquote

import click
import pytest

import unconstrain as uc
from benchmarks.__main__ import BENCHMARKS, TABLES
from reproduction.program import program as reproduction
from unconstrain.cli.app import program

ROOT = Path(__file__).parents[2]
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
each = pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))


def anchors(page):
    """What a heading of the page can be linked by."""
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    titles = re.findall(r"^#+ (.+)$", text, flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


@each
def test_no_link_is_dead(page):
    for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8")):
        if re.match(r"[a-z]+:", target):
            continue
        path, _, anchor = target.partition("#")
        place = page.parent / unquote(path) if path else page
        assert place.exists(), f"{page.name} links to {target}"
        if anchor:
            assert anchor in anchors(place), f"{page.name} links to {target}"


def documented_commands(text):
    """The commands of indented and fenced blocks and of inline code, with what they are given."""
    code = re.findall(r"^```\w*\n(.*?)^```", text, flags=re.DOTALL | re.MULTILINE)
    code += re.findall(r"^    \S.*$(?:\n^    \s*\S.*$)*", text, flags=re.MULTILINE)
    code += [" ".join(inline.split()) for inline in re.findall(r"(?<!`)`([^`]+)`(?!`)", text)]
    for block in code:
        for line in block.replace("\\\n", " ").splitlines():
            words = line.strip().removeprefix("$ ")
            if re.match(r"(unconstrain|make|python -m (reproduction|benchmarks))( |$)", words):
                yield shlex.split(words, comments=True)


def check_options(group, name, words):
    """Say which command or option does not exist; a command alone is being talked about."""
    command = group.commands.get(name)
    assert command is not None, f"there is no command {name}"
    options = {flag for each in command.params if isinstance(each, click.Option) for flag in each.opts}
    for word in words:
        if word.startswith("--"):
            assert word.partition("=")[0] in options, f"{name} has no option {word}"


@each
def test_every_command_exists_with_its_options(page):
    targets = re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), flags=re.MULTILINE)
    for program_name, *words in documented_commands(page.read_text(encoding="utf-8")):
        if program_name == "make":
            assert {word for word in words if "=" not in word} <= set(targets), words
        elif program_name == "unconstrain":
            if words and words[0] not in ("--help", "--version"):
                check_options(program, words[0], words[1:])
        elif words[1] == "benchmarks":
            assert {word for word in words[2:] if not word.startswith("-")} <= {*BENCHMARKS, *TABLES}, words
        elif words[2:] and words[2] not in ("--help",):
            check_options(reproduction, words[2], words[3:])


@each
def test_every_public_name_exists(page):
    for name in set(re.findall(r"\buc((?:\.[A-Za-z_]\w*)+)", page.read_text(encoding="utf-8"))):
        found = uc
        for part in name[1:].split("."):
            found = getattr(found, part)
