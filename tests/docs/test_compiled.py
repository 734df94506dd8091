"""The code of docs/compiled.md, as it stands there."""

import contextlib
import re
from pathlib import Path

import numpy as np
import pytest

import unconstrain as uc

PAGE = (Path(__file__).parents[2] / "docs" / "compiled.md").read_text(encoding="utf-8")


def test_the_code_runs(tmp_path):
    pytest.importorskip("onnxruntime")
    X = np.random.default_rng(0).uniform(-1, 1, (500, 7))
    policy = uc.ParametricPolicy(uc.NormalizedRBF(n_centers=20)).fit(X, -X)
    names = {"policy": policy, "x": X[0].copy(), "X": X, "state": X[0].copy()}
    in_a_loop, the_file, *onnx = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)
    with contextlib.chdir(tmp_path):
        exec(in_a_loop, names)
        names["step"].save("step.npz")
        exec(the_file, names)
        for block in onnx:
            exec(block, names)
    assert names["kind"] == "rbf"
    assert names["weights"].shape == (7, 20)
    np.testing.assert_allclose(names["action"], names["u"].numpy()[0])
    np.testing.assert_allclose(names["action"], policy.predict(X[:1])[0], rtol=1e-9)
    np.testing.assert_allclose(names["U"], policy.predict(X), rtol=1e-9)
