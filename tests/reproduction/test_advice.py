"""How many demonstrations advice needs, counted; and one data set of the arm, whose advice beats random choice."""

import numpy as np
import pytest

from reproduction.identifiability import advice
from reproduction.identifiability.tables import count_demonstrations, measure_share


def test_the_share_of_demonstrations_is_that_of_the_medians():
    random = np.tile(np.geomspace(1.0, 1e-2, 9), (4, 1))
    twice_as_fast = np.tile(np.geomspace(1.0, 1e-4, 9), (4, 1))
    assert count_demonstrations(random, twice_as_fast) == (8, 4)
    assert measure_share(random, twice_as_fast) == (0.5, 0.5, 0.5)
    assert measure_share(random, random) == (1.0, 1.0, 1.0)
    assert count_demonstrations(random, 2 * random)[1] == 9


def test_an_advised_limit_cycle_is_learnt_with_fewer_demonstrations(monkeypatch):
    monkeypatch.setattr(advice, "TOY_MOST", 14)
    monkeypatch.setattr(advice, "TOY_POOL", 20)
    advised = advice.follow("limit cycle", "inconsistency", "advised", 100)["nUPE"]
    random = advice.follow("limit cycle", "inconsistency", "random", 100)["nUPE"]
    assert advised[:1] == pytest.approx(random[:1])
    assert len(advised) == 13
    assert min(advised) < min(random)
