"""`python -m reproduction cycles`: what it measures, on loops that are made up."""

from pathlib import Path

import numpy as np
import pytest

from reproduction import cycles
from unconstrain.demonstrations import Demonstrations


def test_loops_keep_amplitude_and_period_and_the_page_has_the_table(monkeypatch):
    monkeypatch.setattr(cycles, "STARTS", 2)
    monkeypatch.setattr(cycles, "FINE", 0.02)
    t = np.arange(0, 8, 0.02)
    x = np.column_stack([np.cos(4 * t), np.sin(4 * t)]) * (1 + 0.05 * np.sin(t))[:, None]
    loops = Demonstrations(x, np.gradient(x, 0.02, axis=0), time=t)
    row = cycles.measure(cycles.Recorded("loops", loops, loops))
    assert row.period == pytest.approx(np.pi / 2, rel=0.01)
    assert row.stable.share == 1.0
    assert row.plain.share == 0.0  # which leaves along tangents
    assert row.change < 0.2
    page = (Path(__file__).parents[2] / "docs" / "stability.md").read_text(encoding="utf-8")
    assert cycles.tabulate([row]).splitlines()[0] in page
