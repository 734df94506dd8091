"""The figures of docs/method.md."""

import contextlib
import io
import re
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "method.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)


def rows(table, keys, columns):
    """The numbers of a table's columns, by the first cells of each row."""
    head, _, *lines = [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()]
    places = [head.index(column) for column in columns]
    return {tuple(line[:keys]): [float(line[place]) for place in places] for line in lines}


def test_the_page_states_what_the_code_prints():
    _, code = BLOCKS
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        exec(code, {})
    printed = [
        [float(number) for number in re.findall(r"'([\d.e-]+)'", line)]
        for line in said.getvalue().splitlines()
    ]
    table = PAGE[PAGE.index("| free share | direct |") :].split("\n\n")[0]
    told = rows(table, 1, ("direct", "inconsistency", "adaptive"))
    # The last digits hang on the library of linear algebra.
    np.testing.assert_allclose(np.log(list(told.values())), np.log(printed), atol=np.log(1.5))


def test_a_feature_map_of_ones_own_finds_the_parameters():
    names = {}
    exec(BLOCKS[0], names)
    np.testing.assert_allclose(names["policy"].solution_.w, [0.5, 1.0, -1.0], atol=1e-6)
