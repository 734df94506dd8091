"""The command line and Python have the same defaults."""

import inspect

import pytest

import unconstrain as uc
from unconstrain.cli.app import program
from unconstrain.cli.models import PLACEMENTS, RISKS
from unconstrain.diagnostics.spectrum import THRESHOLD
from unconstrain.features.centers import PLACEMENTS as LIBRARYS_PLACEMENTS
from unconstrain.fitting.observation import RISKS as LIBRARYS_RISKS
from unconstrain.policies import LocallyLinearPolicy


def defaults_of(command):
    return {option.name: option.default for option in program.commands[command].params}


@pytest.mark.parametrize("command", ["fit", "diagnose"])
def test_models_have_the_librarys_defaults(command):
    given = defaults_of(command)
    signature = inspect.signature(LocallyLinearPolicy).parameters
    assert given["alpha"] == signature["alpha"].default
    if "risk" in given:
        assert given["risk"] == signature["risk"].default


def test_diagnose_and_rollout_have_the_librarys_defaults():
    assert defaults_of("diagnose")["threshold"] == THRESHOLD
    signature = inspect.signature(uc.LocallyLinearPolicy.rollout).parameters
    for name in ("steps", "dt"):
        assert defaults_of("rollout")[name] == signature[name].default


def test_choices_are_the_librarys():
    assert set(RISKS) == set(LIBRARYS_RISKS)
    assert set(PLACEMENTS) == set(LIBRARYS_PLACEMENTS)
