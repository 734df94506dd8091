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

ROOT = Path(__file__).parents[2]
DATA = ROOT.parent / "shared" / "data"
PAGE = (ROOT / "docs" / "recordings.md").read_text(encoding="utf-8")

pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason="the recordings are not part of the project")


@pytest.fixture(scope="module")
def printed(tmp_path_factory):
    """What the page's commands print, by command and policy, and the folder they ran in."""
    place = tmp_path_factory.mktemp("walk")
    for name in ("planer_circle.csv", "curve_circle.csv"):
        (place / name).symlink_to(DATA / name)
    outputs = {}
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
                words = sys.argv
                policy = words[words.index("--out") + 1] if words[1] == "fit" else words[2]
                outputs[words[1], policy.removesuffix(".skops")] = said.buffer.getvalue().decode()
    assert (place / "curve.png").exists()
    assert (place / "circle.png").exists()
    return outputs, place


RISKS = {"adaptive": "adaptive", "inconsistency": "inconsistency", "direct": "ordinary regression"}


def numbers(text, unit):
    return [float(number) for number in re.findall(rf"(-?[\d.]+) ?{unit}", text)]


def fitted(printed, policy):
    """Held-out error of the whole action and share explained of what is shown by each risk, as `fit` prints them."""
    text = printed["fit", policy]
    found = {}
    for risk, name in RISKS.items():
        (row,) = re.findall(rf"│ {name}\b.*", text)
        cells = [cell.strip() for cell in row.split("│")]
        found[risk] = [float(cells[4]), float(cells[7].removesuffix("%"))]
    return found


def check_table(printed, heading, held_out, crossed):
    """Compare the table below a heading with what was printed."""
    table = PAGE[PAGE.index(heading) :].split("\n\n")[0]
    found = [fitted(printed, name)[risk][1] for name in held_out for risk in list(RISKS)[:2]]
    assert found == pytest.approx(numbers(table, "%"), abs=0.5)
    for name in held_out:
        assert fitted(printed, name)["adaptive"] == fitted(printed, name)["direct"]
        assert "no contact could be told" in printed["fit", name]
    angles = [
        numbers(re.search("│ policy .*", printed["evaluate", name + way])[0], "°")[0]
        for name in crossed
        for way in ("", "-inconsistency")
    ]
    assert angles == pytest.approx(numbers(table, "°"), abs=0.5)


def test_the_page_states_what_its_commands_print(printed):
    both = printed[0]["fit", "both"]
    assert "read: 6021 samples" in both
    assert "zero actions: 0" in both
    assert "λ: 10 " in both
    assert "no contact could be told" in both
    told = re.search(
        r"explains ([\d.]+) % of the held-out motion.*?inconsistency, by the same measure, explains (-[\d.]+) %",
        PAGE,
        flags=re.DOTALL,
    )
    found = fitted(printed[0], "both")
    assert [found["adaptive"][1], found["inconsistency"][1]] == pytest.approx(
        [float(share) for share in told.groups()], abs=0.05
    )
    check_table(printed[0], "| | adaptive, which", ("flat", "curve"), ("flat", "curve"))


def test_relative_to_its_centre_the_movement_circles(printed):
    one_by_one = ("flat-circle", "curve-circle")
    check_table(printed[0], "| motion around", ("circle", *one_by_one), one_by_one)


def test_a_finer_model_is_misled_as_the_page_says(printed):
    page = PAGE[PAGE.index("## Where inference is misled") :]
    text, found = printed[0]["fit", "fine"], fitted(printed[0], "fine")
    for likelihood in re.search(r"likelier with it: ([\d.]+) instead of ([\d.]+) if", page).groups():
        assert likelihood in text
    told = re.search(r"whole action is ([\d.]+), where ordinary regression's is ([\d.]+) and", page)
    errors = [found["adaptive"][0], found["direct"][0]]
    assert errors == pytest.approx([float(error) for error in told.groups()], rel=0.05)
    told = re.search(
        r"explains ([\d.]+) %, below the ([\d.]+) % of\s+ordinary regression and the ([\d.]+) % of the incon",
        page,
    )
    shares = [found[risk][1] for risk in ("adaptive", "direct", "inconsistency")]
    assert shares == pytest.approx([float(share) for share in told.groups()], abs=1.0)
    assert "ordinary regression (saved)" in text
    demos = [uc.load(printed[1] / f"{name}_circle.parquet") for name in ("planer", "curve")]
    both = uc.Demonstrations.concatenate(demos)
    fine = uc.ParametricPolicy(uc.NormalizedRBF(), noise=both.noise)
    P = fine.fit(both.states, both.actions, groups=both.folds("blocks")).predict(both.states)
    size = float(re.search(r"square, ([\d.]+) times as large", page).group(1))
    assert np.sqrt(np.mean(P**2) / np.mean(both.actions**2)) == pytest.approx(size, abs=0.1)
    for demonstrations in demos:
        policy = uc.ParametricPolicy(uc.NormalizedRBF()).fit(
            demonstrations.states, demonstrations.actions, groups=demonstrations.blocks(5)
        )
        assert policy.free_share_ == 1.0


def test_turns_a_second_and_the_part_left_open_are_as_told(printed):
    place = printed[1]
    flat, curved = (uc.load(place / f"{name}_circle.parquet") for name in ("planer", "curve"))
    learnt, adaptive = (
        np.column_stack([path[axis] for axis in "xyz"])
        for path in (
            np.genfromtxt(place / name, delimiter=",", names=True) for name in ("along.csv", "rollout.csv")
        )
    )
    surface = np.array([[0.42, 0.30, -0.86]])
    told = re.search(
        r"goes round ([\d.]+) times in 2.5 s: ([\d.]+) turns a second, where the person made ([\d.]+) on the flat "
        r"surface and ([\d.]+) on\s+the curved one. The adaptive policy makes (\d\.\d+)",
        PAGE,
    )
    found = [_turns(learnt), _turns(learnt) / 2.5, _rate(flat), _rate(curved), _turns(adaptive) / 2.5]
    assert found == pytest.approx([float(number) for number in told.groups()], abs=0.015)
    thinnest = np.linalg.svd(flat.states, full_matrices=False)[2][2]
    assert abs(thinnest @ surface[0]) > 0.999

    across = np.linalg.svd(flat.actions, full_matrices=False)[2][2]
    assert np.sum((flat.actions @ across) ** 2) / np.sum(flat.actions**2) == pytest.approx(0.05, abs=0.005)
    shares = []
    for name in ("flat-circle-inconsistency", "flat-circle"):
        P = uc.load_policy(place / f"{name}.skops").predict(curved.states)
        shares += [explained(curved.actions, P - np.outer(P @ across, across)), explained(curved.actions, P)]
    told = re.search(
        r"explains\s+(\d+) % instead of (\d+) %, the adaptive one (\d+) % instead of (\d+) %", PAGE
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
