"""The how-to pages, as they stand there: code runs, commands succeed, and what they quote is printed."""

import contextlib
import re
import shlex
from pathlib import Path

import pytest

from unconstrain.cli.app import run

PAGES = sorted((Path(__file__).parents[2] / "docs" / "howto").glob("*.md"))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_page_does_what_it_says(page, tmp_path, capsys):
    names: dict = {}
    printed = ""
    blocks = re.findall(r"^```(python|sh|text)\n(.*?)^```", page.read_text("utf-8"), flags=re.DOTALL | re.M)
    with contextlib.chdir(tmp_path):
        for language, block in blocks:
            if language == "python":
                exec(block, names)
            elif language == "sh":
                for command in block.replace("\\\n", " ").strip().splitlines():
                    assert run(shlex.split(command)[1:]) == 0, command
            printed += capsys.readouterr().out
            if language == "text":
                for line in block.strip().splitlines():
                    assert line in printed
