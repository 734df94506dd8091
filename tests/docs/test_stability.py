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
        blocks = re.findall(r"```sh\n(.*?)```", PAGE, flags=re.DOTALL)
        commands = [c for block in blocks if ".csv --state x,y" in block for c in block.strip().splitlines()]
        codes = []
        for command in commands:
            codes.append(run(shlex.split(command)[1:]))
            printed += capsys.readouterr().out
        assert codes == [0, 0, 0, 0, 3, 3]
        assert run(shlex.split('rollout plain.skops --start="-0.5,-0.3" --beyond anywhere --overwrite')) == 0
        plain = np.genfromtxt("rollout.csv", delimiter=",", names=True)
    said = [
        line
        for block in re.findall(r"```text\n(.*?)```", PAGE, flags=re.DOTALL)
        for line in block.splitlines()
    ]
    assert len(said) == 7
    for line in said:
        assert line in printed.splitlines()
    left = np.hypot(plain["x"][-1], plain["y"][-1])
    assert f"stands still {left:.2f} from the goal" in " ".join(PAGE.split())
