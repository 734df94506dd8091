"""Contact is inferred over a stream as it is in memory: several passes, along whole episodes, however they are cut."""

import json
from itertools import pairwise

import numpy as np
import pytest

import unconstrain as uc
from tests import written
from unconstrain import storage
from unconstrain.fitting.inference import Inference
from unconstrain.scaling.summary import describe_fit

COLUMNS = {"state": ["x0", "x1", "x2"], "action": ["u0", "u1", "u2"], "episode": "episode_index"}


def _recorded():
    """Nine noisy movements of a policy; something is in the way of every other one from its middle on."""
    rng = np.random.default_rng(5)
    X, _, episodes, time = written.movements(9, seed=4, smallest=15)
    U = np.array([1.0, -0.5, 0.3]) - X @ np.array([[1.0, 0.4, 0.0], [-0.4, 1.0, 0.0], [0.0, 0.3, 0.7]])
    N = np.full((len(X), 3, 3), np.nan)
    for e in np.unique(episodes)[::2]:
        own = np.flatnonzero(episodes == e)
        own = own[len(own) // 2 :]
        normal = rng.normal(size=3)
        normal /= np.linalg.norm(normal)
        N[own] = np.eye(3) - np.outer(normal, normal)
        U[own] = U[own] @ N[own[0]]
    U += 0.02 * rng.normal(size=U.shape)
    known = ~np.isnan(N[:, 0, 0])
    N[np.flatnonzero(known)[::3]] = np.nan
    known = ~np.isnan(N[:, 0, 0])
    U[known] = np.einsum("nij,nj->ni", N[known], U[known])
    return X, U, episodes, time, N


X, U, EPISODES, TIME, N = _recorded()
CENTERS = X[::59].copy()


def parametric(alpha="cv"):
    return uc.ParametricPolicy(alpha=alpha)


def local(alpha="cv"):
    return uc.LocallyLinearPolicy(centers=CENTERS, width=0.9, alpha=alpha)


def assert_same(streamed, whole, rtol=1e-6, states=X):
    P = whole.predict(states)
    np.testing.assert_allclose(streamed.predict(states), P, rtol=0, atol=rtol * np.abs(P).max())
    deviation = whole.predict(states, return_std=True)[1]
    np.testing.assert_allclose(
        streamed.predict(states, return_std=True)[1], deviation, rtol=0, atol=1e-4 * deviation.max()
    )
    assert streamed.noise_ == pytest.approx(whole.noise_, rel=1e-6)
    assert streamed.free_share_ == pytest.approx(whole.free_share_, abs=1e-6)
    assert streamed.log_likelihoods_ == pytest.approx(whole.log_likelihoods_, rel=1e-6, abs=1e-6)
    for name in ("n_samples_seen_", "n_zero_actions_", "n_known_constraints_", "alpha_"):
        assert getattr(streamed, name) == getattr(whole, name)
    if whole.alpha == "cv":
        assert streamed.resume().folds.n_dealt == whole.resume().folds.n_dealt


def batches(cuts, known=False):
    for a, b in pairwise([0, *cuts, len(X)]):
        yield X[a:b], U[a:b], EPISODES[a:b], *((N[a:b],) if known else ())


@pytest.mark.parametrize(
    ("make", "alpha", "known"),
    [(parametric, "cv", True), (parametric, 1e-4, False), (local, "cv", False), (local, 1e-4, True)],
)
def test_a_stream_gives_the_fit_of_all_at_once(tmp_path, make, alpha, known):
    whole = make(alpha).fit(X, U, groups=EPISODES, projections=N if known else None)
    assert 0.1 < whole.free_share_ < 0.95
    cuts = [1, 20, 21, 100, 170]
    for batch_rows in (1, 60):
        streamed = make(alpha)
        assert uc.fit_stream(streamed, lambda: batches(cuts, known), batch_rows=batch_rows) is streamed
        assert_same(streamed, whole)
    more = {f"n{i}": column for i, column in enumerate(N.reshape(-1, 9).T)}
    folder = written.write(tmp_path / "parts", X, U, EPISODES, TIME, cuts, more=more, row_group_size=31)
    columns = COLUMNS | ({"projections": list(more)} if known else {})
    assert_same(uc.fit_stream(make(alpha), uc.open(folder, **columns), batch_rows=100), whole)


def test_blocks_hold_whole_episodes(tmp_path):
    starts = np.flatnonzero(np.diff(EPISODES, prepend=-1))
    folder = written.write(tmp_path / "parts", X, U, EPISODES, TIME, [10, 100], row_group_size=13)
    for source in (uc.open(folder, **COLUMNS).source, uc.open(list(batches([10, 100]))).source):
        for batch_rows in (1, 50, 10_000):
            blocks = list(source.along_episodes().blocks(batch_rows))
            assert {block.start for block in blocks} <= set(starts)
            assert [block.stop for block in blocks] == [*(block.start for block in blocks[1:]), len(X)]
            assert all(block.stop - block.start >= batch_rows for block in blocks[:-1])
            joined = np.concatenate([block.load().samples.actions for block in blocks])
            np.testing.assert_array_equal(joined, U)
            if batch_rows == 1:
                assert len(blocks) == len(starts)
            after = list(source.along_episodes().blocks(batch_rows, blocks[0].stop))
            assert [block.start for block in after] == [block.start for block in blocks[1:]]
        assert any(block.start not in starts for block in source.blocks(7))  # nobody else pays for it


def test_an_episode_that_comes_back_is_another_in_a_stream_and_in_memory(tmp_path):
    episodes = EPISODES.copy()
    episodes[-10:] = episodes[0]
    whole = parametric().fit(X, U, groups=episodes)
    folder = written.write(tmp_path / "parts", X, U, episodes, TIME, [])
    assert_same(uc.fit_stream(parametric(), uc.open(folder, **COLUMNS), batch_rows=30), whole)
    assert_same(uc.fit_stream(parametric(), [(X, U, episodes)], batch_rows=30), whole)


def test_derivatives_and_gaps_make_episodes_as_loading_does(tmp_path):
    time = TIME.copy()
    for label in np.unique(EPISODES)[::3]:
        own = np.flatnonzero(label == EPISODES)
        time[own[len(own) // 2 :]] += 5.0
    folder = written.write(tmp_path / "parts", X, U, EPISODES, time, [100])
    columns = COLUMNS | {"action": None, "time": "timestamp"}
    demos = uc.load(folder, **columns)
    whole = parametric(1e-3).fit(demos)
    assert_same(
        uc.fit_stream(parametric(1e-3), uc.open(folder, **columns), batch_rows=50), whole, states=demos.states
    )


def test_samples_without_episodes_are_taken_one_by_one_and_a_single_file_as_five(tmp_path):
    rows = slice(0, 120)
    whole = parametric(1e-3).fit(X[rows], U[rows])
    assert_same(uc.fit_stream(parametric(1e-3), [(X[rows], U[rows])], batch_rows=50), whole)
    folder = written.write(tmp_path / "one", X, U, EPISODES, TIME, [], row_group_size=30)
    columns = {name: COLUMNS[name] for name in ("state", "action")}
    whole = parametric().fit(X, U, groups=np.arange(len(X)) * 5 // len(X))
    assert_same(uc.fit_stream(parametric(), uc.open(folder, **columns), batch_rows=20), whole)


def test_single_precision_is_that_of_the_files_and_of_nothing_else():
    batch = X.astype(np.float32), U.astype(np.float32), EPISODES
    whole = parametric(1e-3).fit(batch[0].astype(float), batch[1].astype(float), groups=EPISODES)
    assert_same(uc.fit_stream(parametric(1e-3), [batch], batch_rows=50), whole)


def test_what_moves_is_known_from_the_second_pass_on():
    actions = U.copy()
    actions[:60] *= 1e-15
    actions[120] = 1e3
    told = []
    whole = uc.ParametricPolicy(alpha=1e-3).fit(X, actions, groups=EPISODES)
    assert whole.n_zero_actions_ >= 60
    policy = uc.ParametricPolicy(alpha=1e-3)
    uc.fit_stream(
        policy,
        lambda: [(X[i : i + 30], actions[i : i + 30], EPISODES[i : i + 30]) for i in range(0, len(X), 30)],
        batch_rows=30,
        sample_rows=100,
        progress=lambda done, _: told.append(done),
    )
    assert_same(policy, whole)
    # Regression, inconsistency, two passes for each comparison, the last, and those of the runs: none twice.
    assert abs(told.count(0) - len(policy.history_) - 7) <= 1


def test_what_can_be_read_only_once_is_refused():
    policy = parametric()
    with pytest.raises(uc.errors.DataError, match="can be read only once: give a list of them or a function"):
        uc.fit_stream(policy, batches([100]))
    assert not hasattr(policy, "model_")
    policy = parametric().fit(X[:150], U[:150], groups=EPISODES[:150])
    uc.fit_stream(policy, iter([(X[150:], U[150:], EPISODES[150:])]), partial=True)  # one pass is enough
    assert policy.n_samples_seen_ == len(X)
    assert uc.fit_stream(parametric().set_params(risk="inconsistency"), batches([100])).alpha_ > 0


def test_going_on_infers_once_with_the_policy_so_far():
    cut = int(np.flatnonzero(np.diff(EPISODES))[4]) + 1
    yesterday, today = slice(0, cut), slice(cut, None)
    policy = parametric().fit(X[yesterday], U[yesterday], groups=EPISODES[yesterday])
    belief = policy.solution_.belief
    again = parametric().fit(X[yesterday], U[yesterday], groups=EPISODES[yesterday])
    again.partial_fit(X[today], U[today], groups=EPISODES[today])
    told = []
    uc.fit_stream(
        policy,
        [(X[today], U[today], EPISODES[today])],
        partial=True,
        batch_rows=30,
        progress=lambda done, _: told.append(done),
    )
    assert told.count(0) == 1
    assert_same(policy, again)
    np.testing.assert_array_equal(again.resume().belief.w, again.solution_.w)
    np.testing.assert_array_equal(again.accumulator_.belief.w, belief.w)


def test_progress_says_which_pass_it_is(tmp_path, capsys):
    class Told(list):
        def begin(self, text):
            self.append(text)

        def __call__(self, done, total):
            self.append((done, total))

    folder = written.write(tmp_path / "parts", X, U, EPISODES, TIME, [])
    told = Told()
    policy = uc.fit_stream(parametric(1e-3), uc.open(folder, **COLUMNS), progress=told, batch_rows=60)
    passes = [each for each in told if isinstance(each, str)]
    assert passes[:3] == ["regression", "inconsistency", "all free, pass 1"]
    assert passes[-1] == "last pass"
    assert len(passes) > len(policy.history_)
    assert told[1] == (0, len(X))
    assert told[told.index("inconsistency") - 1] == (len(X), len(X)) == told[-1]
    uc.fit_stream(uc.ParametricPolicy(alpha=1e-3), uc.open(folder, **COLUMNS), progress=True)
    assert "last pass" in capsys.readouterr().err


def test_what_was_found_is_told():
    policy = uc.fit_stream(parametric(), list(batches([100])))
    text = describe_fit(policy)
    assert f"contact: {policy.free_share_:.1%} of the samples free" in text
    assert f"noise: {policy.noise_:.3g}" in text
    assert f"held-out log-likelihood of a sample: {policy.log_likelihood_:.4g} (inferred" in text
    for other in ("all free", "all constrained"):
        assert f"{other} {policy.log_likelihoods_[other]:.4g}" in text
    assert "λ" in text
    assert "explained" not in text


# Checkpoints


@pytest.mark.parametrize("where", [0.0, 0.5, 0.97])
@pytest.mark.parametrize("make", [parametric, local])
def test_an_interrupted_stream_goes_on_with_the_same_result(tmp_path, make, where):
    source, told = list(batches([100])), []
    whole = uc.fit_stream(make(), source, batch_rows=100, progress=lambda done, _: told.append(done))
    at, file = max(int(where * len(told)) - 1, 2), tmp_path / "run.ckpt"
    count = 0

    def stop(done, total):
        nonlocal count
        count += 1
        if count == at:
            raise KeyboardInterrupt

    with pytest.raises(
        KeyboardInterrupt, match=r"interrupted \(.*\) after .* rows: the same call with checkpoint"
    ):
        uc.fit_stream(make(), source, batch_rows=100, progress=stop, checkpoint=file)
    rest = []
    policy = uc.fit_stream(
        make(), source, batch_rows=100, checkpoint=file, progress=lambda done, _: rest.append(done)
    )
    assert len(rest) <= len(told) - at + 2
    np.testing.assert_array_equal(policy.predict(X), whole.predict(X))
    assert policy.history_ == whole.history_
    assert policy.resume().folds.fold_of == whole.resume().folds.fold_of
    # What is complete needs no pass more.
    rest.clear()
    again = uc.fit_stream(
        make(), source, batch_rows=100, checkpoint=file, progress=lambda done, _: rest.append(done)
    )
    assert rest == [len(X)]
    np.testing.assert_array_equal(again.predict(X), whole.predict(X))


def test_ctrl_c_between_passes_loses_nothing(tmp_path, monkeypatch):
    source, file = list(batches([100])), tmp_path / "run.ckpt"
    whole = uc.fit_stream(parametric(), source)
    take, count = Inference.take, 0

    def interrupted(self, done):
        nonlocal count
        count += 1
        take(self, done)
        if count == 20:
            raise KeyboardInterrupt

    monkeypatch.setattr(Inference, "take", interrupted)
    with pytest.raises(KeyboardInterrupt, match="goes on from there"):
        uc.fit_stream(parametric(), source, checkpoint=file)
    policy = uc.fit_stream(parametric(), source, checkpoint=file)
    np.testing.assert_array_equal(policy.predict(X), whole.predict(X))
    assert policy.history_ == whole.history_


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"stage": "run"', '"stage": 3'),
        ('"cooling": false', '"cooling": 1.5'),
        ('"leave_free": ', '"leave_free": null, "leave": '),
        ('"is_cooling": false', '"is_cooling": {"tuple": []}'),
        ('"log_likelihoods": ', '"log_likelihoods": null, "other": '),
        ('"runs": [', '"runs": [null, '),
        ("w", None),
    ],
)
def test_a_checkpoint_whose_inference_is_none_is_damaged(tmp_path, old, new):
    source, path, count = list(batches([100])), tmp_path / "run", 0

    def stop(done, total):
        nonlocal count
        count += 1
        if count == 40:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        uc.fit_stream(parametric(1e-3), source, progress=stop, checkpoint=path)
    tree, arrays = storage.read(path, storage.Kind.CHECKPOINT)
    if new is None:
        for name in [name for name in arrays if name.endswith(".w")]:
            arrays[name] = arrays[name][:-1]
    else:
        text = json.dumps(tree)
        assert old in text
        tree = json.loads(text.replace(old, new, 1))
    storage.write(path, storage.Kind.CHECKPOINT, tree, arrays)
    with pytest.raises(uc.errors.ArchiveError, match=r"is damaged .*: delete it to start anew"):
        uc.fit_stream(parametric(1e-3), source, checkpoint=path)
