"""The walk-through in docs/recordings.md, block by block; skipped where the recordings are not."""

import contextlib
import io
import re
import shlex
import sys
from pathlib import Path

import numpy as np
import pytest

import unconstrain as uc
from unconstrain.cli import main
from unconstrain.metrics import explained
from unconstrain.simulation import rollout

ROOT = Path(__file__).parents[2]
DATA = ROOT.parent / "shared" / "data"
PAGE = (ROOT / "docs" / "recordings.md").read_text(encoding="utf-8")

pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason="the recordings are not part of the project")


@pytest.fixture(scope="module")
def printed(tmp_path_factory):
    """What the page's commands print, in order, and the folder they ran in."""
    place = tmp_path_factory.mktemp("walk")
    for name in ("planer_circle.csv", "curve_circle.csv"):
        (place / name).symlink_to(DATA / name)
    outputs = []
    # In one process, to import everything once.
    with pytest.MonkeyPatch.context() as patch, contextlib.chdir(place):
        patch.setenv("COLUMNS", "300")
        for language, block in re.findall(r"```(sh|python)\n(.*?)```", PAGE, flags=re.DOTALL):
            if language == "python":
                exec(block, {})
                continue
            for line in block.replace("\\\n", " ").strip().splitlines():
                patch.setattr(sys, "argv", shlex.split(line))
                assert sys.argv[0] == "unconstrain"
                said = io.TextIOWrapper(io.BytesIO(), encoding="utf-8")
                with contextlib.redirect_stdout(said), pytest.raises(SystemExit) as end:
                    main()
                assert not end.value.code
                said.flush()
                outputs.append(said.buffer.getvalue().decode())
    assert (place / "curve.png").exists()
    assert (place / "circle.png").exists()
    return outputs, place


def shares(text):
    return [float(share) for share in re.findall(r"(-?[\d.]+) ?%", text)]


def found(printed):
    """Shares in the order of the page's tables: each surface held out, then each policy on the other surface."""
    _, flat, flat_on_curve, _, direct_on_curve, curve, curve_on_flat, _, direct_on_flat = printed
    crossed = (flat_on_curve, direct_on_curve, curve_on_flat, direct_on_flat)
    return [*shares(flat)[:2], *shares(curve)[:2], *(shares(each)[-1] for each in crossed)]


def test_the_page_states_what_its_commands_print(printed):
    both = printed[0][0]
    assert "read: 6021 samples" in both
    assert "zero actions: 0" in both
    assert "λ: 2.16" in both
    told = re.search(
        r"explains ([\d.]+) % of the held-out motion;\s+ordinary regression explains ([\d.]+) %", PAGE
    )
    assert shares(both)[:2] == pytest.approx([float(share) for share in told.groups()], abs=0.05)
    table = shares(PAGE[PAGE.index("| motion explained") : PAGE.index("## Does")])
    assert found(printed[0][:9]) == pytest.approx(table, abs=0.5)


def test_relative_to_its_centre_the_movement_circles(printed):
    table = shares(PAGE[PAGE.index("| motion around") : PAGE.index("**Now the field")])
    assert [*shares(printed[0][9])[:2], *found(printed[0][9:18])] == pytest.approx(table, abs=0.5)


def test_turns_a_second_and_the_part_left_open_are_as_told(printed):
    place = printed[1]
    flat, curved = (uc.load(place / f"{name}_circle.npz") for name in ("planer", "curve"))
    path = np.genfromtxt(place / "rollout.csv", delimiter=",", names=True)
    learnt = np.column_stack([path["x"], path["y"], path["z"]])
    both = uc.Demonstrations.concatenate([flat, curved])
    direct = uc.ParametricPolicy(risk="direct", alpha="cv").fit(
        both.states, both.actions, groups=both.blocks(5)
    )
    surface = np.array([[0.42, 0.30, -0.86]])
    regression = rollout(direct, learnt[0], 1250, 0.002, surface).states
    told = re.search(
        r"goes round ([\d.]+) times: ([\d.]+) turns a second, where the person made ([\d.]+) on the flat surface and "
        r"([\d.]+) on\s+the curved one. The direct policy makes (\d\.\d+)",
        PAGE,
    )
    found = [_turns(learnt), _turns(learnt) / 2.5, _rate(flat), _rate(curved), _turns(regression) / 2.5]
    assert found == pytest.approx([float(number) for number in told.groups()], abs=0.015)
    thinnest = np.linalg.svd(flat.states, full_matrices=False)[2][2]
    assert abs(thinnest @ surface[0]) > 0.999

    across = np.linalg.svd(flat.actions, full_matrices=False)[2][2]
    assert np.sum((flat.actions @ across) ** 2) / np.sum(flat.actions**2) == pytest.approx(0.06, abs=0.005)
    shares = []
    for name in ("flat-circle", "flat-circle-direct"):
        P = uc.load_policy(place / f"{name}.skops").predict(curved.states)
        shares += [explained(curved.actions, P - np.outer(P @ across, across)), explained(curved.actions, P)]
    told = re.search(
        r"explains\s+(\d+) % instead of (\d+) %, the direct one (\d+) % instead of (\d+) %", PAGE
    )
    assert shares == pytest.approx([float(number) / 100 for number in told.groups()], abs=0.01)


def _turns(X):
    """How often positions (N, 3) around the origin go round in the plane they extend in."""
    x, y = (X @ np.linalg.svd(X, full_matrices=False)[2][:2].T).T
    angle = np.unwrap(np.arctan2(y, x))
    return abs(angle[-1] - angle[0]) / (2 * np.pi)


def _rate(demos):
    """Turns a second over all episodes."""
    episodes = [demos.episode(k) for k in range(demos.n_episodes)]
    return sum(_turns(e.states) for e in episodes) / sum(e.time[-1] - e.time[0] for e in episodes)


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
