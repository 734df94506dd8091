"""The walk-through in docs/recordings.md, command by command; skipped where the recordings are not."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

import unconstrain as uc

ROOT = Path(__file__).parents[1]
DATA = ROOT.parent / "shared" / "data"
PAGE = (ROOT / "docs" / "recordings.md").read_text(encoding="utf-8")

pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason="the recordings are not part of the project")


@pytest.fixture(scope="module")
def printed(tmp_path_factory):
    """What each command of the page prints, in order; run where `../shared/data` is, relative to a new folder."""
    place = tmp_path_factory.mktemp("walk") / "project"
    place.mkdir()
    (place.parent / "shared").symlink_to(DATA.parent)
    outputs = []
    for block in re.findall(r"```sh\n(.*?)```", PAGE, flags=re.DOTALL):
        for line in block.replace("\\\n", " ").strip().splitlines():
            program, *arguments = shlex.split(line)
            assert program == "unconstrain"
            command = [sys.executable, "-m", "unconstrain", *arguments]
            done = subprocess.run(
                command, cwd=place, capture_output=True, text=True, env=os.environ | {"COLUMNS": "300"}
            )
            assert done.returncode == 0, done.stderr
            outputs.append(done.stdout)
    assert (place / "curve.png").exists()
    return outputs


def shares(text):
    return [float(share) for share in re.findall(r"(-?[\d.]+) ?%", text)]


def test_the_page_states_what_its_commands_print(printed):
    both, flat, flat_on_curve, _, direct_on_curve, curve, curve_on_flat, _, direct_on_flat = printed
    assert "read: 6021 samples" in both
    assert "zero actions: 0" in both
    assert "λ: 2.16" in both
    told = re.search(
        r"explains ([\d.]+) % of the held-out motion;\s+ordinary regression explains ([\d.]+) %", PAGE
    )
    assert shares(both)[:2] == pytest.approx([float(share) for share in told.groups()], abs=0.05)
    table = shares(PAGE[PAGE.index("| motion explained") : PAGE.index("## Does")])
    found = [
        *shares(flat)[:2],
        *shares(curve)[:2],
        shares(flat_on_curve)[-1],
        shares(direct_on_curve)[-1],
        shares(curve_on_flat)[-1],
        shares(direct_on_flat)[-1],
    ]
    assert found == pytest.approx(table, abs=0.5)


def test_flips_of_the_tracker_are_gone():
    demos = uc.load(
        [DATA / "planer_circle.csv", DATA / "curve_circle.csv"],
        state=[1, 2, 3],
        time="rosbagTimestamp",
        max_speed=1,
        min_duration=1,
    )
    assert abs(demos.actions).max() < 1.0
    assert (
        uc.load([DATA / "planer_circle.csv", DATA / "curve_circle.csv"], state=[1, 2, 3], time=0).n_episodes
        == 2
    )
