from sklearn.neighbors import KNeighborsRegressor

import unconstrain as uc
from tests.cli.commands import COLUMNS
from unconstrain import limit_cycle as toy
from unconstrain.recordings.text import write_csv


def test_parts_of_a_regressor_are_asked_for_and_named_by_an_option(run, tmp_path):
    demos = toy.demonstrate(6, random_state=0)
    write_csv(demos, tmp_path / "d.csv")
    uc.RegressorPolicy(KNeighborsRegressor(), risk="direct").fit(demos).save(tmp_path / "policy.skops")
    code, _, err = run("evaluate", "policy.skops", "d.csv", *COLUMNS)
    assert code == 2
    asked = err[err.index("--trusted") :].split()
    assert set(asked[1::2]) == {
        "sklearn.neighbors._kd_tree.KDTree",
        "sklearn.neighbors._regression.KNeighborsRegressor",
        "sklearn.metrics._dist_metrics.EuclideanDistance64",
    }
    code, out, err = run("evaluate", "policy.skops", "d.csv", *COLUMNS, *asked)
    assert code == 0, err
    assert "verdict:" in out
    code, _, err = run("rollout", "policy.skops", "--start", "0.5,0.5", "--steps", "5", *asked)
    assert code == 0, err
