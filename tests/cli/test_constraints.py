import numpy as np
import pytest

import unconstrain as uc
from unconstrain.recordings.text import write_csv


@pytest.fixture
def wiping(tmp_path):
    """Motion in a plane of which 0.6 x + 0.8 z is constant."""
    rng = np.random.default_rng(0)
    along = np.stack([[0.8, 0.0, -0.6], [0.0, 1.0, 0.0]])
    U = rng.standard_normal((200, 2)) @ along
    write_csv(uc.Demonstrations(rng.standard_normal((200, 3)), U), tmp_path / "wipe.csv")
    return "wipe.csv"


@pytest.mark.parametrize("model", ["constant", "linear", "rbf"])
def test_the_equation_is_found(run, wiping, model, tmp_path):
    code, out, err = run(
        "constraints",
        wiping,
        "--state",
        "x1,x2,x3",
        "--action",
        "u1,u2,u3",
        "--model",
        model,
        "--figure",
        "c.png",
    )
    assert code == 0, err
    assert "0.800 u3 + 0.600 u1 ≈ 0" in out
    assert uc.load_constraint("constraint.skops").n_constraints_ == 1
    assert (tmp_path / "c.png").exists()


def test_centres_are_for_models_that_have_them(run, wiping):
    code, _, err = run("constraints", wiping, "--n-centers", "3")
    assert code == 2
    assert "--n-centers is for --model rbf, and this is constant" in err
