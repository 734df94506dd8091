"""Recordings in the open: the measures, and one shape once; skipped where the recordings are not."""

import shutil
from pathlib import Path

import numpy as np
import pytest
import similaritymeasures
from scipy.optimize import check_grad

from reproduction.program import run
from reproduction.real import handwriting, measures, reaching, seds

ROOT = Path(__file__).parents[2]
DATA = ROOT.parent / "shared" / "data"
recorded = pytest.mark.skipif(not DATA.is_dir(), reason="the recordings are not part of the project")


def test_the_measures_are_those_that_are_published():
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(23, 2)), rng.normal(size=(31, 2))
    assert measures.warping_distance(a, b) == pytest.approx(similaritymeasures.dtw(a, b)[0], rel=1e-12)
    U, P = np.array([[3.0, 4.0], [1.0, 0.0], [1.0, 0.0]]), np.array([[0.0, 0.0], [0.0, 2.0], [1.0, 0.0]])
    assert measures.velocity_error(U, P) == pytest.approx((5 + np.sqrt(5)) / np.sqrt(2) / 3)
    assert measures.direction_error(U, P) == pytest.approx(1 / 3)
    paths = measures.simulate(lambda X: -X, [np.array([1.0, 0.0]), np.array([0.0, 2.0])])
    # Movements end once all rest: e^-t of 2 is below 0.1 after 3 s, and three steps more.
    assert len(paths[0]) == len(paths[1]) == pytest.approx(1 + np.log(20) / 0.01 + 3, abs=3)


def test_our_seds_follows_its_gradient_and_leads_to_the_goal():
    rng = np.random.default_rng(0)
    X = rng.normal(size=(60, 2))
    U = -X @ np.array([[1.0, 0.8], [-0.8, 1.0]])
    start = rng.normal(size=33)
    off = check_grad(lambda p: seds._cost(p, X, U)[0], lambda p: seds._cost(p, X, U)[1], start)
    assert off < 1e-4
    found = seds._unpack(start)[0]
    assert np.linalg.eigvalsh(found.slopes + found.slopes.swapaxes(1, 2)).max() < 0


@recorded
def test_one_shape_once(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(handwriting, "ONCE", ())
    monkeypatch.setattr(handwriting, "SUBSAMPLE", 10)
    monkeypatch.setattr(measures, "LONGEST", 200)
    monkeypatch.setattr(handwriting, "FINE", 12)
    monkeypatch.setenv("COLUMNS", "300")
    folder, out = tmp_path / "data", tmp_path / "out"
    (folder / "handwriting").mkdir(parents=True)
    shutil.copy(DATA / "handwriting" / "GShape.mat", folder / "handwriting")
    arguments = ["real", str(folder), "--repetitions", "1", "--out", str(out)]
    assert run(arguments) == 0
    printed = capsys.readouterr()
    assert "reaching is left out: " in printed.out
    page = (out / "real.md").read_text(encoding="utf-8")
    assert "| `LocallyLinearPolicy()` | 1 shapes, published split |" in page
    assert "| GShape |" in page
    assert (out / "handwriting.png").is_file()
    assert run(arguments) == 0
    assert "1 of 1 are kept from before" in capsys.readouterr().err
    assert (out / "real.md").read_text(encoding="utf-8") == page


@recorded
def test_what_boxes_bend_is_better_left_out(monkeypatch):
    monkeypatch.setattr(reaching, "LONGEST", 100)
    pairs, boxes = reaching.load(DATA)
    demos = reaching.join([pairs[i] for i in (*reaching.BENT_REACHES, 0, 1)])
    held_out = [pairs[i] for i in (2, 3, 4)]
    direct, without = (
        reaching.compare(reaching.learn(way, demos, boxes, reaching.WITHIN), demos, held_out)
        for way in (reaching.DIRECT, reaching.WITHOUT)
    )
    assert all(a < b for a, b in zip(without, direct, strict=True))


def test_the_page_has_the_tables_of_what_the_command_prints():
    page = (ROOT / "docs" / "real.md").read_text(encoding="utf-8")
    measured = dict.fromkeys(("Angle", "GShape"), (1.0, 0.1, 100.0))
    results = [{way: {"test": measured, "train": measured} for way in handwriting.EVERY_TIME}]
    headers = [line for line in handwriting.tabulate(list(measured), results).splitlines() if "RMSE" in line]
    ways = dict.fromkeys((reaching._name(*each) for each in reaching.list_ways()), (1.0, 1.0, 1.0, 1.0))
    headers.append(reaching.tabulate([ways]).splitlines()[0])
    assert len(headers) == 3
    assert all(header in page for header in headers)


def test_a_folder_without_recordings_is_a_mistake(tmp_path, capsys):
    assert run(["real", str(tmp_path)]) == 2
    assert "holds nothing to run" in capsys.readouterr().err
