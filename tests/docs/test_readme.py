"""The README's five minutes, as they stand there."""

import contextlib
import io
import re
import shlex
from pathlib import Path

import numpy as np
import pytest

from unconstrain.cli.app import run

README = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
FIVE_MINUTES = README[README.index("## Five minutes") : README.index("## The method")]


@pytest.fixture(scope="module")
def printed(tmp_path_factory):
    """What each command prints, by its name, and the folder they ran in."""
    place = tmp_path_factory.mktemp("five minutes")
    (commands,) = re.findall(r"```sh\n(.*?)```", FIVE_MINUTES, flags=re.DOTALL)
    outputs = {}
    with contextlib.chdir(place):
        for line in commands.strip().replace("\\\n", "").splitlines():
            program, *arguments = shlex.split(line)
            assert program == "unconstrain"
            said = io.TextIOWrapper(io.BytesIO(), encoding="utf-8")
            with contextlib.redirect_stdout(said):
                assert run(arguments) == 0
            said.flush()
            outputs[arguments[0]] = said.buffer.getvalue().decode()
    return outputs, place


def test_the_commands_print_the_shares_that_the_text_states(printed):
    (free,) = re.findall(r"inferred: ([\d.]+)%", printed[0]["fit"])
    shown = {
        name: re.findall(r"│ (?:adaptive|inconsistency|ordinary|policy).* ([-\d.]+)% +│ +[-\d.]* +│", output)
        for name, output in printed[0].items()
    }
    told = [float(share) for share in re.findall(r"([\d.]+) %", FIVE_MINUTES)]
    found = [float(share) for share in (free, *shown["fit"], shown["evaluate"][0])]
    # What was free, then the shares explained: adaptive, inconsistency, ordinary regression, and on the others.
    assert found == pytest.approx(told, abs=0.1)
    assert f"noise: {re.search(r'deviation of ([0-9.]+)', FIVE_MINUTES)[1]} in the unit" in printed[0]["fit"]
    assert "x2 0.2" in printed[0]["rollout"]
    for picture in ("circle.png", "blocked.png", "known.png"):
        assert (printed[1] / picture).exists()


def test_the_first_table_is_the_demos(printed):
    table = (printed[1] / "demo" / "table.md").read_text(encoding="utf-8")
    assert table in README


def test_python_does_what_the_commands_do(printed):
    (code,) = re.findall(r"```python\n(.*?)```", FIVE_MINUTES, flags=re.DOTALL)
    names = {}
    with contextlib.chdir(printed[1]), contextlib.redirect_stdout(io.StringIO()):
        exec(code, names)
    policy, others, path = names["policy"], names["others"], names["path"]
    assert (
        f"{policy.score(others.states, others.actions, groups=others.episodes):.2%}" in printed[0]["evaluate"]
    )
    written = np.genfromtxt(printed[1] / "blocked.csv", delimiter=",", names=True)
    np.testing.assert_allclose(path.states[-1], [written["x1"][-1], written["x2"][-1]], atol=1e-6)
