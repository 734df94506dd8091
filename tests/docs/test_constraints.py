"""The first lines of docs/constraints.md, on a recording such as they speak of."""

import contextlib
import re
from pathlib import Path

import numpy as np

from unconstrain.constraints import projection

PAGE = (Path(__file__).parents[2] / "docs" / "constraints.md").read_text(encoding="utf-8")


def write_wipe(path):
    """Six movements, free at first, then against a surface each, with what a force sensor measured."""
    rng = np.random.default_rng(0)
    rows = []
    for run in range(6):
        normal, x = rng.standard_normal((2, 3))
        normal /= np.linalg.norm(normal)
        for k in range(120):
            contact = k >= 40
            u = projection(normal[None]) @ -x if contact else -x
            force = contact * 5.0 * normal + rng.normal(0, 0.1, 3)
            rows.append([run, 0.02 * k, *x, *force])
            x = x + 0.02 * u
    np.savetxt(path, rows, delimiter=",", header="run,t,x,y,z,fx,fy,fz", comments="")


def test_forces_become_projections(tmp_path):
    names = {}
    write_wipe(tmp_path / "wipe.csv")
    with contextlib.chdir(tmp_path):
        exec(re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)[0], names)
    assert names["policy"].n_known_constraints_ == len(names["demos"])
    assert names["demos"].projections.shape == (720, 3, 3)
    assert names["policy"].score([[0.5, 0.5, 0.5]], [[-0.5, -0.5, -0.5]]) > 0.95
