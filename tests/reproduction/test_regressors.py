"""Regressors of others in small: what their table says of one that comes near, and of one that does not."""

import numpy as np
import pytest

from reproduction.regressors import kinds, problems, tables
from reproduction.regressors.trial import PRIORS, TOLD, TRUTH, WRAPPED, measure


def test_a_wrapped_regressor_comes_near_the_one_that_is_told():
    problem = problems.draw_cycle(0.4, 0.0, seed=0)
    cell = measure("kernel-ridge", "linear", problem)
    assert cell[TRUTH] < cell[TOLD] < cell[WRAPPED] < 0.1 * cell["direct"]
    assert cell["fits"] <= tables.MOST_FITS


def test_rows_beyond_twice_told_are_named():
    rows = problems.PLANTS["arm"]

    def trial(wrapped):
        cell = {"direct": 1.0, WRAPPED: wrapped, TOLD: 0.1, TRUTH: 0.05, "fits": 40, "seconds": 1.0}
        return {row: dict.fromkeys(PRIORS, cell) for row in rows}

    results = {"arm": {"near": [trial(0.1), trial(0.3)], "far": [trial(0.1), trial(0.5)]}}
    first = tables.list_findings(results)[0]
    assert first.startswith("prior 'linear': at most 2 times told in 2 of 4 rows; missed: arm, 1-2-3")
    assert "far (3)" in first
    assert ", near" not in first
    assert "| far | 1 | 0.3 | 0.1 | 0.05 | 3 | 40 |" in tables.write_plant("arm", results["arm"])


def test_noise_is_in_what_is_learnt_from_alone():
    clean, noisy = (problems.draw_cycle(1.0, noise, seed=0) for noise in (0.0, problems.NOISE))
    np.testing.assert_array_equal(clean.test.actions, noisy.test.actions)
    share = np.std(noisy.training.actions - clean.training.actions) / np.sqrt(
        np.mean(clean.training.actions**2)
    )
    assert share == pytest.approx(problems.NOISE, rel=0.05)
    assert set(kinds.CHOSEN_ON).isdisjoint(range(100))
