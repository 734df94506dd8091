"""Some hundred inputs of each area, the same every time; `make fuzz` makes any number of others."""

import subprocess
import sys

import pytest

from tests.fuzz.engine import AREAS

NUMBER = 40
"""Of inputs in each area."""


@pytest.mark.parametrize("area", AREAS)
def test_whatever_is_given_one_true_sentence_or_a_right_result_comes_of_it(area, tmp_path):
    command = [sys.executable, "-m", "tests.fuzz", "--area", area, "--number", str(NUMBER), "--seed", "0"]
    ended = subprocess.run([*command, "--jobs", "1", "--keep", str(tmp_path)], text=True, capture_output=True)
    assert ended.returncode == 0, ended.stdout + ended.stderr
