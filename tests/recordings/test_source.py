"""The one gateway: blocks hold what loading gives, whatever the format, the options and the size of the blocks."""

from itertools import pairwise

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import unconstrain as uc
from tests import written
from unconstrain.errors import DataError

X, U, EPISODES, TIME = written.movements(n_episodes=9)
TOUCHED = written.touched(U, EPISODES)
N = np.column_stack([TOUCHED[f"n{j}"] for j in range(9)]).reshape(-1, 3, 3)
BROKEN = TIME.copy()  # with a gap in the middle of every other episode, and a jump of the tracker
JUMPING = X.copy()
for i, label in enumerate(np.unique(EPISODES)):
    own = np.flatnonzero(label == EPISODES)
    BROKEN[own[len(own) // 2 :]] += 3.0 * (i % 2)
    JUMPING[own[len(own) // 3], 0] += 40.0 * (i % 3 == 0)
STAMPS = np.round(BROKEN * 1e9).astype(np.int64) + 1_498_555_031_990_452_357

COLUMNS = {f"x{j}": JUMPING[:, j] for j in range(3)} | {f"u{j}": U[:, j] for j in range(3)}
COLUMNS |= {"run": EPISODES, "t": STAMPS} | {name: TOUCHED[name] for name in ("f0", "f1", "f2", "free")}
COLUMNS |= {f"n{j}": TOUCHED[f"n{j}"] for j in range(9)}


def rows_of(path, start, stop):
    """Write these rows in the format that the suffix says."""
    columns = {name: values[start:stop] for name, values in COLUMNS.items()}
    if path.suffix == ".parquet":
        pq.write_table(pa.table(columns), path, row_group_size=45)
    elif path.suffix == ".npz":
        np.savez(path, **columns)
    else:
        lines = [",".join(columns)]
        for row in zip(*(values.tolist() for values in columns.values()), strict=True):
            lines.append(",".join("" if value != value else repr(value) for value in row))
        path.write_text("\n".join(lines) + "\n")


def sources(folder, form, cuts):
    """Recordings in one of the forms that `open` takes, and whether their columns have to be said."""
    bounds = [0, *cuts, len(X)]
    parts = list(pairwise(bounds))
    if form == "demonstrations":
        return whole_demonstrations(), False
    if form.startswith("saved"):
        paths = [folder / f"part-{i}{form.removeprefix('saved')}" for i in range(len(parts))]
        for path, (a, b) in zip(paths, parts, strict=True):
            whole_demonstrations().select(slice(a, b)).save(path)
        return paths, False
    if form == "folder":
        for i, (a, b) in enumerate(parts):
            rows_of(folder / f"part-{i}.parquet", a, b)
        return folder, True
    paths = [folder / f"part-{i}{form}" for i in range(len(parts))]
    for path, (a, b) in zip(paths, parts, strict=True):
        rows_of(path, a, b)
    return paths, True


def whole_demonstrations():
    return uc.Demonstrations(
        JUMPING, U, EPISODES, BROKEN, U, N, forces=np.column_stack([TOUCHED[f"f{j}"] for j in range(3)]),
        free=TOUCHED["free"], notes=["said before"],
    )  # fmt: skip


CONSTRAINTS = [
    {},
    {"free": "free"},
    {"force": ["f0", "f1", "f2"]},
    {"force": ["f0", "f1", "f2"], "force_threshold": 2.0},
    {"force": ["f0", "f1", "f2"], "force_threshold": 2.0, "free": "free"},
    {"projections": [f"n{j}" for j in range(9)]},
]
FORMS = [".csv", ".npz", ".parquet", "folder", "saved.npz", "saved.parquet", "demonstrations"]


def outcome(read):
    """What is read, or the sentence that says why it cannot be."""
    try:
        return read(), None
    except DataError as error:
        return None, str(error)


@settings(deadline=None, max_examples=150, suppress_health_check=[HealthCheck.too_slow])
@given(
    st.sampled_from(FORMS),
    st.lists(st.integers(1, len(X) // 60 - 1), max_size=3, unique=True).map(sorted),
    st.integers(1, 2 * len(X)),
    st.booleans(),
    st.booleans(),
    st.sampled_from(CONSTRAINTS),
    st.fixed_dictionaries(
        {},
        optional={
            "gap": st.sampled_from([0.5, 10.0]),
            "max_speed": st.sampled_from([50.0, 500.0]),
            "min_speed": st.sampled_from([0.5, 2.0]),
            "min_duration": st.sampled_from([0.1, 0.5]),
            "window": st.sampled_from([0.1, 0.3]),
            "time_unit": st.sampled_from(["ns", "us"]),
        },
    ),
    st.sampled_from(["u", "differentiate", "no time"]),
)
def test_blocks_hold_what_loading_gives(
    tmp_path_factory, form, cuts, batch_rows, shifted, labelled, constraints, options, action
):
    folder = tmp_path_factory.mktemp("law")
    source, said = sources(folder, form, [60 * cut + 7 * shifted for cut in cuts])
    columns = {}
    if said:
        columns = {"state": ["x0", "x1", "x2"], "time": "t"} | constraints
        columns |= {"episode": "run"} if labelled else {}
        columns |= {} if action == "differentiate" else {"action": ["u0", "u1", "u2"]}
        if action == "no time":
            del columns["time"]
    elif action == "differentiate":
        columns = {"action": "differentiate"}
    whole, refused = outcome(lambda: uc.open(source, **columns, **options).load())
    recordings, sentence = outcome(lambda: uc.open(source, **columns, **options))
    if recordings is None:
        assert sentence == refused
        return
    blocks, sentence = outcome(lambda: list(recordings.blocks(batch_rows)))
    if whole is None:
        assert blocks is None
        return
    assert blocks is not None, sentence
    for name in ("states", "actions", "time", "projections", "forces", "free", "policy"):
        expected, parts = getattr(whole, name), [getattr(block, name) for block in blocks]
        if expected is None:
            assert all(part is None for part in parts)
        else:
            np.testing.assert_array_equal(np.concatenate(parts), expected, err_msg=name)
    assert [block.episode_labels[code] for block in blocks for code in block.episodes] == [
        whole.episode_labels[code] for code in whole.episodes
    ]
    assert tuple(map(str, recordings.notes)) == whole.notes
    assert {block.state_names + block.action_names for block in blocks} == {
        whole.state_names + whole.action_names
    }


@settings(deadline=None, max_examples=30)
@given(
    st.lists(st.integers(1, len(X) - 1), max_size=5, unique=True).map(sorted),
    st.integers(1, 700),
    st.booleans(),
    st.sampled_from([None, 1.0]),
)
def test_batches_of_arrays_are_read_alike(cuts, batch_rows, known, min_speed):
    bounds = [0, *cuts, len(X)]

    def batches():
        for a, b in pairwise(bounds):
            yield X[a:b], U[a:b], EPISODES[a:b], *([N[a:b]] if known else [])

    whole = uc.load(batches, min_speed=min_speed)
    recordings = uc.open(batches(), min_speed=min_speed)
    blocks = list(recordings.blocks(batch_rows))
    np.testing.assert_array_equal(np.concatenate([block.states for block in blocks]), whole.states)
    labels = [block.episode_labels[code] for block in blocks for code in block.episodes]
    assert labels == [whole.episode_labels[code] for code in whole.episodes]
    assert tuple(map(str, recordings.notes)) == whole.notes
    if known:
        np.testing.assert_array_equal(
            np.concatenate([block.projections for block in blocks]), whole.projections
        )


@pytest.mark.parametrize("form", FORMS)
def test_a_stream_learns_what_is_learnt_of_all_at_once(tmp_path, form):
    ends = np.flatnonzero(np.diff(EPISODES)) + 1
    source, said = sources(tmp_path, form, ends[[2, 5]].tolist())
    columns = {"action": "differentiate", "max_speed": 100.0, "min_speed": 2.0}
    if said:
        columns |= {"state": ["x0", "x1", "x2"], "time": "t", "episode": "run"}
        columns |= {"force": ["f0", "f1", "f2"], "force_threshold": 2.0}
    recordings = uc.open(source, **columns)
    demos = recordings.load()
    notes = recordings.notes
    whole = uc.ParametricPolicy(alpha="cv").fit(demos)
    streamed = uc.fit_stream(uc.ParametricPolicy(alpha="cv"), recordings, batch_rows=50)
    np.testing.assert_allclose(streamed.predict(X), whole.predict(X), rtol=1e-6, atol=1e-9)
    assert streamed.n_known_constraints_ == whole.n_known_constraints_
    assert recordings.notes == notes
    assert {note.kind for note in notes} >= {"speed", "slow"}
    assert streamed.recording_ == (
        uc.Columns(**{name: value for name, value in columns.items() if hasattr(uc.Columns(), name)}),
        uc.Preparation(**{name: value for name, value in columns.items() if hasattr(uc.Preparation(), name)}),
    )


def test_a_stream_counts_the_fragments_of_one_long_episode_as_loading_does(tmp_path):
    t = np.arange(200) / 50 + 5.0 * (np.arange(200) >= 100)
    path = tmp_path / "a.csv"
    np.savetxt(path, np.column_stack([t, np.sin(t)]), delimiter=",", header="t,x", comments="")
    recordings = uc.open(path, state="x", time="t")
    notes = [note for block in recordings.source.blocks(1000) for note in block.load().notes]
    said = [str(note) for note in recordings.findings(notes)]
    assert said == list(recordings.load().notes)
    assert "200 samples, 2 episodes, 1 file, 50 Hz, 3.96 s" in said[-1]
