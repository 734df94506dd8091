"""The code and the commands of docs/states.md, as they stand there."""

import contextlib
import re
import shlex
from pathlib import Path

import numpy as np

from unconstrain.cli.app import run

PAGE = (Path(__file__).parents[2] / "docs" / "states.md").read_text(encoding="utf-8")


def explained(printed: str) -> str:
    """Return the share that the saved policy explains, as the page writes it."""
    (row,) = re.findall(r"\(saved\).*% .*? ([-\d.]+)%", printed)
    return f"{row} %"


def test_the_commands_print_what_the_page_says(tmp_path, capsys):
    names: dict = {}
    shares = []
    with contextlib.chdir(tmp_path):
        for language, block in re.findall(r"```(python|sh)\n(.*?)```", PAGE, flags=re.DOTALL):
            if language == "python":
                exec(block, names)
                continue
            for command in block.replace("\\\n", " ").strip().splitlines():
                assert run(shlex.split(command)[1:]) == 0
                printed = capsys.readouterr().out
                if " fit " in command:
                    shares.append(explained(printed))
        movement = np.loadtxt("cup-there.csv", delimiter=",", skiprows=1)
    assert shares == re.findall(
        r"-?[\d.]+ %", "".join(re.findall(r"\n(?:The policy|The first) explains.*", PAGE))
    )
    assert capsys.readouterr().out.splitlines() == re.findall(
        r"[\d.]+ m(?= of the button| from the button)", PAGE
    )
    assert np.allclose(np.linalg.norm(movement[:, 4:8], axis=1), 1.0)
    assert np.allclose(np.abs(movement[-1, 1:8]), [1, 2, 0, 0, 0, 0.7071, 0.7071], atol=1e-3)
