"""A small policy of two states, and a page of it."""

from dataclasses import replace

import pytest

import unconstrain as uc
from unconstrain import limit_cycle as toy


@pytest.fixture(scope="session")
def demos():
    """Half of it free; nobody says which."""
    return replace(toy.demonstrate(30, noise=0.05, free=0.5, random_state=0), projections=None)


@pytest.fixture(scope="session")
def policy(demos):
    return uc.ParametricPolicy(uc.NormalizedRBF(n_centers=36), alpha=1e-3).fit(demos)


@pytest.fixture
def page(policy, demos):
    pytest.importorskip("viser")
    opened = uc.view(policy, demos, port=0)
    assert opened.settle()
    yield opened
    opened.close()
