"""Moments in files: they come back bit by bit, add across days, and let a policy go on where it stopped."""

import copy
import pickle

import numpy as np
import pytest

import unconstrain as uc
from unconstrain import storage
from unconstrain.fitting import moments
from unconstrain.fitting.solve import EpisodeFolds
from unconstrain.samples import Samples

RNG = np.random.default_rng(0)
X = RNG.normal(size=(300, 2))
U = np.sin(X) @ [[-1.0, 0.5], [-0.5, -1.0]]
GROUPS = np.arange(300) // 20


def fitted(alpha="cv"):
    return uc.ParametricPolicy(risk="inconsistency", alpha=alpha).fit(X[:200], U[:200], groups=GROUPS[:200])


def assert_equal(a, b):
    for name in ("H", "g", "squares", "weight", "n_samples"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
    assert (a.everywhere is None) == (b.everywhere is None)
    if a.everywhere is not None:
        assert_equal(a.everywhere, b.everywhere)


def test_moments_come_back_bit_by_bit(tmp_path):
    folds = fitted().moments_
    moments.save(folds, tmp_path / "folds.npz")
    for a, b in zip(moments.load(tmp_path / "folds.npz"), folds, strict=True):
        assert_equal(a, b)
    moments.save(folds[0], tmp_path / "one.npz")
    assert_equal(moments.load(tmp_path / "one.npz"), folds[0])
    moments.save([None, folds[0]], tmp_path / "gap.npz")
    empty, full = moments.load(tmp_path / "gap.npz")
    assert empty is None
    assert_equal(full, folds[0])


def test_moments_of_local_models_are_copied_pickled_and_saved_alike(tmp_path):
    (of_models,) = uc.LocallyLinearPolicy(n_centers=4, alpha=1e-6).fit(X, U).moments_
    moments.save(of_models, tmp_path / "local.npz")
    for other in (
        copy.deepcopy(of_models),
        pickle.loads(pickle.dumps(of_models)),
        moments.load(tmp_path / "local.npz"),
    ):
        assert_equal(other, of_models)
        assert other.H.flags.writeable


def test_moments_of_two_days_add_to_those_of_both(tmp_path):
    yesterday = fitted(1e-6)
    moments.save(yesterday.moments_, tmp_path / "yesterday.npz")
    today, both = (
        yesterday.resume().empty(),
        yesterday.resume().empty(),
    )  # under the same model: features and all
    today.add(Samples(X[200:], U[200:]))
    both.add(Samples(X, U))
    total, both = moments.load(tmp_path / "yesterday.npz")[0] + today.moments(), both.moments()
    np.testing.assert_allclose(total.H, both.H, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(total.g, both.g, rtol=1e-12, atol=1e-12)
    assert total.n_samples == 300


def test_a_resumable_policy_goes_on_where_it_stopped(tmp_path):
    fitted().save(tmp_path / "yesterday.skops", resumable=True)
    today = uc.load_policy(tmp_path / "yesterday.skops").partial_fit(X[200:], U[200:], groups=GROUPS[200:])
    both = uc.ParametricPolicy(risk="inconsistency", alpha="cv").fit(X, U, groups=GROUPS)
    assert today.resume().folds.fold_of == both.resume().folds.fold_of
    np.testing.assert_allclose(today.predict(X), both.predict(X), rtol=1e-9, atol=1e-12)


def test_labels_of_any_kind_survive():
    for labels in (["b", "a", "b"], [3, 1, 3], [1.5, 2.5, 1.5]):
        folds = EpisodeFolds(2)
        np.testing.assert_array_equal(folds.assign(np.array(labels), 3), [0, 1, 0])
        tree, arrays = storage.encode(folds)
        again = storage.decode(tree, arrays)
        assert again.fold_of == folds.fold_of
        assert again.n_folds == 2


def missing_array(path):
    tree, arrays = storage.read(path, storage.Kind.MOMENTS)
    storage.write(path, storage.Kind.MOMENTS, tree, {k: v for k, v in arrays.items() if k != "1.g"})


def other_shape(path):
    tree, arrays = storage.read(path, storage.Kind.MOMENTS)
    storage.write(path, storage.Kind.MOMENTS, tree, arrays | {"1.g": np.zeros((7, 1))})


def other_things(path):
    storage.write(path, storage.Kind.MOMENTS, {"works": True, "value": 3}, {})


@pytest.mark.parametrize(
    ("spoil", "sentence"),
    [
        (missing_array, "is damaged .*: save the moments again"),
        (other_shape, "is damaged .*shapes of moments do not go together"),
        (other_things, "is damaged .*other things than moments"),
        (lambda path: fitted().save(path), "holds a policy, not moments: load it with load_policy"),
        (lambda path: np.savez(path, a=np.eye(3)), "holds no moments saved by unconstrain"),
        (lambda path: path.unlink(), "there is no such moments file"),
    ],
)
def test_what_holds_no_moments_is_refused_in_one_sentence(tmp_path, spoil, sentence):
    path = tmp_path / "m.npz"
    moments.save(fitted().moments_, path)
    spoil(path)
    with pytest.raises(uc.errors.ArchiveError, match=sentence) as caught:
        moments.load(path)
    assert "\n" not in str(caught.value)
