"""Constraints of plants are found where the model can hold them, and those of recorded surfaces likewise."""

from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

import unconstrain as uc
from reproduction.constraints import experiment
from reproduction.constraints.settings import make_settings
from reproduction.constraints.surfaces import load_surfaces
from unconstrain.constraints.learnt.base import held_out_projections

RECORDINGS = Path(__file__).parents[2] / "../shared/data"


def error(D, found):
    """The nPPE of a learnt constraint."""
    ppe = uc.metrics.projected_policy_error(D.policy, D.projections, found.predict(D.states))
    return uc.metrics.normalized(ppe, D.policy)


def test_the_experiment_finds_every_constraint_it_can_hold_without_noise():
    for name, setting in make_settings(0).items():
        D = setting.record()
        found = setting.estimator.fit(D.states, D.actions, groups=D.episodes)
        assert error(D, found) < 1e-20, name


def test_without_the_extra_the_experiment_says_what_it_left_out(tmp_path, monkeypatch):
    def missing():
        raise uc.errors.UnconstrainError("robots are simulated by MuJoCo, which is not here")

    monkeypatch.setattr(experiment, "import_mujoco", missing)
    outcome = experiment.reproduce(tmp_path, trials=1, console=Console(quiet=True))
    assert (
        "Measured constraints are left out: robots are simulated by MuJoCo, which is not here."
        in outcome.findings
    )
    assert outcome.findings[-1].startswith("The recorded surfaces are left out")


@pytest.mark.skipif(not RECORDINGS.is_dir(), reason="the recorded surfaces are not here")
def test_the_recorded_surfaces_are_found():
    flat, curved = load_surfaces(RECORDINGS)
    constant = uc.ConstantConstraint().fit(flat.states, flat.actions, groups=flat.blocks(10))
    assert constant.n_constraints_ == 1
    plane = np.linalg.svd(flat.states - flat.states.mean(axis=0), full_matrices=False)[2][-1]
    angle = np.degrees(np.arccos(abs(plane @ constant.rows_[0])))
    assert angle < 3 * np.degrees(constant.uncertainty_)
    errors = [
        uc.metrics.projected_observation_error(
            curved.actions,
            held_out_projections(each, curved.states, curved.actions, curved.blocks(10)),
        )
        for each in (uc.ConstantConstraint(1), uc.FeatureConstraint(uc.NormalizedRBF(5)))
    ]
    assert errors[1] < errors[0] / 4
