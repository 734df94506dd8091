"""The example that adds the loss to another library's kind of policy, on a dataset that it simulates."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("torch")

EXAMPLES = Path(__file__).parents[2] / "examples"
LEROBOT = Path(__file__).parents[3] / "shared" / "data" / "lerobot"


def run(folder, *arguments):
    code = [sys.executable, *map(str, arguments)]
    done = subprocess.run(
        code, cwd=folder, capture_output=True, text=True, env=os.environ | {"MPLBACKEND": "agg"}
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_two_lines_in_a_policy_of_lerobots_kind(tmp_path):
    printed = run(tmp_path, EXAMPLES / "lerobot_loss.py")
    missed = dict(
        line.split(" of the true")[0].split(": ") for line in printed.splitlines() if "missed" in line
    )
    assert float(missed["our loss"]) < 0.2 * float(missed["regression"])
    assert (tmp_path / "lerobot_loss.png").stat().st_size > 10_000


@pytest.mark.skipif(not LEROBOT.exists(), reason="the dataset is not there")
def test_where_nothing_speaks_for_constraints_it_says_so(tmp_path):
    assert "keep regression" in run(tmp_path, EXAMPLES / "lerobot_loss.py", LEROBOT)
