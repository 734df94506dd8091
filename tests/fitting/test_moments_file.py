import json
import zipfile

import numpy as np
import pytest

import unconstrain as uc
from unconstrain.fitting import moments
from unconstrain.fitting.solve import EpisodeFolds


def fitted(alpha="cv", seed=0):
    rng = np.random.default_rng(seed)
    X = rng.normal(size=(200, 2))
    return uc.ParametricPolicy(alpha=alpha).fit(
        X, X @ [[-1.0, 0.5], [-0.5, -1.0]], groups=np.arange(200) // 20
    )


def assert_equal(a, b):
    for name in ("H", "g", "squares", "weight", "n_samples"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))


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


def test_moments_of_two_days_add_to_those_of_both(tmp_path):
    rng = np.random.default_rng(0)
    X = rng.normal(size=(300, 2))
    U = X @ [[-1.0, 0.5], [-0.5, -1.0]]
    moments.save(uc.ParametricPolicy().fit(X[:200], U[:200]).moments_, tmp_path / "yesterday.npz")
    today = uc.ParametricPolicy().fit(X[200:], U[200:])
    total = moments.load(tmp_path / "yesterday.npz")[0] + today.moments_[0]
    both = uc.ParametricPolicy().fit(X, U).moments_[0]
    np.testing.assert_allclose(total.H, both.H, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(total.g, both.g, rtol=1e-12, atol=1e-12)
    assert total.n_samples == 300


def test_a_saved_policy_goes_on_where_it_stopped(tmp_path):
    rng = np.random.default_rng(0)
    X = rng.normal(size=(300, 2))
    U, groups = np.sin(X), np.arange(300) // 20
    yesterday = uc.ParametricPolicy(alpha="cv").fit(X[:200], U[:200], groups=groups[:200])
    yesterday.save(tmp_path / "yesterday.skops")
    today = uc.load_policy(tmp_path / "yesterday.skops").partial_fit(X[200:], U[200:], groups=groups[200:])
    both = uc.ParametricPolicy(alpha="cv").fit(X, U, groups=groups)
    assert today.folds_.fold_of == both.folds_.fold_of
    np.testing.assert_allclose(today.predict(X), both.predict(X), rtol=1e-9, atol=1e-12)


def test_labels_of_any_kind_survive():
    for labels in (["b", "a", "b"], [3, 1, 3], [1.5, 2.5, 1.5]):
        folds = EpisodeFolds(2)
        np.testing.assert_array_equal(folds.assign(np.array(labels), 3), [0, 1, 0])
        again = EpisodeFolds()
        again.__setstate__(folds.__getstate__())
        assert again.fold_of == folds.fold_of
        assert again.n_folds == 2


def written(tmp_path):
    path = tmp_path / "m.npz"
    moments.save(fitted().moments_, path)
    return path


def truncated(path):
    path.write_bytes(path.read_bytes()[:-200])


def flipped(path):
    data = bytearray(path.read_bytes())
    data[len(data) // 3] ^= 0xFF
    path.write_bytes(data)


def newer(path):
    with np.load(path) as archive:
        arrays = dict(archive)
    about = json.loads(str(arrays["unconstrain"]))
    arrays["unconstrain"] = np.array(json.dumps(about | {"format": 99, "release": "9.9"}))
    np.savez(path, **arrays)


def without_a_fold(path):
    with np.load(path) as archive:
        arrays = {name: archive[name] for name in archive.files if name != "H_1"}
    np.savez(path, **arrays)


def foreign(path):
    np.savez(path, a=np.eye(3))


def single(path):
    with path.open("wb") as file:
        np.save(file, np.eye(3))


def zipped(path):
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("readme.txt", "hello")


@pytest.mark.parametrize(
    ("spoil", "sentence"),
    [
        (truncated, "m.npz is damaged"),
        (flipped, "m.npz is damaged"),
        (without_a_fold, "m.npz is damaged"),
        (newer, "written by unconstrain 9.9, in a newer format"),
        (foreign, "holds no moments saved by unconstrain"),
        (single, "holds no moments saved by unconstrain"),
        (zipped, "holds no moments saved by unconstrain"),
        (lambda path: path.write_text("hello"), "holds no moments saved by unconstrain"),
        (lambda path: path.unlink(), "is not a file, so it holds no moments"),
    ],
)
def test_what_is_not_whole_or_not_ours_is_refused(tmp_path, spoil, sentence):
    path = written(tmp_path)
    spoil(path)
    with pytest.raises(uc.errors.UnconstrainError, match=sentence) as caught:
        moments.load(path)
    assert "\n" not in str(caught.value)
