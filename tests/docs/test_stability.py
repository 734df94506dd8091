"""The code and the commands of docs/stability.md print what the page says."""

import contextlib
import re
import shlex
from pathlib import Path

import numpy as np

from unconstrain.cli.app import run

PAGE = (Path(__file__).parents[2] / "docs" / "stability.md").read_text(encoding="utf-8")


def test_the_commands_print_what_the_page_says(tmp_path, capsys):
    with contextlib.chdir(tmp_path):
        for block in re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL):
            exec(block, {})
        printed = ""
        (commands,) = (
            block for block in re.findall(r"```sh\n(.*?)```", PAGE, flags=re.DOTALL) if "fit" in block
        )
        for command in commands.strip().splitlines():
            assert run(shlex.split(command)[1:]) == 0
            printed += capsys.readouterr().out
        fit = commands.splitlines()[0].replace("--stable-at end ", "").replace("reach.skops", "plain.skops")
        for command in (fit, 'unconstrain rollout plain.skops --start="-0.5,-0.3" --beyond anywhere --overwrite'):
            assert run(shlex.split(command)[1:]) == 0
        plain = np.genfromtxt("rollout.csv", delimiter=",", names=True)
    said = [
        line
        for block in re.findall(r"```text\n(.*?)```", PAGE, flags=re.DOTALL)
        for line in block.splitlines()
    ]
    assert len(said) == 5
    for line in said:
        assert line in printed.splitlines()
    left = np.hypot(plain["x"][-1], plain["y"][-1])
    assert f"stands still {left:.2f} from the goal" in " ".join(PAGE.split())
