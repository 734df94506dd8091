"""The adaptive experiment in small: its bounds, its likelihood, its parts, and what it says of them."""

import json
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from rich.console import Console
from scipy.io import savemat
from scipy.optimize import least_squares
from threadpoolctl import threadpool_limits

from reproduction.adaptive import (
    closed,
    experiment,
    figures,
    intervals,
    judgement,
    likelihood,
    recorded,
    simulated,
    tables,
    ways,
)
from reproduction.adaptive.bound import compute_bounds, find_prior_variance, informative_rows, is_free
from reproduction.adaptive.judgement import judge
from reproduction.adaptive.settings import Part, Reach
from reproduction.adaptive.ways import ADAPTIVE, DIRECT, INCONSISTENCY, TOLD
from unconstrain import demo, metrics
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import UnconstrainError
from unconstrain.features import NormalizedRBF
from unconstrain.limit_cycle import demonstrate
from unconstrain.policies import LocallyLinearPolicy, ParametricPolicy

QUIET = Console(quiet=True)
KNOWN = (DIRECT, INCONSISTENCY, TOLD)


@pytest.fixture(autouse=True)
def _one_thread():
    with threadpool_limits(1):
        yield


def _line_data(n=400, d=3, seed=0, free=0.3):
    """Samples of one linear policy, some free and the others under one random row."""
    rng = np.random.default_rng(seed)
    X = rng.normal(size=(n, 2))
    Pi = X @ np.random.default_rng(5).normal(size=(2, d)) + 0.3
    A = rng.normal(size=(n, d))
    N = np.eye(d) - np.einsum("ni,nj->nij", A, A) / np.sum(A**2, axis=1)[:, None, None]
    N[rng.random(n) < free] = np.eye(d)
    return Demonstrations(X, np.einsum("nij,nj->ni", N, Pi), policy=Pi, projections=N)


# --- The bound -------------------------------------------------------------------------------------------------------


def test_a_constrained_sample_informs_by_the_gradient_of_its_distance_from_the_sphere():
    data = _line_data()

    def distance(Pi):
        return np.linalg.norm(data.actions - Pi / 2, axis=1) - np.linalg.norm(Pi, axis=1) / 2

    steps = 1e-6 * np.eye(3)
    gradient = np.stack([distance(data.policy + h) - distance(data.policy - h) for h in steps], axis=1) / 2e-6
    rows, free = informative_rows(data), is_free(data.projections)
    assert 0.2 < free.mean() < 0.4
    np.testing.assert_allclose(np.abs(gradient[~free]), np.abs(rows[~free, 0]), atol=1e-8)
    np.testing.assert_allclose(distance(data.policy), 0.0, atol=1e-12)
    assert not rows[~free, 1:].any()
    np.testing.assert_array_equal(rows[free], np.broadcast_to(np.eye(3), rows[free].shape))
    assert is_free(np.array([np.eye(3), np.diag([1.0, 1, 0])])).tolist() == [True, False]


def test_both_bounds_are_reached_on_average():
    """Told's by least squares; the other's by least distances from spheres and poles, free samples recognised."""
    data, test, sigma = _line_data(), _line_data(seed=1), 0.02
    rng, policy, free = np.random.default_rng(2), ParametricPolicy(alpha=1e-9), is_free(data.projections)
    B, B_test = (np.column_stack([D.states, np.ones(len(D))]) for D in (data, test))
    true = np.linalg.lstsq(B, data.policy)[0]

    def misses(w, U):
        P = B @ w.reshape(true.shape)
        spheres = np.linalg.norm(U - P / 2, axis=1) - np.linalg.norm(P, axis=1) / 2
        return np.concatenate([spheres[~free], (U - P)[free].ravel()])

    told, unknown = [], []
    for _ in range(60):
        U = data.actions + sigma * rng.normal(size=data.actions.shape)
        policy.fit(data.states, U, projections=data.projections)
        told.append(metrics.unconstrained_policy_error(test.policy, policy.predict(test.states)))
        w = least_squares(misses, true.ravel(), args=(U,)).x
        unknown.append(metrics.unconstrained_policy_error(test.policy, B_test @ w.reshape(true.shape)))
    bounds, variance = compute_bounds(policy.model_, data, test, sigma), test.policy.var(axis=0).sum()
    assert bounds.told == pytest.approx(np.mean(told) / variance, rel=0.2)
    assert bounds.unknown == pytest.approx(np.mean(unknown) / variance, rel=0.2)
    assert bounds.unknown > 1.2 * bounds.told


def test_where_everything_is_free_there_is_nothing_to_tell():
    data, test = _line_data(), _line_data(seed=1)
    everything = replace(data, actions=data.policy, projections=np.broadcast_to(np.eye(3), (len(data), 3, 3)))
    model = ParametricPolicy().fit(data.states, data.policy).model_
    free, some = (compute_bounds(model, each, test, 0.1) for each in (everything, data))
    assert free.unknown == free.told < some.told


def test_the_prior_is_as_wide_as_the_policy_s_parameters():
    rng = np.random.default_rng(0)
    X = rng.normal(size=(300, 30))
    model = ParametricPolicy(risk="inconsistency").fit(X, X).model_
    for deviation in (0.1, 10.0):
        Pi = np.column_stack([X, np.ones(300)]) @ (deviation * rng.normal(size=(31, 30)))
        v = find_prior_variance(model, X, Pi, 1e-3)
        assert v == pytest.approx(deviation**2, rel=0.2)


def test_bounds_are_there_for_every_model():
    data = demonstrate(12, free=0.5, random_state=0)
    for policy in (LocallyLinearPolicy(n_centers=4), ParametricPolicy(NormalizedRBF(9)), demo.make_policy()):
        policy.fit(data.states, data.actions, projections=data.projections)
        small, large = (compute_bounds(policy.model_, data, data, sigma) for sigma in (1e-4, 1e-2))
        assert 1.0 < small.unknown / small.told < 4.0
        assert large.told > small.told


# --- The likelihood of held-out actions ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "density", [likelihood.log_free, likelihood.log_constrained, likelihood.log_likelihood]
)
@pytest.mark.parametrize("length", [0.0, 0.02, 1.0])
def test_densities_integrate_to_one(density, length):
    axis = np.linspace(-2.5, 2.5, 301)
    U = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    P = np.tile(length * np.array([0.6, 0.8]), (len(U), 1))
    total = np.exp(density(U, P, likelihood.Spread(0.1, 0.2, 0.4))).sum() * (axis[1] - axis[0]) ** 2
    assert total == pytest.approx(1.0, abs=1e-3)


def test_the_sphere_s_density_is_that_of_its_points_with_noise():
    rng, d = np.random.default_rng(0), 3
    p = np.array([0.8, 0.0, 0.6])
    points = rng.normal(size=(200_000, d))
    points = p / 2 + points / (2 * np.linalg.norm(points, axis=1, keepdims=True))
    for u in (0.5 * p, np.array([0.1, 0.4, 0.2]), 1.2 * p):
        near = np.exp(-np.sum((points - u) ** 2, axis=1) / (2 * 0.2**2)) / (2 * np.pi * 0.2**2) ** (d / 2)
        assert np.exp(likelihood.log_sphere(u[None], p[None], 0.2))[0] == pytest.approx(near.mean(), rel=0.02)


def test_noise_and_share_are_found_again():
    data = _line_data(1500, free=0.5)
    noisy, deviation = ways.add_noise(data, 0.05, np.random.default_rng(1))
    found = likelihood.Spread.find(noisy.actions, data.policy)
    assert found.noise == pytest.approx(deviation, rel=0.15)
    assert found.free == pytest.approx(is_free(data.projections).mean(), abs=0.08)
    assert found.speed < 0.05


# --- Ways and noise --------------------------------------------------------------------------------------------------


def test_noise_is_a_share_of_the_rms_action_and_the_same_numbers_at_every_level():
    data = _line_data(4000)
    some, more = (ways.add_noise(data, share, np.random.default_rng(3)) for share in (0.05, 0.1))
    np.testing.assert_array_equal(some[0].states, data.states)
    difference = some[0].actions - data.actions
    assert some[1] == pytest.approx(0.05 * np.sqrt(np.mean(data.actions**2)))
    np.testing.assert_allclose(difference.std(axis=0), some[1], rtol=0.05)
    np.testing.assert_allclose(more[0].actions - data.actions, 2 * difference, atol=1e-12)


def test_told_is_the_inconsistency_with_all_projections():
    data = demonstrate(8, free=0.5, random_state=0)
    told = ways.learn(demo.make_policy(), TOLD, data, data.projections)
    assert told.n_known_constraints_ == len(data)
    assert ways.learn(demo.make_policy(), INCONSISTENCY, data, data.projections).n_known_constraints_ == 0
    assert set(KNOWN) <= set(ways.list_ways()) <= set(ways.WAYS)


def test_a_cell_has_errors_bounds_and_what_was_found():
    data, test = demonstrate(20, free=0.5, random_state=0), demonstrate(10, random_state=1)
    cell = ways.compare_ways(demo.make_policy(), ways.WAYS, data, test, 0.05, np.random.default_rng(2))
    assert max(cell[ADAPTIVE], cell[TOLD]) < cell[INCONSISTENCY] < cell[DIRECT]
    assert cell["bound"] > cell["told bound"] > 0
    assert cell["determined"] == 1.0
    assert cell["noise"] == pytest.approx(cell["true noise"], rel=0.2)
    assert cell["free"] == pytest.approx(cell["true free"], abs=0.1)
    assert cell["contact right"] > 0.9
    assert cell["true free"] == is_free(data.projections).mean()
    clean = ways.compare_ways(demo.make_policy(), ways.WAYS, data, test, 0.0, np.random.default_rng(2))
    assert clean["true noise"] == 0.0
    assert 0 < clean["bound"] < cell["bound"]


def test_intervals_are_compared_with_errors():
    data, test = demonstrate(20, free=0.5, random_state=0), demonstrate(10, random_state=1)
    cell = intervals.compare_intervals(demo.make_policy(), data, test, 0.05, np.random.default_rng(2))
    assert set(cell) == {ADAPTIVE, "inside", "width"}
    assert 0.7 <= cell["inside"] <= 1.0
    assert 0.1 < cell["width"] < 10.0


# --- Judgement -------------------------------------------------------------------------------------------------------

CELL = {DIRECT: 1.0, INCONSISTENCY: 0.5, ADAPTIVE: 0.03, TOLD: 0.02}
CELL |= {"bound": 0.02, "told bound": 0.01, "true noise": 0.1, "determined": 1.0, "contact right": 0.98}
CELL |= {"inside": 0.88, "width": 1.2}


@pytest.mark.parametrize(
    ("change", "reach", "words", "said"),
    [
        ({}, Reach(told=1.6), "≤ 1.6 x told", "yes"),
        ({}, Reach(told=1.4), "≤ 1.4 x told", "no"),
        ({"bound": 0.04}, Reach(told=1.4), "≤ 1.4 x told (below the bound)", "no"),
        ({"bound": 0.04, "true noise": 0.0}, Reach(told=1.4), "≤ 1.4 x told", "no"),
        ({}, Reach(bound=1.3), "≤ 1.3 x bound x told", "yes"),
        ({"determined": 0.9}, Reach(bound=1.3), "", ""),
        ({"told bound": 0.0001}, Reach(bound=1.3), "≤ 1.3 x bound x told", "yes, weak"),
        ({}, Reach(best=0.05), "≤ 0.05 x best other", "no"),
        ({}, Reach(direct=1.0, inconsistency=0.1), "≤ 1 x direct, ≤ 0.1 x inconsistency", "yes"),
        ({}, Reach(told=2, contact=0.97), "≤ 2 x told, contact ≥ 97 %", "yes"),
        ({}, Reach(told=2, contact=0.99), "≤ 2 x told, contact ≥ 99 %", "no"),
        ({}, Reach(inside=(0.85, 0.95)), "85..95 %", "yes"),
        ({"inside": 0.96}, Reach(inside=(0.85, 0.95)), "85..95 %", "no"),
        ({}, Reach(), "", ""),
        ({ADAPTIVE: 1e-12, TOLD: 1e-16, "true noise": 0.0}, Reach(told=2), "≤ 2 x told", "yes"),
        ({ADAPTIVE: 1.1}, Reach(likelihood=True), "≥ both others", "yes"),
        ({ADAPTIVE: 0.9}, Reach(likelihood=True), "≥ both others", "no"),
    ],
)
def test_what_was_reached_is_judged(change, reach, words, said):
    verdict = judge(CELL | change, reach)
    assert (verdict.reach, str(verdict)) == (words, said)


def test_without_adaptive_nothing_is_judged_and_what_is_asked_still_stands():
    cell = {name: value for name, value in CELL.items() if name != ADAPTIVE}
    for reach in (Reach(told=2), Reach(likelihood=True)):
        verdict = judge(cell, reach)
        assert verdict.reached is None
        assert verdict.reach


def test_tables_and_findings_say_what_was_reached():
    part = Part(
        "Some data", "errors", run=None, settings={}, reaches={"a": Reach(told=2)}, overall=Reach(direct=1.0)
    )
    results = [{"a": CELL, "b": CELL}, {"a": CELL | {ADAPTIVE: 0.09}}]
    table = tables.write_part(part, results)
    (row,) = [line for line in table.splitlines() if line.startswith("| a |")]
    assert row.startswith("| a | 1 | 0.5 | 0.06 | 0.02 | 3 | 2 | 0.03 | 88% | 1.2 | ≤ 2 x told | no |")
    assert "| mean | 1 | 0.5 | 0.045 | 0.02 |" in table
    assert "Means over 2 data sets: errors. Told: the true projections." in table
    (finding,) = tables.list_findings({"x": part}, {"x": results})
    assert finding == "Some data: reached in 1 of 2 rows; missed: a."
    assert tables.list_findings({"x": replace(part, overall=None, reaches={})}, {"x": results}) == ()


# --- Parts -----------------------------------------------------------------------------------------------------------


def test_every_cell_of_the_cycle_has_its_reach(tmp_path):
    result = simulated.run_cycle(8, KNOWN, None, 0, test_movements=4)
    json.dumps(result)
    assert set(result) == set(simulated.SIMULATED["cycle"].reaches)
    assert "25 % free, 5 % noise" in result
    for noise in simulated.NOISE:
        free = result[simulated.name_cycle_cell(1.0, noise)]
        assert free[DIRECT] == pytest.approx(free[TOLD], rel=1e-3)
        assert free["bound"] == free["told bound"]
    assert simulated.SIMULATED["cycle"].reaches["50 % free, 0 % noise"].told == 2.0
    figures.plot_cycle([result]).savefig(tmp_path / "cycle.png")


def test_the_closed_form_in_small():
    part = closed.CLOSED["closed"]
    result = closed.run_closed(part.ways, None, 0, movements=(12,), episodes=8)
    assert "arm, 1-2-3, decoupled, 10 % noise" in result
    clean, noisy = (result[f"limit cycle, 12 movements, 0 % free, {noise} % noise"] for noise in (0, 5))
    assert clean["noise"] < 0.1 * noisy["noise"]
    assert noisy["noise"] == pytest.approx(noisy["true noise"], rel=0.3)
    table = tables.write_part(part, [result])
    assert "| direct | inconsistency | corrected | told | corrected / told |" in table
    assert "τ found" not in table


def test_the_arm_in_small():
    result = simulated.run_arm(KNOWN, None, 0, episodes=8)
    assert set(result) == set(simulated.SIMULATED["arm"].reaches)
    clean = result[simulated.name_arm_cell(2.0, "2-4-6", "decoupled, 15 knots", 0.0)]
    assert clean[TOLD] < 1e-9
    noisy = result[simulated.name_arm_cell(2.0, "2-4-6", "decoupled, 15 knots", 0.02)]
    assert noisy["bound"] > noisy["told bound"]


def test_bodies_and_physics_in_small():
    pytest.importorskip("mink")
    grasps = simulated.run_grasp(KNOWN, None, 0, grasps=4)
    assert list(grasps) == ["0 % noise", "2 % noise", "5 % noise"]
    for cell in grasps.values():
        assert cell[TOLD] < cell[INCONSISTENCY] < cell[DIRECT]
    json.dumps(simulated.run_bodies(KNOWN, None, 0, episodes=10))
    physics = simulated.run_physics(KNOWN, None, 0, episodes=10)
    assert list(physics) == list(simulated.MODELS)


def test_contact_is_drawn(tmp_path):
    rng = np.random.default_rng(0)
    X, U = rng.normal(size=(2, 50, 6))
    demos = Demonstrations(X, U, episodes=np.repeat([0, 1], [20, 30]))
    figure = figures.plot_contact(demos, rng.random(50) < 0.5, rng.random(50))
    figure.savefig(tmp_path / "contact.png")
    panels = {ax.get_title(): ax for ax in figure.axes}
    for title in ("contact as inferred", "contact as it was"):
        assert len(panels[title].collections) == 2, "a hand each"
    bars = panels["upper bar: as inferred, lower bar: as it was"].images
    assert [bar.get_array().shape for bar in bars] == [(1, 20)] * 2 + [(1, 30)] * 2


@pytest.fixture
def data_folder(tmp_path):
    """Two shapes, and ten reaches, in files laid out as the public ones."""
    folder, rng = tmp_path / "data", np.random.default_rng(0)
    (folder / "handwriting").mkdir(parents=True)
    (folder / "reaching").mkdir()

    def move(n, k):
        X = rng.uniform(-1, 1, size=(60, n)) + 0.1 * k
        return X, -2 * X + 0.05 * rng.normal(size=X.shape)

    for shape in ("Line", "Curve"):
        pairs = [move(2, k) for k in range(7)]
        savemat(
            folder / "handwriting" / f"{shape}.mat", {"demos": [{"pos": X.T, "vel": U.T} for X, U in pairs]}
        )
    reaches = [{"pos": X, "vel": U} for X, U in (move(3, k) for k in range(10))]
    savemat(folder / recorded.REACHING, {"dataset": reaches})
    return folder


def test_recordings_are_learnt(data_folder):
    shapes = recorded.run_handwriting(KNOWN, data_folder, 0)
    assert list(shapes) == ["Curve", "Line"]
    for cell in shapes.values():
        assert set(cell) == {DIRECT, INCONSISTENCY}
        assert 0.0 < cell[DIRECT] < 0.2
    assert recorded.run_handwriting(KNOWN, data_folder, 1) != shapes
    first, eighth = (recorded.run_reaching(KNOWN, data_folder, k) for k in (0, 8))
    assert len(first) == 3
    assert list(eighth) == ["bent and 2 free, on the other free"], (
        "there are only five to leave out of each kind"
    )


def test_every_split_of_the_reaches_holds_out_what_it_does_not_show():
    listed = recorded.list_reaching_splits()
    assert [len(each) for each in listed.values()] == [5, 5, 10]
    for train, test in (split for each in listed.values() for split in each):
        assert not set(train) & set(test)
    assert len({tuple(test) for _, test in listed["bent and 2 free, on the other free"]}) == 10


def test_the_likelihood_of_held_out_blocks_prefers_the_truth():
    rng = np.random.default_rng(0)
    X = rng.normal(size=(300, 2))
    demos = Demonstrations(X, -X + 0.05 * rng.normal(size=X.shape))
    cell = recorded._measure_blocks((DIRECT, TOLD), demos)
    assert list(cell) == [DIRECT]
    spread = likelihood.Spread(0.05, 1e-3, 0.99)
    assert cell[DIRECT] == pytest.approx(likelihood.log_likelihood(demos.actions, -X, spread).mean(), abs=0.1)


# --- The experiment --------------------------------------------------------------------------------------------------


def test_the_experiment_goes_on_and_says_what_is_left_out(tmp_path, monkeypatch, data_folder):
    small = {"cycle": replace(simulated.SIMULATED["cycle"], run=partial(_small_cycle, 6))}
    parts = small | {name: recorded.RECORDED[name] for name in ("handwriting", "surfaces")}
    monkeypatch.setattr(experiment, "PARTS", parts)
    monkeypatch.setattr(experiment, "list_ways", lambda: ways.WAYS)
    monkeypatch.setattr(recorded, "describe_found", lambda *_: {})
    outcome = experiment.reproduce(tmp_path / "out", trials=1, console=QUIET, data=data_folder)
    assert "### Limit cycle, 40 movements" in outcome.table
    assert "| Line |" in outcome.table
    left_out = [sentence for sentence in outcome.findings if "left out" in sentence]
    assert len(left_out) == 1
    assert "does not hold planer_circle.csv and curve_circle.csv" in left_out[0]
    assert all(path.stat().st_size > 1000 for path in outcome.figures)
    assert set(json.loads((tmp_path / "out" / "trials.json").read_text())) == {"cycle", "handwriting"}
    monkeypatch.setattr(simulated, "compare_ways", None)
    again = experiment.reproduce(tmp_path / "out", trials=1, console=QUIET)
    assert again.table in outcome.table
    assert sum(experiment.NEEDED in sentence for sentence in again.findings) == 2


def _small_cycle(movements, given, folder, seed):
    return simulated.run_cycle(movements, given, folder, seed, test_movements=4)


def test_one_part_alone_must_have_what_it_needs(tmp_path):
    for options, sentence in (
        ({"part": "toy"}, "no part 'toy': choose one of cycle, cycle400, arm"),
        ({"part": "handwriting"}, "give the folder of recordings as --data"),
        ({"part": "reaching", "data": tmp_path}, "does not hold reaching/reaching_cluttered.mat"),
        ({"data": tmp_path / "nowhere"}, "there is no folder"),
    ):
        with pytest.raises(UnconstrainError, match=sentence):
            experiment.reproduce(tmp_path / "out", console=QUIET, **options)
    assert not (tmp_path / "out").exists()


def test_a_file_that_is_none_is_told(tmp_path):
    (tmp_path / "a.mat").write_text("not MATLAB's")
    savemat(tmp_path / "b.mat", {"demos": [{"pos": 1}]})
    for name in ("a.mat", "b.mat", "c.mat"):
        with pytest.raises(UnconstrainError, match="cannot be read as MATLAB's list 'demos'"):
            recorded.load_demonstrations(tmp_path / name, "demos", transposed=True)


def test_means_are_over_the_trials_that_have_a_cell():
    means = judgement.average([{"a": {DIRECT: 1.0}}, {"a": {DIRECT: 3.0}, "b": {DIRECT: 4.0}}])
    assert means == {"a": {DIRECT: 2.0}, "b": {DIRECT: 4.0}}
    assert judgement.average_cells(means) == {DIRECT: 3.0}


def test_the_spheres_picture_shows_actions_near_it_and_near_its_pole():
    (ax,) = figures.plot_sphere().axes
    sphere, constrained, free = (line.get_xydata() for line in ax.lines[:3])
    center = (sphere.min(axis=0) + sphere.max(axis=0)) / 2
    radius = np.linalg.norm(sphere - center, axis=1).mean()
    assert abs(np.linalg.norm(constrained - center, axis=1) - radius).max() < 0.2
    assert np.linalg.norm(free - 2 * center, axis=1).max() < 0.2
