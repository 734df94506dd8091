"""The rivals are what their papers say: each is held to what it must do exactly."""

import sys

import numpy as np
import pytest
from scipy.linalg import solve_continuous_lyapunov
from sklearn.mixture import GaussianMixture

from benchmarks import __main__ as program
from benchmarks.rivals import handwriting, lpv_ds, mixture, plants, primitives, simulated
from benchmarks.rivals.learnt import Field, Recorded
from benchmarks.rivals.methods import METHODS, Method, choose
from unconstrain.demonstrations import Demonstrations


def test_regression_on_one_gaussian_is_least_squares():
    rng = np.random.default_rng(0)
    X = rng.standard_normal((200, 3))
    U = X @ rng.standard_normal((3, 2)) + 0.3 * rng.standard_normal((200, 2)) + 1.0
    joint = GaussianMixture(1, reg_covar=0.0, random_state=0).fit(np.hstack([X, U]))
    design = np.hstack([X, np.ones((200, 1))])
    expected = design @ np.linalg.lstsq(design, U, rcond=None)[0]
    np.testing.assert_allclose(mixture.condition(joint, X), expected, rtol=1e-9)


def test_lpv_ds_finds_a_stable_linear_system_and_keeps_an_unstable_one_stable():
    rng = np.random.default_rng(1)
    X, h = rng.uniform(-1, 1, (300, 2)), rng.dirichlet(np.ones(3), 300)
    stable = np.array([[-1.0, 2.0], [-1.0, -0.5]])
    P = solve_continuous_lyapunov(stable.T, -np.eye(2))
    np.testing.assert_allclose(
        lpv_ds.fit_slopes(X, X @ stable.T, h, P), np.tile(stable, (3, 1, 1)), atol=2e-3
    )
    for A in lpv_ds.fit_slopes(X, X @ -stable.T, h, P):
        assert np.linalg.eigvalsh(A.T @ P + P @ A).max() < 0


def test_a_primitive_repeats_the_movement_it_imitates():
    pytest.importorskip("movement_primitives")
    pytest.importorskip("pytransform3d")
    t = np.linspace(0.0, 1.0, 200)
    rise = 10 * t**3 - 15 * t**4 + 6 * t**5
    X = np.stack([rise, np.sin(np.pi * rise)], axis=1)
    demos = Demonstrations(X, np.gradient(X, t, axis=0), time=t)
    learnt = primitives.learn(Recorded(demos, X[-1]), (25, False))
    paths = learnt.follow(X[:1], 1.0, 0.01)
    assert plants.compare_paths(paths, X[None]) < 0.02


def test_the_option_of_least_error_is_chosen_and_an_error_in_time_does_not_count():
    method = Method(lambda recorded, factor: Field(lambda X: factor * X), (1.0, -1.0, 2.0))
    assert (
        choose(method, lambda learnt, _: float(abs(learnt.velocity(np.ones((1, 1)))[0, 0] + 1)), [(None,)])
        == -1
    )
    line = np.linspace(0, 1, 101)[None, :, None] * np.ones((1, 1, 2))
    assert plants.compare_paths(line[:, ::2], line) < 0.01


def test_handwriting_says_what_it_needs(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["benchmarks", "rivals-handwriting"])
    with pytest.raises(SystemExit) as stopped:
        program.main()
    assert stopped.value.code == 2
    assert "give --data=FOLDER" in capsys.readouterr().err


def test_tables_say_what_does_not_apply_and_what_diverges():
    errors = {name: (None, plants.Errors(0.5, np.nan, 0.1)) for name in METHODS}
    written = simulated.tabulate({"cycle": errors | {"GMR": (7, plants.Errors(0.25, 0.125, np.nan))}})
    assert "| GMR | 0.25 |" in written
    assert written.count("| GMR |") == 2, "a method that has no path is left out of that table"
    drawn = {
        "Angle": handwriting.Errors(1.0, 0.1, np.inf, 900.0, 0.0),
        "GShape": handwriting.Errors(3.0, 0.3, 1.0, 700.0, 1.0),
    }
    written = handwriting.tabulate({"GMR": (7, drawn)})
    assert "| GMR | 2 | 2.00 | 0.200 | some diverge | 800 | 50% |" in written
    assert "| GMR | 1 | 3.00 | 0.300 | 1 | 700 | 100% |" in written
