"""The code and the commands of docs/verdict.md, as they stand there."""

import contextlib
import re
import shlex
from pathlib import Path

from unconstrain.cli.app import run

PAGE = (Path(__file__).parents[2] / "docs" / "verdict.md").read_text(encoding="utf-8")


def test_the_commands_end_with_what_the_page_says(tmp_path, capsys):
    (code,) = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)
    (commands,) = re.findall(r"```sh\n(.*?)```", PAGE, flags=re.DOTALL)
    with contextlib.chdir(tmp_path):
        exec(code, {})
        printed = ""
        for command in commands.strip().splitlines():
            assert run(shlex.split(command)[1:]) == 0
            printed += capsys.readouterr().out
    for quoted in re.findall(r"```text\n(.*?)```", PAGE, flags=re.DOTALL):
        for line in quoted.strip().splitlines():
            assert line in printed
