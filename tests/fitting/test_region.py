"""Where states were recorded: boxes that add up."""

import numpy as np
import pytest

from unconstrain.fitting import region
from unconstrain.fitting.region import MOST_BOXES, Region


@pytest.mark.parametrize("n", [1, 3, 9])
def test_boxes_hold_all_samples_whatever_the_order_and_grouping(n):
    rng = np.random.default_rng(n)
    Z = rng.normal(size=(4000, n)).cumsum(axis=0) * rng.uniform(0.1, 10, size=n)
    unit = rng.uniform(0.5, 2.0, size=n)
    whole = Region.of(Z, unit)
    assert len(whole.boxes) <= MOST_BOXES
    assert whole.distance(Z).max() == 0
    parts = [Region.of(part, unit) for part in np.array_split(rng.permutation(Z), 7)]
    for order in (range(7), [5, 0, 3, 6, 2, 1, 4]):
        total = sum((parts[k] for k in order[1:]), parts[order[0]])
        assert total.coarseness == whole.coarseness
        np.testing.assert_array_equal(total.boxes, whole.boxes)
    far = Z + 1e9 * unit
    np.testing.assert_allclose(whole.distance(far), 1e9 * np.sqrt(n), rtol=1e-3)
    assert np.isinf(whole.distance(np.full((1, n), 1e300)))[0]


@pytest.mark.parametrize("n", [2, 7])
def test_looking_at_some_states_first_changes_nothing(n, monkeypatch):
    rng = np.random.default_rng(n)
    for Z in (rng.uniform(-3, 3, size=(3000, n)), rng.normal(0, 0.02, size=(3000, n)).cumsum(axis=0)):
        whole = Region.of(Z, np.full(n, 0.5))
        monkeypatch.setattr(region, "PROBED", 700)
        probed = Region.of(Z, np.full(n, 0.5))
        assert probed.coarseness == whole.coarseness
        np.testing.assert_array_equal(probed.boxes, whole.boxes)
        monkeypatch.undo()
