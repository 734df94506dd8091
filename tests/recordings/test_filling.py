"""Columns that are filled at different rates, as PlotJuggler exports them."""

import numpy as np
import pytest

import unconstrain as uc
from tests.recordings.inspection.test_inspecting import run_next
from unconstrain.errors import DataError


def line(t, j):
    return (j + 1) * t + j


def merged(path, rates, seconds=4.0, without=(9.0, 9.0), angle=None):
    """Columns a, b, ... at rates of their own, merged by time; the second is not there between two times."""
    rows = []
    for j, rate in enumerate(rates):
        for i in range(int(seconds * rate) + 1):
            t = i / rate + 0.0003 * j * (0 < i < int(seconds * rate))
            if j == 1 and without[0] < t < without[1]:
                continue
            value = line(t, j)
            if j == angle:
                value = (value + np.pi) % (2 * np.pi) - np.pi
            rows.append((t, j, value))
    lines = ["t," + ",".join("abcd"[: len(rates)])]
    for t in sorted({row[0] for row in rows}):
        own = {j: value for at, j, value in rows if at == t}
        lines.append(
            ",".join([f"{t:.6f}", *(f"{own[j]:.9f}" if j in own else "" for j in range(len(rates)))])
        )
    path.write_text("\n".join(lines) + "\n")
    return path


def test_each_is_interpolated_between_its_own_stamps(tmp_path):
    path = merged(tmp_path / "a.csv", (100, 40, 15))
    demos = uc.load(path, state=["a", "b", "c"], time="t", resample=50)
    assert demos.n_episodes == 1
    assert len(demos) == 201
    np.testing.assert_allclose(
        demos.states, np.column_stack([line(demos.time, j) for j in range(3)]), atol=1e-5
    )
    assert "values filled in: each column is interpolated between its own stamps" in demos.notes[0]


def test_nothing_is_interpolated_across_a_gap(tmp_path):
    path = merged(tmp_path / "a.csv", (100, 40), without=(1.0, 2.0))
    demos = uc.load(path, state=["a", "b"], time="t", resample=50)
    assert demos.n_episodes == 2
    assert not np.any((demos.time > 1.001) & (demos.time < 1.999))
    np.testing.assert_allclose(
        demos.states, np.column_stack([line(demos.time, j) for j in range(2)]), atol=1e-5
    )
    assert any("with something missing" in note for note in demos.notes)


def test_the_turns_of_an_angle_are_counted_before(tmp_path):
    path = merged(tmp_path / "a.csv", (100, 15), seconds=6.0, angle=1)
    demos = uc.load(path, state=["a", "b"], time="t", resample=50)
    np.testing.assert_allclose(np.diff(demos.states[:, 1]), 2 / 50, atol=1e-5)


def test_blocks_hold_what_loading_gives(tmp_path):
    lines = merged(tmp_path / "a.csv", (100, 40)).read_text().splitlines()
    both = [lines[0] + ",run", *(f"{line},1" for line in lines[1:]), *(f"{line},2" for line in lines[40:])]
    (tmp_path / "a.csv").write_text("\n".join(both) + "\n")
    opened = uc.open(tmp_path / "a.csv", state=["a", "b"], time="t", episode="run", resample=30)
    whole = opened.load()
    blocks = list(opened.blocks(5))
    np.testing.assert_array_equal(np.concatenate([block.states for block in blocks]), whole.states)
    assert tuple(map(str, opened.notes)) == whole.notes


def test_without_resample_the_option_is_named(tmp_path):
    path = merged(tmp_path / "a.csv", (100, 40))
    apart = [line for line in path.read_text().splitlines() if ",," in f"{line}," or line.startswith("t")]
    (tmp_path / "b.csv").write_text("\n".join(apart) + "\n")
    with pytest.raises(DataError, match="or give resample= where columns are filled at different rates"):
        uc.load(tmp_path / "b.csv", state=["a", "b"], time="t", drop="missing")
    demos = uc.load(path, state="b", time="t", drop="missing")
    assert any("most rows lack something" in note and "resample=" in note for note in demos.notes)


def test_inspect_proposes_it(tmp_path):
    found = uc.inspect(merged(tmp_path / "a.csv", (100, 40, 15)))
    assert "--resample 100" in found.next
    assert any("filled at different times" in note and "--resample" in note for note in found.notes)
    code, said = run_next(found, tmp_path)
    assert code == 0, said
