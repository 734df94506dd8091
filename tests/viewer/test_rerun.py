"""Files for Rerun's viewer, read back: what is in them, and that the numbers are those of policy and recordings."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

import unconstrain as uc
from unconstrain.limit_cycle import demonstrate
from unconstrain.viewer import log_rerun

pytest.importorskip("rerun")


@pytest.fixture(scope="module")
def demos():
    known = demonstrate(26, 40, noise=0.02, free=0.5, random_state=0)
    return replace(known, projections=None, episode_labels=("rollout", *"abcdefghijklmnopqrstuvwxy"))


@pytest.fixture(scope="module")
def policy(demos):
    return uc.ParametricPolicy(uc.NormalizedRBF(n_centers=36)).fit(demos)


def read(path):
    """Return the columns of each entity, static and in time, and the overrides of the blueprint."""
    from rerun.chunk import RrdReader

    reader = RrdReader(path)
    static, timed = {}, {}
    for chunk in reader.stream().to_chunks():
        batch = chunk.to_record_batch()
        columns = {name: batch.column(name).to_pylist() for name in batch.schema.names}
        (static if chunk.is_static else timed).setdefault(chunk.entity_path, {}).update(columns)
    (layout,) = reader.blueprints()
    hidden = [c.entity_path for c in reader.stream(store=layout).to_chunks() if "overrides" in c.entity_path]
    return static, timed, hidden


def test_recordings_fields_and_rollout_are_in_the_file(tmp_path, demos, policy):
    path = tmp_path / "cycle.rrd"
    notes = log_rerun(policy, demos, path)
    static, timed, hidden = read(path)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["cycle.rrd"]

    first = demos.episode(0)
    np.testing.assert_allclose(timed["/states/recorded/rollout"]["Scalars:scalars"], first.states)
    np.testing.assert_allclose(timed["/actions/recorded/rollout"]["Scalars:scalars"], first.actions)
    np.testing.assert_allclose(
        np.concatenate(
            [timed[f"/contact/recorded/{name}"]["Scalars:scalars"] for name in demos.episode_labels]
        )[:, 0],
        policy.free_probability(demos),
    )
    assert timed["/demonstrations/now/a"]["sample"] == list(range(40, 80))
    seconds = [each.total_seconds() for each in timed["/demonstrations/now/a"]["time"]]
    np.testing.assert_allclose(seconds, demos.episode(1).time, atol=1e-6)
    free, colors = policy.free_probability(demos).reshape(26, 40), {0x009E73FF: [], 0xCC79A7FF: []}
    for name, chance in zip(demos.episode_labels, free, strict=True):
        for color, p in zip(
            static[f"/demonstrations/paths/{name}"]["LineStrips3D:colors"][0], chance, strict=False
        ):
            colors.setdefault(color, []).append(p)
    assert min(colors[0x009E73FF]) > 0.99, "green is free"
    assert max(colors[0xCC79A7FF]) < 0.01, "purple is constrained"

    fields = {name: static[f"/field/{name}"] for name in ("learnt", "ordinary_regression")}
    for name, field in fields.items():
        states = np.array(field["Arrows3D:origins"][0])[:, :2]
        vectors = np.array(field["Arrows3D:vectors"][0])[:, :2]
        shown = policy if name == "learnt" else policy.ordinary_regression()
        P = shown.predict(states)
        np.testing.assert_allclose(vectors[:, 0] * P[:, 1], vectors[:, 1] * P[:, 0], atol=1e-6)
        assert (np.einsum("nd,nd->n", vectors, P) >= 0).all()
    assert [entity for entity in hidden if entity.endswith("field/ordinary_regression/visualizers")]

    same = policy.rollout(first.states[0], steps=39, dt=0.02)
    np.testing.assert_allclose(timed["/states/rollout/0"]["Scalars:scalars"], same.states, atol=1e-9)
    said = static["/notes"]["TextDocument:text"][0][0]
    assert all(note in said for note in notes)
    assert any("39 steps of 0.02 s" in note for note in notes)


def test_a_rollout_that_is_given_is_written_and_of_five_states_three(tmp_path):
    rng = np.random.default_rng(0)
    X = rng.standard_normal((60, 5)).cumsum(axis=0) / 10
    demos = uc.Demonstrations(X, -X, state_names=list("abcde"))
    policy = uc.ParametricPolicy(risk="direct").fit(demos)
    notes = log_rerun(policy, demos, tmp_path / "five.rrd", coordinates=(4, 0, 2))
    _, timed, _ = read(tmp_path / "five.rrd")
    positions = np.array(timed["/demonstrations/now/0"]["Points3D:positions"])[:, 0]
    np.testing.assert_allclose(positions, X[:, [4, 0, 2]], atol=1e-6)
    assert "Of 5 states e, a, c are drawn." in notes
    assert any("no rollout" in note for note in notes)
    movement = policy.rollout(X[0], steps=5, dt=0.1)
    log_rerun(policy, demos, tmp_path / "five.rrd", rollout=movement, overwrite=True)
    _, timed, _ = read(tmp_path / "five.rrd")
    np.testing.assert_allclose(timed["/states/rollout/0"]["Scalars:scalars"], movement.states)


def test_mistakes_are_sentences_and_what_is_there_stays(tmp_path, demos, policy):
    path = tmp_path / "there.rrd"
    path.write_bytes(b"mine")
    with pytest.raises(uc.errors.DataError, match="exists: give overwrite="):
        log_rerun(policy, demos, path)
    assert path.read_bytes() == b"mine"
    with pytest.raises(uc.errors.DataError, match=r"ends in \.rrd"):
        log_rerun(policy, demos, tmp_path / "there.csv")
    with pytest.raises(uc.errors.DataError, match="one to three different states of 2"):
        log_rerun(policy, demos, tmp_path / "new.rrd", coordinates=(0, 2))
    with pytest.raises(uc.errors.DataError, match="have 3 states"):
        log_rerun(policy, uc.Demonstrations(np.ones((4, 3)), np.ones((4, 3))), tmp_path / "new.rrd")
    assert [p.name for p in tmp_path.iterdir()] == ["there.rrd"]


def test_without_the_extra_a_sentence_names_it(tmp_path, demos, policy, monkeypatch):
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(uc.errors.UnconstrainError, match=r"pip install 'unconstrain\[rerun\]'"):
        log_rerun(policy, demos, tmp_path / "a.rrd")


def test_the_package_does_not_import_rerun_or_viser():
    code = "import sys, unconstrain.viewer; print(sorted({'rerun', 'viser', 'trimesh'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
