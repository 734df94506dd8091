"""docs/pictures.md: its code draws the page's picture."""

import contextlib
import re
from pathlib import Path

import matplotlib as mpl
from matplotlib import pyplot

PAGE = (Path(__file__).parents[2] / "docs" / "pictures.md").read_text(encoding="utf-8")


def test_the_code_draws_each_picture_on_its_axes(tmp_path):
    (block,) = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)
    mpl.use("agg")
    names = {}
    with contextlib.chdir(tmp_path):
        exec(block, names)
        assert 50_000 < Path("pictures.png").stat().st_size < 400_000
    titles = [ax.get_title() for ax in names["axes"]]
    assert all(titles)
    assert len(set(titles)) == len(titles)
    pyplot.close("all")
