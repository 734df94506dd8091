"""The posture: one data set already reaches the published figure."""

import json

import numpy as np
import pytest
from rich.console import Console
from threadpoolctl import threadpool_limits

from reproduction import published
from reproduction.plants.posture import demonstrate
from reproduction.plants.robot_choice import OUR_OWN
from reproduction.posture import experiment
from reproduction.posture.trial import RISKS

pytest.importorskip("mujoco")


@pytest.fixture(scope="module", autouse=True)
def one_thread():
    with threadpool_limits(1):  # as in every process of an experiment
        yield


def test_one_data_set_of_the_posture_reaches_the_published_figure(tmp_path):
    outcome = experiment.reproduce(tmp_path, trials=1, console=Console(quiet=True), adaptive=0)
    result = json.loads((tmp_path / "trials.json").read_text())["trials"][0]
    assert result["inconsistency"]["nUPE"] <= published.POSTURE_NUPE["inconsistency"][0]
    assert result["direct"]["nUPE"] > 50 * result["inconsistency"]["nUPE"]
    assert result["movements that meet the wall"] > 0.9
    assert "0.00291 ± 0.00313" in outcome.table
    for path in (*outcome.figures, *outcome.files):
        assert path.stat().st_size > 0


def test_fewer_data_sets_are_learnt_adaptively_as_the_table_says(tmp_path, monkeypatch):
    facts = dict.fromkeys(("samples the wall blocks", "movements that meet the wall"), 0.9)
    monkeypatch.setattr(
        experiment,
        "run_trial",
        lambda seed, *, choice, risks=RISKS: (
            {risk: {"nUPE": 0.1 * (seed + 1), "nCPE": 0.01} for risk in risks} | facts
        ),
    )
    outcome = experiment.reproduce(tmp_path, trials=3, console=Console(quiet=True), adaptive=2)
    assert "| adaptive |  | 0.15 ± 0.05 |" in outcome.table
    assert "over 3 data sets; of adaptive over the first 2 data sets." in outcome.table


def test_posture_demonstrations_obey_wall_and_limits():
    humanoid = OUR_OWN.load()
    D, blocked = demonstrate(humanoid, 4, 40, random_state=0)
    np.testing.assert_allclose(D.actions, np.einsum("nij,nj->ni", D.projections, D.policy), atol=1e-12)
    np.testing.assert_allclose(D.projections @ D.projections, D.projections, atol=1e-9)
    np.testing.assert_allclose(D.policy, -0.1 * (D.states - humanoid.outstretched))
    low, high = humanoid.robot.limits.T
    assert ((low <= D.states) & (D.states <= high)).all()
    assert 0 < blocked.mean() < 1
    again, _ = demonstrate(humanoid, 4, 40, random_state=0)
    np.testing.assert_array_equal(D.states, again.states)
