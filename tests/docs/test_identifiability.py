"""The first lines of docs/identifiability.md, as they stand there."""

import contextlib
import io
import re
from pathlib import Path

from unconstrain.cli.app import run

PAGE = (Path(__file__).parents[2] / "docs" / "identifiability.md").read_text(encoding="utf-8")


def test_the_code_runs(tmp_path):
    (code,) = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)
    names = {}
    said = io.TextIOWrapper(io.BytesIO(), encoding="utf-8")
    with contextlib.chdir(tmp_path), contextlib.redirect_stdout(said):
        assert run(["demo", "--out", "demo"]) == 0
        exec(code, names)
    assert names["deviation"].shape == names["actions"].shape
    assert 0 < names["report"].determined_share <= 1
