"""The figures of docs/method.md, and those of the README that come from there."""

import contextlib
import io
import re
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "method.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)
README = (ROOT / "README.md").read_text(encoding="utf-8")


def rows(text):
    """The numbers of a table's last two columns, row by row."""
    cells = [line.strip("|").split("|") for line in text.splitlines() if line.startswith("|")][2:]
    return [[float(cell) for cell in row[-2:]] for row in cells]


def test_both_pages_state_what_the_code_prints():
    _, code = BLOCKS
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        exec(code, {})
    printed = [
        [float(number) for number in re.findall(r"'([\d.e-]+)'", line)]
        for line in said.getvalue().splitlines()
    ]
    table = PAGE[PAGE.index("| 40 movements |") :].split("\n\n")[0]
    # The last digits hang on the library of linear algebra.
    np.testing.assert_allclose(np.log(rows(table)), np.log(printed), atol=np.log(1.5))

    short = README[README.index("| noise of the actions |") :].split("\n\n")[0]
    cells = [line.strip("|").split("|")[1:] for line in short.splitlines()[2:]]
    free, constrained = rows(table)[3:], rows(table)[:3]
    assert [[float(cell) for cell in row] for row in cells] == [
        a + b for a, b in zip(constrained, free, strict=True)
    ]


def test_a_feature_map_of_ones_own_finds_the_parameters():
    names = {}
    exec(BLOCKS[0], names)
    np.testing.assert_allclose(names["policy"].solution_.w, [0.5, 1.0, -1.0], atol=1e-6)
