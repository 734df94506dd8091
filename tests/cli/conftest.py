import pytest

from unconstrain import limit_cycle as toy
from unconstrain.recordings.text import write_csv


@pytest.fixture
def movements(tmp_path):
    """A recording of 40 movements, under a name that has to be quoted."""
    path = tmp_path / "my movements ü.csv"
    write_csv(toy.demonstrate(40, random_state=0), path)
    return path


@pytest.fixture
def policy(tmp_path):
    """A policy of two states, saved."""
    path = tmp_path / "kept.skops"
    demos = toy.demonstrate(3, random_state=0)
    import unconstrain as uc

    uc.ParametricPolicy().fit(demos.states, demos.actions).save(path)
    return path
