"""A small policy of two states, and a page of it."""

import pytest

import unconstrain as uc
from unconstrain import limit_cycle as toy


@pytest.fixture(scope="session")
def demos():
    return toy.demonstrate(8, random_state=0)


@pytest.fixture(scope="session")
def policy(demos):
    return uc.LocallyLinearPolicy(n_centers=6, alpha=1e-3).fit(
        demos.states, demos.actions, groups=demos.episodes
    )


@pytest.fixture
def page(policy, demos):
    pytest.importorskip("viser")
    opened = uc.view(policy, demos, port=0)
    assert opened.settle()
    yield opened
    opened.close()
