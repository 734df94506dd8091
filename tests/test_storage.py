import json
import zipfile
from contextlib import suppress

import numpy as np
import pytest
from sklearn.preprocessing import FunctionTransformer, SplineTransformer

import unconstrain as uc
from unconstrain import limit_cycle as toy

DEMOS = toy.demonstrate(n_episodes=6, random_state=0)


@pytest.mark.parametrize(
    "policy",
    [
        uc.ParametricPolicy(),
        uc.ParametricPolicy(SplineTransformer(), alpha="cv"),
        uc.ParametricPolicy(uc.NormalizedRBF(), risk="direct"),
        uc.LocallyLinearPolicy(alpha="cv"),
    ],
)
def test_a_loaded_policy_predicts_and_goes_on_learning_as_the_saved_one(policy, tmp_path):
    policy.fit(DEMOS.states, DEMOS.actions, groups=DEMOS.episodes)
    policy.save(tmp_path / "policy.skops")
    loaded = uc.load_policy(tmp_path / "policy.skops")
    np.testing.assert_array_equal(loaded.predict(DEMOS.states), policy.predict(DEMOS.states))
    more = toy.demonstrate(n_episodes=3, random_state=1)
    for each in (policy, loaded):
        each.partial_fit(more.states, more.actions, groups=more.episodes + 100)
    np.testing.assert_array_equal(loaded.predict(DEMOS.states), policy.predict(DEMOS.states))


@pytest.fixture
def saved(tmp_path):
    path = tmp_path / "policy.skops"
    uc.ParametricPolicy().fit(DEMOS.states, DEMOS.actions).save(path)
    return path


def test_holds_no_pickle(saved):
    with zipfile.ZipFile(saved) as archive:
        assert not any(name.endswith((".pkl", ".pickle")) for name in archive.namelist())
        assert json.loads(archive.read("unconstrain.json"))["release"] == uc.__version__


def test_a_missing_file(tmp_path):
    with pytest.raises(uc.errors.PolicyFileError, match="no such policy file"):
        uc.load_policy(tmp_path / "nothing.skops")


def test_a_file_that_is_not_one_of_ours(tmp_path):
    (tmp_path / "notes.txt").write_text("hello")
    with zipfile.ZipFile(tmp_path / "other.zip", "w") as archive:
        archive.writestr("a.txt", "hello")
    with pytest.raises(uc.errors.PolicyFileError, match="not a policy saved by unconstrain"):
        uc.load_policy(tmp_path / "notes.txt")
    with pytest.raises(uc.errors.PolicyFileError, match="not a policy saved by unconstrain"):
        uc.load_policy(tmp_path / "other.zip")


@pytest.mark.parametrize("share", [0.1, 0.5, 0.95])
def test_a_damaged_file(saved, share):
    whole = saved.read_bytes()
    saved.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(uc.errors.PolicyFileError, match="is damaged"):
        uc.load_policy(saved)


def test_bytes_flipped_anywhere_are_told_or_harmless(saved):
    whole, rng = saved.read_bytes(), np.random.default_rng(0)
    expected = uc.load_policy(saved).predict(DEMOS.states)
    for position in rng.integers(len(whole), size=60):
        broken = bytearray(whole)
        broken[position] ^= 0xFF
        saved.write_bytes(bytes(broken))
        with suppress(uc.errors.PolicyFileError):
            np.testing.assert_array_equal(uc.load_policy(saved).predict(DEMOS.states), expected)


def test_a_file_from_a_newer_release(saved, tmp_path):
    newer = tmp_path / "newer.skops"
    with zipfile.ZipFile(saved) as old, zipfile.ZipFile(newer, "w") as new:
        for name in old.namelist():
            note = (
                json.dumps({"format": 99, "release": "9.0"}) if name == "unconstrain.json" else old.read(name)
            )
            new.writestr(name, note)
    with pytest.raises(uc.errors.PolicyFileError, match=r"written by unconstrain 9\.0.*upgrade"):
        uc.load_policy(newer)


def test_types_from_elsewhere_are_named_not_loaded(tmp_path):
    policy = uc.ParametricPolicy(FunctionTransformer(json.dumps))
    policy.features_ = policy.weights_ = None
    policy.moments_ = []
    policy.save(tmp_path / "strange.skops")
    with pytest.raises(uc.errors.PolicyFileError, match=r"json.*trusted="):
        uc.load_policy(tmp_path / "strange.skops")


def test_an_interrupted_save_leaves_the_old_file(saved, monkeypatch):
    before = saved.read_bytes()
    policy = uc.load_policy(saved)

    def interrupted(*args, **kwargs):
        raise KeyboardInterrupt

    monkeypatch.setattr("skops.io.dump", interrupted)
    with pytest.raises(KeyboardInterrupt):
        policy.save(saved)
    assert saved.read_bytes() == before
    assert [p.name for p in saved.parent.iterdir()] == [saved.name]
