"""A checkpoint that cannot be written costs no work: it is refused before, or warned of and done without."""

import json
import re

import numpy as np
import pytest
from sklearn.preprocessing import FunctionTransformer

import unconstrain as uc
from unconstrain import storage

RNG = np.random.default_rng(0)
X = RNG.normal(size=(200, 2))
BATCHES = [(X[:100], np.sin(X[:100])), (X[100:], np.sin(X[100:]))]


def test_a_disk_that_fills_up_is_warned_of_and_the_fit_is_finished(tmp_path, monkeypatch):
    def full(*args):
        raise uc.errors.UnconstrainError("cannot write run.ckpt: no space left on device")

    monkeypatch.setattr("unconstrain.scaling.checkpoint.save_object", full)
    policy = uc.ParametricPolicy(risk="inconsistency", alpha=1e-6)
    with pytest.warns(UserWarning, match="no space left on device; the fit goes on"):
        uc.fit_stream(policy, BATCHES, checkpoint=tmp_path / "run.ckpt")
    assert policy.n_samples_seen_ == len(X)


def test_a_policy_that_cannot_be_saved_is_refused_before_the_work(tmp_path):
    policy = uc.ParametricPolicy(FunctionTransformer(lambda states: states), risk="inconsistency", alpha=1e-6)
    with pytest.raises(uc.errors.UnconstrainError, match="a lambda has no name"):
        uc.fit_stream(policy, BATCHES, checkpoint=tmp_path / "run.ckpt")
    assert not hasattr(policy, "model_")
    assert not list(tmp_path.iterdir())


def test_a_checkpoint_is_an_archive_of_its_own_kind(tmp_path):
    policy = uc.fit_stream(
        uc.ParametricPolicy(FunctionTransformer(np.tanh), risk="inconsistency", alpha=1e-6),
        BATCHES,
        checkpoint=tmp_path / "run",
    )
    assert storage.kind_of(tmp_path / "run") is storage.Kind.CHECKPOINT
    with pytest.raises(uc.errors.ArchiveError, match="holds a checkpoint, not a policy"):
        uc.load_policy(tmp_path / "run")
    again = uc.ParametricPolicy(FunctionTransformer(np.tanh), risk="inconsistency", alpha=1e-6)
    uc.fit_stream(again, BATCHES, checkpoint=tmp_path / "run")  # trusts what the policy itself holds
    np.testing.assert_array_equal(again.predict(X), policy.predict(X))


@pytest.mark.parametrize("spoil", ["weight", "shortest"])
def test_a_checkpoint_whose_sums_are_none_is_damaged(tmp_path, spoil):
    path = tmp_path / "run"
    uc.fit_stream(uc.ParametricPolicy(risk="inconsistency", alpha=1e-6), BATCHES, checkpoint=path)
    tree, arrays = storage.read(path, storage.Kind.CHECKPOINT)
    if spoil == "weight":
        name = next(name for name in arrays if name.endswith("weight"))
        arrays[name] = np.full_like(arrays[name], np.nan)
    else:
        text = json.dumps(tree)
        assert '"shortest": ' in text
        tree = json.loads(re.sub(r'"shortest": ([[{][^]}]*[]}]|[^,}]*)', '"shortest": "short"', text))
    storage.write(path, storage.Kind.CHECKPOINT, tree, arrays)
    with pytest.raises(uc.errors.ArchiveError, match=r"is damaged .*: delete it to start anew"):
        uc.fit_stream(uc.ParametricPolicy(risk="inconsistency", alpha=1e-6), BATCHES, checkpoint=path)
