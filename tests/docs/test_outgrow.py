"""docs/outgrow.md: what it does with files, on a folder of files such as it speaks of."""

import contextlib
import re
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import unconstrain as uc

PAGE = (Path(__file__).parents[2] / "docs" / "outgrow.md").read_text(encoding="utf-8")


@pytest.fixture
def place(tmp_path):
    rng = np.random.default_rng(0)
    for folder in ("recordings", "today"):
        (tmp_path / folder).mkdir()
        for part in range(2):
            X = rng.uniform(-1, 1, (400, 3))
            columns = dict(zip("xyzuvw", np.hstack([X, -X]).T, strict=True))
            columns |= {
                "run": np.repeat([2 * part, 2 * part + 1], 200),
                "t": np.tile(np.arange(200) * 0.02, 2),
            }
            columns |= {name: rng.normal(0, 0.1, 400) for name in ("fx", "fy", "fz")}
            columns |= {"lifted": np.ones(400)}
            pq.write_table(pa.table(columns), tmp_path / folder / f"part-{part}.parquet")
    return tmp_path


def test_the_code_runs(place):
    blocks = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)
    elsewhere = (
        "s3://",
        "MyTransformer",
        "large.skops",
        ".fit(demos",
    )  # a cluster, the reader's own class, half a gigabyte, the reader's data
    names = {}
    with contextlib.chdir(place):
        for block in blocks:
            if not any(word in block for word in elsewhere):
                exec(block, names)
    assert names["policy"].score([[0.5, 0.5, 0.5]], [[-0.5, -0.5, -0.5]]) > 0.99
    assert isinstance(uc.load_policy(place / "today.skops"), uc.LocallyLinearPolicy)
