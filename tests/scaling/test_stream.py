import os
import signal
import subprocess
import sys
import textwrap
from itertools import pairwise

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import unconstrain as uc
from tests import written
from unconstrain.scaling import stream

X, U, EPISODES, TIME = written.movements()
COLUMNS = {"state": ["x0", "x1", "x2"], "action": ["u0", "u1", "u2"], "episode": "episode_index"}
ROLES = {"state": "observation.state", "action": "action", "episode": "episode_index"}
CENTERS = X[::97].copy()


def policies(alpha="cv"):
    """Nothing in them is placed by the data."""
    return [
        uc.ParametricPolicy(risk="inconsistency", alpha=alpha),
        uc.ParametricPolicy(uc.NormalizedRBF(centers=CENTERS, width=0.7), risk="inconsistency", alpha=alpha),
        uc.LocallyLinearPolicy(centers=CENTERS, width=0.7, risk="inconsistency", alpha=alpha),
        uc.ParametricPolicy(risk="direct", alpha=alpha),
    ]


def standardized(policy):
    """The moments by fold of features that are standardised by all of them, wherever the first states lay."""
    decay = policy.model_.decay(policy.resume().moments())
    return [decay.standardize(part) for part in policy.moments_]


def assert_same_fit(streamed, whole, states=X):
    assert streamed.n_samples_seen_ == whole.n_samples_seen_
    assert streamed.n_zero_actions_ == whole.n_zero_actions_
    assert len(streamed.moments_) == len(whole.moments_)
    pairs = zip(standardized(streamed), standardized(whole), strict=True)
    for a, b in pairs:
        assert a.n_samples == b.n_samples
        for name in ("H", "g", "squares", "weight"):
            np.testing.assert_allclose(
                getattr(a, name), getattr(b, name), rtol=1e-9, atol=1e-12 * np.abs(getattr(b, name)).max()
            )
    assert streamed.alpha_ == pytest.approx(whole.alpha_, rel=1e-9)
    P = whole.predict(states)
    # Rounding of 1e-16 in H is that over λ in the policy; what is compared is the policy, not its noise.
    np.testing.assert_allclose(streamed.predict(states), P, rtol=1e-6, atol=1e-8 * np.abs(P).max())
    # Boxes of those that went before are of the unit of these.
    assert streamed.region().distance(whole.region().middles).max() < 0.5
    assert streamed.usual_distance() == pytest.approx(whole.usual_distance(), rel=0.3)


@settings(deadline=None, max_examples=25)
@given(
    st.lists(st.integers(1, len(X) - 1), max_size=5, unique=True).map(sorted),
    st.integers(7, 400),
    st.integers(30, 300),
    st.booleans(),
    st.integers(0, 3),
)
def test_however_the_rows_lie_in_files_the_fit_is_that_of_all_at_once(
    tmp_path_factory, cuts, batch_rows, row_group, lists, which
):
    folder = written.write(
        tmp_path_factory.mktemp("parts"), X, U, EPISODES, TIME, cuts, lists=lists, row_group_size=row_group
    )
    whole = policies()[which].fit(X, U, groups=EPISODES)
    streamed = stream.fit_stream(
        policies()[which], uc.open(folder, **ROLES if lists else COLUMNS), batch_rows=batch_rows
    )
    assert_same_fit(streamed, whole)


@pytest.mark.parametrize("policy", policies())
def test_batches_of_any_size_give_the_fit_of_all_at_once(policy):
    rng = np.random.default_rng(0)
    bounds = [0, *np.sort(rng.choice(len(X), 9, replace=False)), len(X)]

    def batches():
        for a, b in pairwise(bounds):
            yield X[a:b], U[a:b], EPISODES[a:b]

    whole = type(policy)(**policy.get_params(deep=False)).fit(X, U, groups=EPISODES)
    for source in (batches(), batches, list(batches())):
        streamed = type(policy)(**policy.get_params(deep=False))
        assert stream.fit_stream(streamed, source, batch_rows=100) is streamed
        assert_same_fit(streamed, whole)


def test_actions_of_one_dimension_stay_flat():
    policy = stream.fit_stream(
        uc.ParametricPolicy(risk="inconsistency", alpha=1e-6), [(X, U[:, 0]), (X, U[:, 0])]
    )
    assert policy.predict(X).shape == (len(X),)


@pytest.mark.parametrize("cuts", [[], [60, 61, 200, 500]])
def test_derivatives_do_not_notice_where_files_end(tmp_path, cuts):
    folder = written.write(tmp_path / "parts", X, U, EPISODES, TIME, cuts, row_group_size=50)
    written.write(tmp_path / "one", X, U, EPISODES, TIME, [])
    columns = COLUMNS | {"action": None, "time": "timestamp"}
    demos = uc.load(tmp_path / "one" / "part-0.parquet", **columns)
    for whole, policy in zip(policies(), policies(), strict=True):
        whole.fit(demos.states, demos.actions, groups=demos.episodes)
        stream.fit_stream(policy, uc.open(folder, **columns), batch_rows=70)
        assert_same_fit(policy, whole)


def test_gaps_make_episodes_as_loading_does(tmp_path):
    time = TIME.copy()
    for label in np.unique(EPISODES)[::3]:
        own = np.flatnonzero(label == EPISODES)
        time[own[len(own) // 2 :]] += 5.0
    folder = written.write(tmp_path / "parts", X, U, EPISODES, time, [100, 300])
    written.write(tmp_path / "one", X, U, EPISODES, time, [])
    columns = COLUMNS | {"action": "differentiate", "time": "timestamp"}
    demos = uc.load(
        tmp_path / "one" / "part-0.parquet", columns["state"], time="timestamp", episode="episode_index"
    )
    assert demos.n_episodes > len(np.unique(EPISODES))
    whole = uc.ParametricPolicy(risk="inconsistency", alpha="cv").fit(
        demos.states, demos.actions, groups=demos.episodes
    )
    assert_same_fit(
        stream.fit_stream(
            uc.ParametricPolicy(risk="inconsistency", alpha="cv"), uc.open(folder, **columns), batch_rows=50
        ),
        whole,
    )


def test_episodes_too_broken_to_differentiate_are_left_out(tmp_path):
    time = TIME.copy()
    own = np.flatnonzero(np.isin(EPISODES, EPISODES[300]))
    time[own] += 5.0 * (np.arange(len(own)) // 3)
    columns = COLUMNS | {"action": None, "time": "timestamp", "gap": 1.0, "window": 0.2}
    written.write(tmp_path / "one", X, U, EPISODES, time, [])
    demos = uc.load(tmp_path / "one" / "part-0.parquet", **columns)
    whole = uc.ParametricPolicy(risk="inconsistency", alpha="cv").fit(
        demos.states, demos.actions, groups=demos.episodes
    )
    assert len(demos) == len(X) - len(own)
    policy = stream.fit_stream(
        uc.ParametricPolicy(risk="inconsistency", alpha="cv"),
        uc.open(tmp_path / "one", **columns),
        batch_rows=1,
    )
    assert_same_fit(policy, whole)
    written.write(tmp_path / "none", X[own], U[own], EPISODES[own], time[own], [])
    with pytest.raises(uc.errors.DataError, match="no episode has a fragment long enough"):
        stream.fit_stream(
            uc.ParametricPolicy(risk="inconsistency", alpha=1e-6), uc.open(tmp_path / "none", **columns)
        )


def test_small_data_are_placed_as_fit_places_them(tmp_path):
    folder = written.write(tmp_path / "parts", X, U, EPISODES, TIME, [200])
    for make in (
        lambda: uc.LocallyLinearPolicy(n_centers=6, risk="inconsistency", alpha=1e-6),
        lambda: uc.ParametricPolicy(uc.NormalizedRBF(5), risk="inconsistency", alpha=1e-6),
    ):
        assert_same_fit(stream.fit_stream(make(), uc.open(folder, **COLUMNS)), make().fit(X, U))


def test_centres_lie_on_a_bounded_random_sample(tmp_path):
    folder = written.write(tmp_path / "parts", X, U, EPISODES, TIME, [200, 400], row_group_size=40)
    policy = uc.LocallyLinearPolicy(n_centers=8, risk="inconsistency", alpha=1e-6)
    stream.fit_stream(policy, uc.open(folder, **COLUMNS), sample_rows=50)
    rows = {tuple(x) for x in X}
    assert len(policy.centers_) == 8
    assert all(tuple(center) in rows for center in policy.centers_)
    again = stream.fit_stream(
        uc.LocallyLinearPolicy(n_centers=8, risk="inconsistency", alpha=1e-6),
        uc.open(folder, **COLUMNS),
        sample_rows=50,
    )
    np.testing.assert_array_equal(again.centers_, policy.centers_)
    other = stream.fit_stream(
        uc.LocallyLinearPolicy(n_centers=8, risk="inconsistency", alpha=1e-6),
        uc.open(folder, **COLUMNS),
        sample_rows=50,
        random_state=1,
    )
    assert not np.array_equal(other.centers_, policy.centers_)
    given = uc.LocallyLinearPolicy(
        centers=policy.centers_, width=policy.width_, risk="inconsistency", alpha=1e-6
    ).fit(X, U)
    assert_same_fit(policy, given)
    first = stream.fit_stream(
        uc.LocallyLinearPolicy(n_centers=8, risk="inconsistency", alpha=1e-6), iter([(X, U)]), sample_rows=50
    )
    rows = {tuple(x) for x in X[:50]}
    assert all(tuple(center) in rows for center in first.centers_)


def test_without_episode_column_files_are_episodes_and_one_file_is_cut_into_blocks(tmp_path):
    columns = {name: COLUMNS[name] for name in ("state", "action")}
    several = written.write(tmp_path / "several", X, U, EPISODES, TIME, [100, 250, 400])
    groups = np.repeat([0, 1, 2, 3], np.diff([0, 100, 250, 400, len(X)]))
    whole = uc.ParametricPolicy(risk="inconsistency", alpha="cv").fit(X, U, groups=groups)
    assert_same_fit(
        stream.fit_stream(uc.ParametricPolicy(risk="inconsistency", alpha="cv"), uc.open(several, **columns)),
        whole,
    )
    one = written.write(tmp_path / "one", X, U, EPISODES, TIME, [])
    whole = uc.ParametricPolicy(risk="inconsistency", alpha="cv").fit(X, U)
    assert_same_fit(
        stream.fit_stream(
            uc.ParametricPolicy(risk="inconsistency", alpha="cv"), uc.open(one, **columns), batch_rows=64
        ),
        whole,
    )


def test_what_uc_save_wrote_needs_no_columns(tmp_path):
    demos = uc.Demonstrations(X, U, EPISODES)
    for i, part in enumerate((slice(0, 300), slice(300, None))):
        demos.select(part).save(tmp_path / f"{i}.parquet")
    loaded = uc.load([tmp_path / "0.parquet", tmp_path / "1.parquet"])
    whole = uc.ParametricPolicy(risk="inconsistency", alpha="cv").fit(X, U, groups=loaded.episodes)
    assert_same_fit(stream.fit_stream(uc.ParametricPolicy(risk="inconsistency", alpha="cv"), tmp_path), whole)


def test_file_uris_open_as_object_stores_do(tmp_path):
    folder = written.write(tmp_path / "parts", X, U, EPISODES, TIME, [200])
    streamed = stream.fit_stream(
        uc.ParametricPolicy(risk="inconsistency", alpha=1e-6), uc.open(folder.as_uri(), **COLUMNS)
    )
    assert_same_fit(streamed, uc.ParametricPolicy(risk="inconsistency", alpha=1e-6).fit(X, U))


@pytest.mark.parametrize("scale", [1e-30, 1.0, 1e18, 1e30])
def test_single_precision_is_that_of_the_files_and_of_nothing_else(tmp_path, scale):
    states, actions = (X * scale).astype(np.float32), (U * scale).astype(np.float32)
    table = {f"x{i}": states[:, i] for i in range(3)} | {f"u{i}": actions[:, i] for i in range(3)}
    pq.write_table(pa.table(table | {"episode_index": EPISODES}), tmp_path / "a.parquet")
    centers = CENTERS * scale
    for make in (
        lambda: uc.ParametricPolicy(risk="inconsistency", alpha="cv"),
        lambda: uc.ParametricPolicy(
            uc.NormalizedRBF(centers=centers, width=0.7 * scale), risk="inconsistency", alpha="cv"
        ),
        lambda: uc.LocallyLinearPolicy(centers=centers, width=0.7 * scale, risk="inconsistency", alpha="cv"),
        lambda: uc.ParametricPolicy(risk="direct", alpha="cv"),
        lambda: uc.LocallyLinearPolicy(centers=centers, width=0.7 * scale, risk="direct", alpha="cv"),
        lambda: uc.ParametricPolicy(uc.DecoupledFeatures(), risk="direct", alpha="cv"),
    ):
        whole = make().fit(states.astype(float), actions.astype(float), groups=EPISODES)
        assert_same_fit(
            stream.fit_stream(make(), uc.open(tmp_path, **COLUMNS), batch_rows=100), whole, states
        )


def test_columns_not_needed_are_not_read(tmp_path, columns_read):
    folder = written.write(tmp_path / "parts", X, U, EPISODES, TIME, [])
    stream.fit_stream(
        uc.ParametricPolicy(risk="inconsistency", alpha=1e-6), uc.open(folder, state=["x0"], action=["u1"])
    )
    assert columns_read[-1] == ["x0", "u1"]  # the first call looks at one row, to see what columns there are


def test_yesterday_goes_on_today():
    yesterday, today = (X[:300], U[:300], EPISODES[:300]), (X[300:], U[300:], EPISODES[300:])
    whole = uc.ParametricPolicy(risk="inconsistency", alpha="cv").fit(X, U, groups=EPISODES)
    policy = stream.fit_stream(uc.ParametricPolicy(risk="inconsistency", alpha="cv"), [yesterday])
    assert_same_fit(stream.fit_stream(policy, [today], partial=True), whole)
    policy = stream.fit_stream(uc.ParametricPolicy(risk="inconsistency", alpha="cv"), [yesterday])
    assert_same_fit(policy.partial_fit(*today[:2], groups=today[2]), whole)


def test_what_counts_as_motion_does_not_depend_on_the_batches():
    actions = U.copy()
    actions[:200] = np.where(np.arange(200)[:, None] % 2, 1e-9, 1e-17)  # motion, and rounding beside it
    actions[400] = 3e3  # beside which all of that is rounding
    whole = uc.ParametricPolicy(risk="inconsistency", alpha=1e-3).fit(X, actions)
    assert whole.n_zero_actions_ >= 200
    batches = [(X[i : i + 50], actions[i : i + 50]) for i in range(0, len(X), 50)]
    for source in (batches, lambda: iter(batches)):
        assert_same_fit(
            stream.fit_stream(uc.ParametricPolicy(risk="inconsistency", alpha=1e-3), source, batch_rows=50),
            whole,
        )
    with pytest.raises(uc.errors.DataError, match="was taken for motion before one of length"):
        stream.fit_stream(
            uc.ParametricPolicy(risk="inconsistency", alpha=1e-6),
            iter(batches),
            batch_rows=50,
            sample_rows=100,
        )


def test_progress_tells_rows_done_and_in_all(tmp_path, capsys):
    folder = written.write(tmp_path / "parts", X, U, EPISODES, TIME, [])
    told = []
    stream.fit_stream(
        uc.ParametricPolicy(risk="inconsistency", alpha=1e-6),
        uc.open(folder, **COLUMNS),
        progress=lambda *rows: told.append(rows),
        batch_rows=100,
    )
    assert told[0] == (0, len(X))
    assert told[-1] == (len(X), len(X))
    assert all(a[0] < b[0] for a, b in pairwise(told))
    stream.fit_stream(
        uc.ParametricPolicy(risk="inconsistency", alpha=1e-6), uc.open(folder, **COLUMNS), progress=True
    )
    assert f"{len(X):,} of {len(X):,} rows" in capsys.readouterr().err


def test_a_checkpoint_that_cannot_be_written_is_refused_before_the_work(tmp_path):
    told = []
    with pytest.raises(uc.errors.UnconstrainError, match="there is no folder"):
        stream.fit_stream(
            uc.ParametricPolicy(risk="inconsistency", alpha=1e-6),
            [(X, U)],
            checkpoint=tmp_path / "no" / "c.npz",
            progress=lambda *rows: told.append(rows),
        )
    assert not told
    assert not list(tmp_path.iterdir())


def test_ctrl_c_keeps_what_was_done_and_says_how_to_go_on(tmp_path):
    folder = written.write(tmp_path / "parts", X, U, EPISODES, TIME, [100, 333])
    whole = stream.fit_stream(policies()[2], uc.open(folder, **COLUMNS), batch_rows=64)

    def stop(done, total):
        if done >= 200:
            raise KeyboardInterrupt

    policy, file = policies()[2], tmp_path / "run.ckpt.npz"
    with pytest.raises(KeyboardInterrupt, match="nothing was learnt; give a checkpoint"):
        stream.fit_stream(policy, uc.open(folder, **COLUMNS), batch_rows=64, progress=stop)
    assert not hasattr(policy, "moments_")
    with pytest.raises(
        KeyboardInterrupt, match=r"after 228 of .* rows: the same call with checkpoint .* goes on"
    ):
        stream.fit_stream(policy, uc.open(folder, **COLUMNS), batch_rows=64, progress=stop, checkpoint=file)
    told = []
    stream.fit_stream(
        policy,
        uc.open(folder, **COLUMNS),
        batch_rows=64,
        checkpoint=file,
        progress=lambda done, total: told.append(done),
    )
    assert told[0] == 228
    np.testing.assert_array_equal(policy.predict(X), whole.predict(X))
    for a, b in zip(policy.moments_, whole.moments_, strict=True):
        np.testing.assert_array_equal(a.H, b.H)
    assert list(tmp_path.glob(".run*")) == []


@pytest.mark.parametrize("derived", [False, True])
def test_a_killed_process_goes_on_where_it_stopped(tmp_path, derived):
    """SIGKILL leaves no time to tidy up: the file must be whole at any moment."""
    folder = written.write(tmp_path / "parts", X, U, EPISODES, TIME, [100, 333])
    columns = COLUMNS | ({"action": None, "time": "timestamp"} if derived else {})
    make = "uc.LocallyLinearPolicy(n_centers=5, alpha='cv')"
    script = f"""
        import os, signal
        import unconstrain as uc
        from unconstrain.scaling import stream

        def stop(done, total):
            if done >= 300:
                os.kill(os.getpid(), signal.SIGKILL)

        stream.fit_stream({make}, uc.open({str(folder)!r}, **{columns!r}), batch_rows=50, sample_rows=200,
                          checkpoint={str(tmp_path / "run.npz")!r}, checkpoint_seconds=0, progress=stop)
    """
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(script)], capture_output=True, timeout=60)
    assert done.returncode == -signal.SIGKILL, done.stderr
    options = {"batch_rows": 50, "sample_rows": 200}
    told = []
    policy = stream.fit_stream(
        eval(make),
        uc.open(folder, **columns),
        **options,
        checkpoint=tmp_path / "run.npz",
        progress=lambda rows, total: told.append(rows),
    )
    assert told[0] >= 250
    whole = stream.fit_stream(eval(make), uc.open(folder, **columns), **options)
    np.testing.assert_array_equal(policy.centers_, whole.centers_)
    np.testing.assert_allclose(policy.predict(X), whole.predict(X), rtol=1e-12, atol=1e-12)
    assert policy.resume().folds.fold_of == whole.resume().folds.fold_of
    again = stream.fit_stream(
        eval(make), uc.open(folder, **columns), **options, checkpoint=tmp_path / "run.npz"
    )
    np.testing.assert_array_equal(again.predict(X), policy.predict(X))


def changed_in_place(folder):
    """Other data of the same name, size and time of change."""
    (path,) = folder.iterdir()
    about = path.stat()
    written.write(folder, X, U[:, ::-1], EPISODES, TIME, [])
    os.utime(path, ns=(about.st_atime_ns, about.st_mtime_ns))
    assert path.stat().st_size == about.st_size
    return uc.open(folder, **COLUMNS)


@pytest.mark.parametrize(
    ("other", "what"),
    [
        (
            lambda f, o: (uc.ParametricPolicy(risk="inconsistency", alpha=1.0), uc.open(f, **COLUMNS), {}),
            "policy",
        ),
        (
            lambda f, o: (uc.ParametricPolicy(risk="inconsistency", alpha=1e-6), uc.open(o, **COLUMNS), {}),
            "source",
        ),
        (
            lambda f, o: (uc.ParametricPolicy(risk="inconsistency", alpha=1e-6), changed_in_place(f), {}),
            "source",
        ),
        (
            lambda f, o: (
                uc.ParametricPolicy(risk="inconsistency", alpha=1e-6),
                uc.open(f, **COLUMNS | {"state": ["x0"]}),
                {},
            ),
            "source",
        ),
        (
            lambda f, o: (
                uc.ParametricPolicy(risk="inconsistency", alpha=1e-6),
                uc.open(f, **COLUMNS),
                {"batch_rows": 10},
            ),
            "settings",
        ),
    ],
)
def test_a_checkpoint_of_something_else_is_refused(tmp_path, other, what):
    folder = written.write(tmp_path / "parts", X, U, EPISODES, TIME, [])
    another = written.write(tmp_path / "another", X[:90], U[:90], EPISODES[:90], TIME[:90], [])
    file = tmp_path / "run.npz"
    stream.fit_stream(
        uc.ParametricPolicy(risk="inconsistency", alpha=1e-6), uc.open(folder, **COLUMNS), checkpoint=file
    )
    policy, recordings, settings = other(folder, another)
    with pytest.raises(uc.errors.UnconstrainError, match=f"checkpoint of another {what}"):
        stream.fit_stream(policy, recordings, **settings, checkpoint=file)


def test_a_checkpoint_that_is_none_is_refused(tmp_path):
    folder = written.write(tmp_path / "parts", X, U, EPISODES, TIME, [])
    for content, sentence in [(b"hello", "holds no checkpoint saved by"), (None, "damaged")]:
        if content is None:
            stream.fit_stream(
                uc.ParametricPolicy(risk="inconsistency"),
                uc.open(folder, **COLUMNS),
                checkpoint=tmp_path / "ours.npz",
            )
            content = (tmp_path / "ours.npz").read_bytes()[:1000]
        (tmp_path / "run.npz").write_bytes(content)
        with pytest.raises(uc.errors.UnconstrainError, match=sentence):
            stream.fit_stream(
                uc.ParametricPolicy(risk="inconsistency", alpha=1e-6),
                uc.open(folder, **COLUMNS),
                checkpoint=tmp_path / "run.npz",
            )


def spoilt(folder, how):
    written.write(folder, X, U, EPISODES, TIME, [200, 400])
    path = folder / "part-1.parquet"
    table = pq.read_table(path)
    if how == "nan":
        values = table["x1"].to_numpy().copy()
        values[17] = np.nan
        pq.write_table(table.set_column(1, "x1", pa.array(values)), path)
    elif how == "null":
        values = table["u0"].to_pylist()
        values[3] = None
        pq.write_table(table.set_column(3, "u0", pa.array(values)), path)
    elif how == "text":
        pq.write_table(table.set_column(1, "x1", pa.array(["a"] * len(table))), path)
    elif how == "missing":
        pq.write_table(table.drop_columns(["x1"]), path)
    elif how == "cut":
        path.write_bytes(path.read_bytes()[:-100])
    elif how == "not parquet":
        path.write_text("hello")
    elif how == "pages":
        pq.write_table(table, path, write_page_checksum=True, compression="none")
        data = bytearray(path.read_bytes())
        data[500] ^= 0xFF
        path.write_bytes(data)
    return folder


@pytest.mark.parametrize(
    ("how", "sentence"),
    [
        ("nan", r"part-1.parquet: column 'x1' holds nan at row 17 \(counted from 0\)"),
        ("null", "part-1.parquet: column 'u0' is empty at row 3"),
        ("text", "part-1.parquet: column 'x1' holds 'a' at row 0"),
        ("missing", "part-1.parquet has no column 'x1'"),
        ("cut", "part-1.parquet is damaged or not a Parquet file"),
        ("not parquet", "part-1.parquet is damaged or not a Parquet file"),
        ("pages", "part-1.parquet is damaged or not a Parquet file"),
    ],
)
def test_broken_files_are_named(tmp_path, how, sentence):
    policy = uc.ParametricPolicy(risk="inconsistency", alpha=1e-6)
    with pytest.raises(uc.errors.DataError, match=sentence) as caught:
        stream.fit_stream(policy, uc.open(spoilt(tmp_path / "parts", how), **COLUMNS))
    assert "\n" not in str(caught.value)
    assert not hasattr(policy, "moments_")


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda f, p: stream.fit_stream(p, uc.open(f / "nowhere", **COLUMNS)), "there is no file or folder"),
        (
            lambda f, p: stream.fit_stream(p, uc.open(f.parent / "empty", **COLUMNS)),
            "is a folder without Parquet files",
        ),
        (lambda f, p: stream.fit_stream(p, f), r"give state=, .* its columns are 0 'x0', 1 'x1'"),
        (
            lambda f, p: stream.fit_stream(p, uc.open(f, state=["x7"], action="u0")),
            "no column 'x7' for state",
        ),
        (lambda f, p: stream.fit_stream(p, uc.open(f, state="x0")), "give action=, or time="),
        (lambda f, p: stream.fit_stream(p, uc.open(f, **COLUMNS), batch_rows=0), "batch_rows must be"),
        (
            lambda f, p: stream.fit_stream(p, uc.open("bogus://x/y", **COLUMNS)),
            "bogus://x/y cannot be opened",
        ),
        (
            lambda f, p: stream.fit_stream(p, uc.open([(X, U)], state="x0")),
            "state= chooses a column of files",
        ),
        (lambda f, p: stream.fit_stream(p, []), "nothing was given to open"),
        (lambda f, p: stream.fit_stream(p, iter([])), "the source has no samples"),
        (lambda f, p: stream.fit_stream(p, 3), "source must be a path or several"),
        (lambda f, p: stream.fit_stream(p, [X]), r"batch 0 \(counted from 0\) must be \(X, U\)"),
        (lambda f, p: stream.fit_stream(p, [(X, U[:3])]), "must hold X"),
        (lambda f, p: stream.fit_stream(p, [(X, U), (X, U[:, :1])]), "batch 1 .* has 3 state and 1 action"),
        (lambda f, p: stream.fit_stream(p, [(X, U), (X * np.nan, U)]), "X of batch 1 contains NaN in row 0"),
        (lambda f, p: stream.fit_stream(p, [(X, 0 * U)]), "no action moves"),
        (lambda f, p: stream.fit_stream(p, [(X[:1], U[:1])]), "one sample"),
        (
            lambda f, p: stream.fit_stream(uc.ParametricPolicy(risk="inconsistency", alpha="cv"), [(X, U)]),
            "needs episodes",
        ),
        (
            lambda f, p: stream.fit_stream(
                uc.ParametricPolicy(risk="inconsistency", alpha="cv"), [(X, U, 0 * TIME)]
            ),
            "two episodes",
        ),
        (lambda f, p: stream.fit_stream("linear", [(X, U)]), "policy must be one of"),
    ],
)
def test_mistakes_are_told_in_one_sentence(tmp_path, call, sentence):
    folder = written.write(tmp_path / "parts", X, U, EPISODES, TIME, [])
    (tmp_path / "empty").mkdir()
    with pytest.raises(uc.errors.UnconstrainError, match=sentence) as caught:
        call(folder, uc.ParametricPolicy(risk="inconsistency", alpha=1e-6))
    assert "\n" not in str(caught.value)


def test_an_episode_that_comes_back_cannot_be_differentiated(tmp_path):
    episodes = EPISODES.copy()
    episodes[-10:] = episodes[0]
    folder = written.write(tmp_path / "parts", X, U, episodes, TIME, [])
    with pytest.raises(uc.errors.DataError, match=r"goes on at row .* sort it by episode"):
        stream.fit_stream(
            uc.ParametricPolicy(risk="inconsistency", alpha=1e-6),
            uc.open(folder, **COLUMNS | {"action": None, "time": "timestamp"}),
            batch_rows=50,
        )


def test_one_episode_is_refused_before_the_pass(tmp_path):
    folder = written.write(tmp_path / "parts", X, U, np.zeros(len(X), dtype=int), TIME, [200])
    told = []
    with pytest.raises(uc.errors.DataError, match="at least two episodes"):
        uc.fit_stream(
            uc.ParametricPolicy(risk="inconsistency"),
            uc.open(folder, **COLUMNS),
            progress=lambda done, of: told.append(done),
        )
    assert told == []
