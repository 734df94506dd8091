"""Every example runs, and draws its picture."""

import ast
import runpy
from pathlib import Path

import matplotlib.pyplot as plt
import pytest
from threadpoolctl import threadpool_limits

EXAMPLES = sorted((Path(__file__).parents[1] / "examples").glob("*.py"))
ELSEWHERE = {"lerobot_loss", "robot_panda", "robot_wall", "control_loop_cpp", "ros2_node"}
"""In tests/torch; where the gallery is built, since they simulate, render or compile; where there is ROS 2."""
QUICK = [path for path in EXAMPLES if path.stem not in ELSEWHERE]


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_the_example_says_who_would_want_it(example):
    text = ast.get_docstring(ast.parse(example.read_text(encoding="utf-8")))
    title, rule, _, paragraph, *_ = text.splitlines()
    assert set(rule) == {"="}
    assert len(rule) == len(title)
    assert paragraph.startswith("For ")
    assert "\n# %%\n" in example.read_text(encoding="utf-8")


@pytest.mark.parametrize("example", QUICK, ids=lambda path: path.stem)
def test_the_example_runs(example, tmp_path, monkeypatch):
    if "torch" in example.read_text(encoding="utf-8"):
        pytest.importorskip("torch")
    monkeypatch.chdir(tmp_path)
    plt.close("all")  # of other tests
    monkeypatch.setattr("sys.argv", [example.name])
    with plt.rc_context({"backend": "agg"}), threadpool_limits(1):
        runpy.run_path(str(example), run_name="__main__")
    drawn = [len(figure.axes) for figure in map(plt.figure, plt.get_fignums())]
    plt.close("all")
    assert len(drawn) == 1
    assert drawn[0] > 0
