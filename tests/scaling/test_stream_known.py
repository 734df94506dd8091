"""What is known of constraints, in streams: the policy is that of the same data in memory, however they are cut."""

from itertools import pairwise

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.base import clone

import unconstrain as uc
from reproduction.plants import arm
from tests import written
from tests.scaling.test_stream import CENTERS, COLUMNS, EPISODES, TIME, U, X, assert_same_fit
from unconstrain import metrics as risk

TOUCHED = written.touched(U, EPISODES)
N = np.column_stack([TOUCHED[f"n{j}"] for j in range(9)]).reshape(-1, 3, 3)
FORCE = {"force": ["f0", "f1", "f2"], "force_threshold": 2.0}
WAYS = {
    "force": FORCE,
    "free": {"free": "free"},
    "force and free": FORCE | {"free": "free"},
    "lists": {"projections": "N"},
    "columns": {"projections": [f"n{j}" for j in range(9)]},
}
DERIVED = {"state": COLUMNS["state"], "time": "timestamp", "window": 0.2}


def policies():
    return [
        uc.ParametricPolicy(risk="inconsistency", alpha="cv"),
        uc.LocallyLinearPolicy(centers=CENTERS, width=0.7, risk="inconsistency", alpha="cv"),
        uc.ParametricPolicy(uc.NormalizedRBF(centers=CENTERS, width=0.7), risk="inconsistency", alpha="cv"),
    ]


def in_memory(policy, files, columns, way):
    """The route by way of `load` and `from_recording`; of projections, which `load` does not read, the array."""
    loaded = {name: columns.get(name) for name in ("state", "action", "time", "episode", "window")}
    told = {name: WAYS[way].get(name) for name in ("force", "free")}
    demos = uc.load(files, **loaded, **told)
    known = N
    if "projections" not in WAYS[way]:
        known = uc.constraints.from_recording(demos, force_threshold=WAYS[way].get("force_threshold"))
    groups = None if demos.n_episodes == 1 else demos.episodes
    return policy.fit(demos.states, demos.actions, groups=groups, projections=known), demos


def assert_same_known(streamed, whole, states=X):
    assert_same_fit(streamed, whole, states)
    assert 0 < whole.n_known_constraints_ < whole.n_samples_seen_
    assert streamed.n_known_constraints_ == whole.n_known_constraints_


@settings(deadline=None, max_examples=25)
@given(
    st.lists(st.integers(1, len(X) // 60 - 1), max_size=4, unique=True).map(sorted),
    st.integers(0, 59),
    st.integers(7, 400),
    st.integers(30, 300),
    st.sampled_from(sorted(WAYS)),
    st.booleans(),
    st.booleans(),
    st.integers(0, 2),
)
def test_however_the_rows_lie_in_files_the_fit_is_that_of_all_at_once(
    tmp_path_factory, cuts, shift, batch_rows, row_group, way, derived, labelled, which
):
    folder = tmp_path_factory.mktemp("known")
    # With labels episodes straddle files; without, files are episodes, and time goes on all through them.
    cuts = [60 * cut + (shift if labelled else 0) for cut in cuts]
    time = TIME if labelled else 0.02 * np.arange(len(X))
    written.write(folder / "parts", X, U, EPISODES, time, cuts, more=TOUCHED, row_group_size=row_group)
    written.write(folder / "one", X, U, EPISODES, time, [], more=TOUCHED)
    columns = DERIVED if derived else {name: COLUMNS[name] for name in ("state", "action")}
    columns = columns | ({"episode": "episode_index"} if labelled else {})
    files = sorted((folder / ("one" if labelled else "parts")).iterdir())
    if derived and not labelled and (not cuts or way in ("columns", "lists")):
        # One episode only: there is nothing to hold out. And where a movement begins amid another's time, the state
        # jumps, which no recorded projection lets through.
        return
    whole, demos = in_memory(policies()[which], files, columns, way)
    streamed = uc.fit_stream(
        policies()[which], uc.open(folder / "parts", **columns, **WAYS[way]), batch_rows=batch_rows
    )
    assert_same_known(streamed, whole, demos.states)


@settings(deadline=None, max_examples=12)
@given(
    st.lists(st.integers(1, len(X) - 1), max_size=9, unique=True).map(sorted),
    st.integers(7, 400),
    st.integers(0, 2),
    st.booleans(),
)
def test_batches_of_any_size_give_the_fit_of_all_at_once(cuts, batch_rows, which, repeatable):
    def batches():
        for a, b in pairwise([0, *cuts, len(X)]):
            yield X[a:b], U[a:b], EPISODES[a:b], N[a:b]

    whole = policies()[which].fit(X, U, groups=EPISODES, projections=N)
    source = batches if repeatable else batches()
    assert_same_known(uc.fit_stream(policies()[which], source, batch_rows=batch_rows), whole)
    plain = policies()[which].set_params(alpha=1e-3)
    whole = clone(plain).fit(X, U, projections=N)
    without_groups = [(x, u, None, known) for x, u, _, known in batches()]
    assert_same_known(uc.fit_stream(plain, without_groups, batch_rows=batch_rows), whole)


def test_what_uc_save_wrote_is_used_by_the_names_of_its_columns(tmp_path):
    forces = np.column_stack([TOUCHED[f"f{j}"] for j in range(3)])
    demos = uc.Demonstrations(X, U, EPISODES, forces=forces, free=TOUCHED["free"], projections=N)
    half = len(X) // 2  # in the middle of an episode, which ends up as two
    for i, part in enumerate((slice(0, half), slice(half, None))):
        demos.select(part).save(tmp_path / f"{i}.parquet")
    loaded = uc.load([tmp_path / "0.parquet", tmp_path / "1.parquet"])
    np.testing.assert_array_equal(loaded.projections, N)
    for way, known in (
        ({"projections": "projections"}, N),
        (
            {"force": ["force.1", "force.2", "force.3"], "force_threshold": 2.0, "free": "free"},
            uc.constraints.from_recording(loaded, force_threshold=2.0),
        ),
    ):
        whole = policies()[0].fit(X, U, groups=loaded.episodes, projections=known)
        assert_same_known(uc.fit_stream(policies()[0], uc.open(tmp_path, **way), batch_rows=50), whole)
    whole = policies()[0].fit(loaded)  # what files know of projections counts as it does in memory
    assert_same_known(uc.fit_stream(policies()[0], tmp_path), whole)
    direct = uc.fit_stream(policies()[0].set_params(risk="direct"), tmp_path)
    assert_same_fit(direct, uc.ParametricPolicy(risk="direct", alpha="cv").fit(loaded))


def test_fragments_left_out_take_what_was_known_with_them(tmp_path):
    time = TIME.copy()
    own = np.flatnonzero(np.isin(EPISODES, EPISODES[300]))
    time[own] += 5.0 * (np.arange(len(own)) // 3)
    written.write(tmp_path / "one", X, U, EPISODES, time, [], more=TOUCHED)
    columns = DERIVED | {"episode": "episode_index"}
    whole, demos = in_memory(policies()[0], tmp_path / "one" / "part-0.parquet", columns, "force")
    assert len(demos) == len(X) - len(own)
    streamed = uc.fit_stream(policies()[0], uc.open(tmp_path / "one", **columns, **FORCE), batch_rows=1)
    assert_same_known(streamed, whole, demos.states)
    streamed = uc.fit_stream(
        policies()[0], uc.open(tmp_path / "one", **columns, **WAYS["lists"]), batch_rows=1
    )
    rest = np.ones(len(X), dtype=bool)
    rest[own] = False
    whole = policies()[0].fit(demos.states, demos.actions, groups=demos.episodes, projections=N[rest])
    assert_same_known(streamed, whole, demos.states)


def test_projections_teach_a_stream_what_it_would_not_learn_without():
    seen, unseen = (arm.demonstrate("1-3-5", n_episodes=10, length=40, random_state=i) for i in (0, 1))
    known = seen.projections.copy()
    known[::2] = np.nan
    error = {}
    for name, batch in (
        ("without", (seen.states, seen.actions, seen.episodes)),
        ("with", (seen.states, seen.actions, seen.episodes, known)),
    ):
        policy = uc.fit_stream(uc.ParametricPolicy(risk="inconsistency", alpha="cv"), [batch])
        P = policy.predict(unseen.states)
        error[name] = risk.normalized(risk.unconstrained_policy_error(unseen.policy, P), unseen.policy)
    assert error["with"] < 1e-6
    assert error["with"] < error["without"] / 100


def test_columns_not_needed_are_not_read(tmp_path, columns_read):
    folder = written.write(tmp_path / "parts", X, U, EPISODES, TIME, [], more=TOUCHED)
    one = {"state": ["x0"], "action": ["u1"], "episode": "episode_index"}
    uc.fit_stream(
        uc.LocallyLinearPolicy(n_centers=2, risk="inconsistency", alpha=1e-6),
        uc.open(folder, **one, force="f1", force_threshold=1.0, free="free"),
    )
    # First rows to see what there is and what the actions are, a sample to place centres on, and then all.
    assert columns_read[2:] == [["x0", "u1"], ["x0", "u1", "f1", "free", "episode_index"]]


# Checkpoints


@pytest.mark.parametrize("way", ["force", "lists"])
def test_an_interrupted_stream_goes_on(tmp_path, way):
    folder = written.write(tmp_path / "parts", X, U, EPISODES, TIME, [100, 333], more=TOUCHED)
    options = COLUMNS | WAYS[way]
    whole = uc.fit_stream(policies()[1], uc.open(folder, **options), batch_rows=64)
    told = []

    def stop(done, total):
        if done >= 200:
            raise KeyboardInterrupt

    policy, file = policies()[1], tmp_path / "run.npz"
    with pytest.raises(KeyboardInterrupt, match="goes on from there"):
        uc.fit_stream(policy, uc.open(folder, **options), batch_rows=64, progress=stop, checkpoint=file)
    uc.fit_stream(
        policy,
        uc.open(folder, **options),
        batch_rows=64,
        checkpoint=file,
        progress=lambda done, _: told.append(done),
    )
    assert told[0] >= 200
    np.testing.assert_array_equal(policy.predict(X), whole.predict(X))
    assert policy.n_known_constraints_ == whole.n_known_constraints_ > 0


def test_a_checkpoint_belongs_to_what_was_known(tmp_path):
    folder = written.write(tmp_path / "parts", X, U, EPISODES, TIME, [], more=TOUCHED)
    file = tmp_path / "run.npz"
    uc.fit_stream(
        uc.ParametricPolicy(risk="inconsistency", alpha=1e-6),
        uc.open(folder, **COLUMNS, **FORCE),
        checkpoint=file,
    )
    others = [{}, FORCE | {"force_threshold": 2.5}, FORCE | {"force": ["f1", "f0", "f2"]}, WAYS["lists"]]
    for other in [*others, FORCE | {"free": "free"}]:
        with pytest.raises(uc.errors.UnconstrainError, match="checkpoint of another source"):
            uc.fit_stream(
                uc.ParametricPolicy(risk="inconsistency", alpha=1e-6),
                uc.open(folder, **COLUMNS, **other),
                checkpoint=file,
            )
    file = tmp_path / "batches.npz"
    uc.fit_stream(uc.ParametricPolicy(risk="inconsistency", alpha=1e-6), [(X, U, None, N)], checkpoint=file)
    for batch in ((X, U), (X, U, None, np.full_like(N, np.nan))):
        with pytest.raises(uc.errors.UnconstrainError, match="checkpoint of another source"):
            uc.fit_stream(uc.ParametricPolicy(risk="inconsistency", alpha=1e-6), [batch], checkpoint=file)


# Mistakes


def spoilt(folder, name, values):
    return written.write(folder, X, U, EPISODES, TIME, [200], more=TOUCHED | {name: values})


def changed(name, row, value):
    values = np.array(TOUCHED[name])
    values[row] = value
    return values


LONG = pa.array([np.eye(3).ravel()[: 8 if i == 207 else 9] for i in range(len(X))])


@pytest.mark.parametrize(
    ("name", "values", "way", "sentence"),
    [
        (
            "n4",
            changed("n4", np.flatnonzero(~np.isnan(N[:, 0, 0]) & (np.arange(len(X)) >= 207))[0], np.nan),
            "columns",
            r"part-1.parquet: the projection at row \d+ .* neither finite numbers throughout nor NaN throughout",
        ),
        ("N", LONG, "lists", "part-1.parquet: column 'N' holds a list of 8 at row 7 .* 9 numbers are needed"),
        ("n0", np.full(len(X), "a"), "columns", "part-0.parquet: column 'n0' holds 'a' at row 0"),
        ("N", pa.array([{"a": 1.0}] * len(X)), "lists", "'N' stands for 1"),
        ("N", pa.array([[2.0] * 9] * len(X)), "lists", "part-0.parquet: the projection at row 0 .* is none"),
        ("f1", changed("f1", 207, np.nan), "force", "part-1.parquet: column 'f1' holds nan at row 7"),
        ("free", np.full(len(X), "yes"), "free", "part-0.parquet: column 'free' holds 'yes' at row 0"),
        ("free", changed("free", 207, 2.0), "free", "part-1.parquet: column 'free' holds 2 at row 7"),
    ],
)
def test_broken_files_are_named(tmp_path, name, values, way, sentence):
    policy = uc.ParametricPolicy(risk="inconsistency", alpha=1e-6)
    with pytest.raises(uc.errors.DataError, match=sentence) as caught:
        uc.fit_stream(policy, uc.open(spoilt(tmp_path / "parts", name, values), **COLUMNS, **WAYS[way]))
    assert "\n" not in str(caught.value)
    assert not hasattr(policy, "moments_")


@pytest.mark.parametrize(
    ("risk", "source", "options", "sentence"),
    [
        ("inconsistency", None, FORCE | WAYS["lists"], "projections= and force= both say"),
        ("inconsistency", None, WAYS["free"] | WAYS["lists"], "projections= and free= both say"),
        ("inconsistency", None, {"force": FORCE["force"]}, "give force_threshold=, above which"),
        ("inconsistency", None, {"force_threshold": 2.0}, "force_threshold= is for forces"),
        (
            "inconsistency",
            None,
            FORCE | {"force_threshold": 0.0},
            "force_threshold must be a positive number",
        ),
        (
            "inconsistency",
            None,
            FORCE | {"force_threshold": "2"},
            "force_threshold must be a positive number",
        ),
        ("inconsistency", None, FORCE | {"force": ["f0", "f1"]}, "2 force columns and 3 actions"),
        ("inconsistency", None, FORCE | {"force": ["f0", "f1", "fz"]}, r"no column 'fz' for force"),
        ("inconsistency", None, {"free": "N"}, "lists that are missing|stands for 9"),
        ("inconsistency", None, {"projections": ["n0", "n1"]}, "9 columns of numbers, .* stands for 2"),
        ("inconsistency", None, {"projections": "M"}, "no column 'M' for projections"),
        ("direct", [(X, U, None, N)], {}, 'projections are for risk="inconsistency"'),
        ("inconsistency", [(X, U)], {"projections": "N"}, "projections= chooses a column of files"),
        ("inconsistency", [(X, U)], {"free": "free"}, "free= chooses a column of files"),
        ("inconsistency", [(X, U), (X, U, None, N)], {}, "batch 1 .* has projections but the first has none"),
        (
            "inconsistency",
            [(X, U, None, N), (X, U)],
            {},
            "batch 1 .* has no projections but the first has some",
        ),
        ("inconsistency", [(X, U, None, N[:3])], {}, "batch 0 .*: projections must have shape"),
        ("inconsistency", [(X, U, None, 2 * N)], {}, r"batch 0 .*: the projection of row \d+ is none"),
        (
            "inconsistency",
            [(X, U, None, [["a"]] * len(X))],
            {},
            "batch 0 .*: projections must be an array of numbers",
        ),
        ("inconsistency", [("abc", U, None, N)], {}, "X of batch 0 must be an array of numbers"),
        ("inconsistency", [([[1.0, 2.0], [3.0]], U[:2])], {}, "X of batch 0 must be an array of numbers"),
        (
            "inconsistency",
            [(X, U, None, N, N)],
            {},
            r"\(X, U\), \(X, U, groups\) or \(X, U, groups, projections\)",
        ),
    ],
)
def test_mistakes_are_told_in_one_sentence(tmp_path, risk, source, options, sentence):
    policy = uc.ParametricPolicy(risk=risk, alpha=1e-6)
    columns = {} if source is not None else COLUMNS
    source = source or written.write(tmp_path / "parts", X, U, EPISODES, TIME, [], more=TOUCHED)
    with pytest.raises(uc.errors.UnconstrainError, match=sentence) as caught:
        uc.fit_stream(policy, uc.open(source, **columns, **options))
    assert "\n" not in str(caught.value)
    assert not hasattr(policy, "moments_")


def test_flags_may_be_booleans_or_say_so(tmp_path):
    free = np.array(TOUCHED["free"]) == 1
    whole = uc.fit_stream(
        uc.ParametricPolicy(risk="inconsistency", alpha=1e-6),
        uc.open(spoilt(tmp_path / "ones", "free", free * 1), **COLUMNS, **WAYS["free"]),
    )
    for name, flags in [("booleans", free), ("text", free.astype(str))]:
        folder = spoilt(tmp_path / name, "free", flags)
        policy = uc.fit_stream(
            uc.ParametricPolicy(risk="inconsistency", alpha=1e-6), uc.open(folder, **COLUMNS, **WAYS["free"])
        )
        assert policy.n_known_constraints_ == whole.n_known_constraints_ == np.count_nonzero(free)
        np.testing.assert_array_equal(policy.predict(X), whole.predict(X))
        loaded = uc.load(folder / "part-0.parquet", **COLUMNS, free="free")
        np.testing.assert_array_equal(loaded.free, free[:200])


@pytest.mark.parametrize("unknown", [0, 1])
def test_a_file_may_know_no_projection(tmp_path, unknown):
    folder = written.write(tmp_path / "parts", X, U, EPISODES, TIME, [200], more=TOUCHED)
    path = folder / f"part-{unknown}.parquet"
    table = pq.read_table(path)
    at = table.schema.get_field_index("N")
    rows = slice(200) if unknown == 0 else slice(200, None)
    known = N.copy()
    known[rows] = np.nan
    whole = uc.fit_stream(uc.ParametricPolicy(risk="inconsistency", alpha=1e-6), [(X, U, EPISODES, known)])
    for nothing in (pa.nulls(len(table)), pa.array([[]] * len(table), pa.list_(pa.float64()))):
        pq.write_table(table.set_column(at, "N", nothing), path)
        policy = uc.fit_stream(
            uc.ParametricPolicy(risk="inconsistency", alpha=1e-6), uc.open(folder, **COLUMNS, **WAYS["lists"])
        )
        assert policy.n_known_constraints_ == whole.n_known_constraints_
        np.testing.assert_allclose(policy.predict(X), whole.predict(X), rtol=1e-9)


def test_an_episode_that_comes_back_has_no_neighbours(tmp_path):
    episodes = EPISODES.copy()
    episodes[-10:] = episodes[0]
    folder = written.write(tmp_path / "parts", X, U, episodes, TIME, [], more=TOUCHED)
    with pytest.raises(
        uc.errors.DataError, match=r"goes on at row .* to filter the forces of a stream, sort it"
    ):
        uc.fit_stream(
            uc.ParametricPolicy(risk="inconsistency", alpha=1e-6),
            uc.open(folder, **COLUMNS, **FORCE),
            batch_rows=50,
        )
    # Flags and projections say what they say, wherever their samples are.
    for way in ("free", "lists"):
        uc.fit_stream(
            uc.ParametricPolicy(risk="inconsistency", alpha=1e-6),
            uc.open(folder, **COLUMNS, **WAYS[way]),
            batch_rows=50,
        )
