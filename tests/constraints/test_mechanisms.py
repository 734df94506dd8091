"""Mechanisms: named as what they are, in any frame and unit, and not named where there is none."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import unconstrain as uc
from unconstrain.errors import DataError

DATA = Path(__file__).parents[3] / "shared" / "data"
TIMES = np.linspace(0.0, 1.0, 100)


def wander(rng, d):
    """A smooth path that fills d dimensions."""
    k = np.arange(1, 4)
    phases = 2.0 * np.pi * 0.6 * np.outer(TIMES, k)
    return 0.15 * (
        np.cos(phases) @ (rng.normal(size=(3, d)) / k[:, None]) + np.sin(phases) @ rng.normal(size=(3, d))
    )


def move(kind, rng):
    """A movement along a mechanism, about half a metre wide."""
    eased = 0.5 - 0.5 * np.cos(np.pi * TIMES)
    zeros = np.zeros_like(TIMES)
    if kind == "prismatic":
        return np.stack([0.4 * rng.uniform(0.7, 1.0) * eased, zeros + 0.2, zeros], axis=1)
    if kind == "hinge":
        angle = rng.uniform(0.0, 0.3) + rng.uniform(0.6, 1.2) * eased
        return np.stack([0.6 * np.cos(angle), 0.6 * np.sin(angle), zeros + 0.3], axis=1)
    Q = wander(rng, 3)
    if kind == "plane":
        return np.stack([Q[:, 0], Q[:, 1], zeros + 0.2], axis=1)
    if kind == "sphere":
        Q += np.array([0.0, 0.0, 0.4])
        return 0.5 * Q / np.linalg.norm(Q, axis=1, keepdims=True)
    if kind == "cylinder":
        return np.stack([0.3 * np.cos(4 * Q[:, 0]), 0.3 * np.sin(4 * Q[:, 0]), Q[:, 2]], axis=1)
    return Q


def record(kind, episodes=2, noise=1e-3, seed=0):
    """Positions and episodes of several movements."""
    rng = np.random.default_rng(seed)
    P = np.concatenate([move(kind, rng) for _ in range(episodes)])
    return P + noise * rng.normal(size=P.shape), np.repeat(np.arange(episodes), len(TIMES))


@pytest.mark.parametrize("kind", ["prismatic", "hinge", "plane", "sphere", "cylinder", "none"])
def test_a_mechanism_is_named_in_any_frame_and_unit(kind):
    P, episodes = record(kind)
    turn = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix()
    found = uc.constraints.find_mechanism(1000.0 * P @ turn.T + [5e3, -7e3, 2e3], episodes=episodes)
    assert (found.kind, found.places) == (kind, "one"), found.describe("xyz")
    if kind == "none":
        assert np.array_equal(found.projections(P), np.broadcast_to(np.eye(3), (len(P), 3, 3)))
        return
    shape = found.shapes[0]
    axis = {"prismatic": [1.0, 0.0, 0.0], "sphere": [0.0, 0.0, 0.0]}.get(kind, [0.0, 0.0, 1.0])
    assert abs(shape.direction @ turn @ axis) == pytest.approx(np.linalg.norm(axis), abs=1e-3)
    radius = {"hinge": 600.0, "sphere": 500.0, "cylinder": 300.0}.get(kind, np.inf)
    assert shape.radius == pytest.approx(radius, rel=0.02)


@pytest.mark.parametrize(("P", "words"), [
    (np.ones((50, 3)), "do not move"),
    (np.random.default_rng(0).normal(size=(5, 3)), "too few to tell a mechanism"),
    (np.full((50, 3), np.nan), "NaN or infinity in row 0"),
    (np.zeros((50, 7)), r"\(samples, 3\)"),
])  # fmt: skip
def test_what_is_no_movement_is_a_sentence(P, words):
    with pytest.raises(DataError, match=words):
        uc.constraints.find_mechanism(P)


@pytest.mark.parametrize("size", [1e-200, 1e200])
def test_exact_lines_of_any_size_are_lines(size):
    line = size * np.outer(TIMES, [0.0, 1.0, 0.0])
    found = uc.constraints.find_mechanism(line)
    assert found.kind == "prismatic"
    assert "record several" in found.describe("xyz")


def test_the_projections_let_through_what_the_mechanism_does():
    P, episodes = record("hinge", noise=0.0)
    U = np.gradient(P, axis=0)
    inside = np.tile((TIMES > 0.05) & (TIMES < 0.95), 2)
    N = uc.constraints.find_mechanism(P, episodes=episodes).projections(P)
    assert np.einsum("nij,nj->ni", N, U)[inside] == pytest.approx(U[inside], abs=1e-4)
    assert np.trace(N, axis1=1, axis2=2) == pytest.approx(1.0)


def test_a_door_that_was_moved_is_at_a_place_in_each_episode():
    P, episodes = record("hinge", episodes=3)
    P = P + np.array([[0.0, 0.0, 0.0], [0.3, 0.2, 0.0], [-0.2, 0.5, 0.1]])[episodes]
    found = uc.constraints.find_mechanism(P, episodes=episodes)
    assert (found.kind, found.places, len(found.shapes)) == ("hinge", "each", 3)
    apart = found.shapes[1].point - found.shapes[0].point
    assert np.linalg.norm(np.cross(apart - [0.3, 0.2, 0.0], [0.0, 0.0, 1.0])) < 0.03
    assert found.rows(P, episodes).shape == (len(P), 2, 3)
    with pytest.raises(DataError, match="another place in each of 3 episodes"):
        found.rows(P)


def test_no_plane_is_claimed_in_the_plane():
    rng = np.random.default_rng(1)
    assert uc.constraints.find_mechanism(wander(rng, 2)).kind == "none"


def test_a_hand_that_turns_tells_a_short_arc_from_a_line():
    rng = np.random.default_rng(0)
    angle = 0.25 * TIMES
    P = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1) + 2e-3 * rng.normal(size=(len(TIMES), 3))
    door = Rotation.from_rotvec(np.outer(angle, [0, 0, 1])).as_matrix()
    kept = np.broadcast_to(np.eye(3), door.shape)
    found = [uc.constraints.find_mechanism(P, rotations=R, play=0.01) for R in (kept, door)]
    assert [each.kind for each in found] == ["prismatic", "hinge"]
    assert "the hand keeps its orientation" in found[0].describe("xyz")
    assert "the hand turns with it" in found[1].describe("xyz")


def test_the_command_names_it_and_saves_its_rows(run, tmp_path):
    P, episodes = record("hinge", noise=1e-4)
    table = np.column_stack([P, np.gradient(P, axis=0), episodes])
    np.savetxt(tmp_path / "door.csv", table, delimiter=",", header="x,y,z,vx,vy,vz,run", comments="")
    columns = ["--state", "x,y,z", "--action", "vx,vy,vz", "--episode", "run"]
    code, out, err = run("constraints", "door.csv", *columns, "--model", "mechanism")
    assert code == 0, err
    assert "mechanism: hinge; " in out
    assert "axis through (x, y, z) = (" in out
    learnt = uc.load_constraint("constraint.skops")
    assert (learnt.kind_, learnt.n_constraints_) == ("hinge", 2)
    assert np.allclose(learnt.rows([[0.6, 0.0, 0.3]]), [[[0, 0, 1], [1, 0, 0]]], atol=1e-2)


@pytest.mark.skipif(not DATA.is_dir(), reason="the recordings are not part of the project")
def test_the_recorded_lid_is_a_hinge(run):
    columns = ["--state", "pos", "--action", "vel", "--time", "time", "--episode", "episode"]
    code, out, err = run(
        "constraints", DATA / "reaching" / "box_closing.mat", *columns, "--between", "0.56,0.8"
    )
    assert code == 0, err
    assert "mechanism: hinge at several places, one for each episode, of one direction" in out
