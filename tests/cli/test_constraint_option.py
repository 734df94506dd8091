import numpy as np

import unconstrain as uc

COLUMNS = ("--state", "x1,x2,x3", "--action", "u1,u2,u3", "--episode", "episode")


def test_a_learnt_constraint_is_told_to_what_was_recorded_under_it(run, tmp_path):
    rng = np.random.default_rng(0)
    X = rng.uniform(-1, 1, size=(300, 3))
    N = np.eye(3) - np.outer([0.6, 0, 0.8], [0.6, 0, 0.8])
    wiped = uc.Demonstrations(X, (1 - 2 * X) @ N, np.repeat(range(6), 50))
    wiped.save(tmp_path / "wiped.npz")
    free = uc.Demonstrations(X, 1 - 2 * X, np.repeat(range(6), 50))
    free.save(tmp_path / "free.npz")
    assert run("constraints", "wiped.npz", "--out", "table.skops")[0] == 0
    told = ("--constraint", "table.skops", "--model", "linear")
    code, out, err = run("fit", "wiped.npz", *told)
    assert code == 0, err
    assert uc.load_policy("policy.skops").n_known_constraints_ == 300
    assert "what was in the way is known of 100% of the samples" in out
    code, out, err = run("evaluate", "policy.skops", "wiped.npz", "--constraint", "table.skops")
    assert code == 0, err
    assert "100.00%" in out
    code, out, err = run("diagnose", "wiped.npz", *told)
    assert code == 0, err
    assert "verdict: " in out
    movement = (
        "policy.skops",
        "--start=0,0,0",
        "--steps",
        50,
        "--constraint",
        "table.skops",
        "--beyond",
        "anywhere",
    )
    code, out, err = run("rollout", *movement)
    assert code == 0, err
    path = np.loadtxt("rollout.csv", delimiter=",", skiprows=1, usecols=(1, 2, 3))
    assert np.allclose(path @ [0.6, 0, 0.8], 0)
    assert np.ptp(path[:, 1]) > 0.1
    code, _, err = run("fit", "free.npz", *told, "--out", "other.skops")
    assert code == 2
    assert (
        "samples move across the constraint, so they were not recorded under it: leave out --constraint"
        in err
    )
    assert not (tmp_path / "other.skops").exists()
