import json

import numpy as np
import pytest

import unconstrain as uc
from tests import written
from tests.scaling.test_stream import assert_same_fit
from unconstrain.scaling.stream import fit_stream

X, U, EPISODES, TIME = written.movements(n_episodes=13)
X32, U32 = X.astype(np.float32).astype(float), U.astype(np.float32).astype(float)
NAMES = ["pan.pos", "lift.pos", "grip.pos"]


@pytest.mark.parametrize("version", ["v2.0", "v2.1", "v3.0"])
def test_known_layouts_need_no_columns(tmp_path, version):
    folder = written.lerobot(tmp_path / "robot", X, U, EPISODES, TIME, version)
    whole = uc.LocallyLinearPolicy(alpha="cv", n_centers=5).fit(X32, U32, groups=EPISODES)
    assert_same_fit(fit_stream(uc.LocallyLinearPolicy(alpha="cv", n_centers=5), folder), whole)


@pytest.mark.parametrize(
    "names",
    [NAMES, {"motors": NAMES}, {"arm": NAMES[:2], "gripper": NAMES[2:]}],
    ids=["list", "dict", "dicts"],
)
def test_components_go_by_the_names_the_dataset_gives_them(tmp_path, names):
    folder = written.lerobot(tmp_path / "robot", X, U, EPISODES, TIME, names=names)
    policy = fit_stream(
        uc.ParametricPolicy(risk="inconsistency", alpha=1e-6),
        uc.open(folder, state=["grip.pos", "pan.pos"], action="lift.pos"),
    )
    whole = uc.ParametricPolicy(risk="inconsistency", alpha=1e-6).fit(X32[:, [2, 0]], U32[:, [1]])
    assert_same_fit(policy, whole, X32[:, [2, 0]])
    by_place = ["observation.state[2]", "observation.state[0]"]
    policy = fit_stream(
        uc.ParametricPolicy(risk="inconsistency", alpha=1e-6),
        uc.open(folder, state=by_place, action=["action[1]"]),
    )
    assert_same_fit(policy, whole, X32[:, [2, 0]])


@pytest.mark.parametrize("names", [None, ["dim"], {"axes": ["x"]}, "motor"])
def test_names_that_name_no_components_are_left_alone(tmp_path, names):
    folder = written.lerobot(tmp_path / "robot", X, U, EPISODES, TIME, names=names)
    assert_same_fit(
        fit_stream(uc.ParametricPolicy(risk="inconsistency", alpha=1e-6), folder),
        uc.ParametricPolicy(risk="inconsistency", alpha=1e-6).fit(X32, U32),
    )


@pytest.mark.parametrize("version", ["v2.1", "v3.0"])
def test_action_may_be_the_derivative_of_the_state(tmp_path, version):
    folder = written.lerobot(tmp_path / "robot", X, U, EPISODES, TIME, version)
    paths = sorted((folder / "data").rglob("*.parquet"))
    demos = uc.load(paths, "observation.state", time="timestamp", episode="episode_index")
    whole = uc.ParametricPolicy(alpha="cv").fit(demos.states, demos.actions, groups=demos.episodes)
    policy = fit_stream(
        uc.ParametricPolicy(alpha="cv"), uc.open(folder, action="differentiate"), batch_rows=100
    )
    assert_same_fit(policy, whole, X32)


def changed(folder, **changes):
    path = folder / "meta" / "info.json"
    info = json.loads(path.read_text())
    path.write_text(json.dumps({**info, **changes}))


@pytest.mark.parametrize(
    ("spoil", "sentence"),
    [
        (lambda f: changed(f, codebase_version="v7.0"), "version v7.0, and those known are v2.0, v2.1, v3.0"),
        (lambda f: changed(f, total_frames=10**6), "where its meta/info.json says 1000000; download"),
        (lambda f: (f / "meta" / "info.json").write_text("{"), "info.json is damaged"),
        (
            lambda f: (f / "data" / "chunk-000" / "file-001.parquet").write_text(""),
            "file-001.parquet is empty",
        ),
    ],
)
def test_incomplete_datasets_are_refused_in_one_sentence(tmp_path, spoil, sentence):
    folder = written.lerobot(tmp_path / "robot", X, U, EPISODES, TIME)
    spoil(folder)
    with pytest.raises(uc.errors.DataError, match=sentence) as caught:
        fit_stream(uc.ParametricPolicy(alpha=1e-6), folder)
    assert "\n" not in str(caught.value)


def test_files_come_in_the_order_of_their_numbers(tmp_path):
    names = ["file-999.parquet", "file-1000.parquet", "file-1001.parquet"]
    folder = written.write(tmp_path / "parts", X, U, EPISODES, TIME, [100, 200])
    for i, name in reversed(list(enumerate(names))):
        (folder / f"part-{i}.parquet").rename(folder / name)
    policy = fit_stream(
        uc.ParametricPolicy(alpha="cv"), uc.open(folder, state="x0", action="u0", episode="episode_index")
    )
    assert list(policy.resume().folds.fold_of) == np.unique(EPISODES).tolist()


def test_an_episode_may_go_on_in_the_next_file(tmp_path):
    import pyarrow.parquet as pq

    folder = written.lerobot(tmp_path / "robot", X, U, EPISODES, TIME, "v3.0")
    path = next((folder / "data").rglob("*.parquet"))
    table = pq.read_table(path)
    half = len(table) // 2 + 1
    pq.write_table(table.slice(0, half), path)
    pq.write_table(table.slice(half), path.with_name("file-999.parquet"))
    assert uc.inspect(folder).episodes == uc.load(folder).n_episodes == 13


def test_the_cache_of_the_hub_is_followed(tmp_path):
    source = written.lerobot(tmp_path / "robot", X, U, EPISODES, TIME, "v3.0")
    cache = tmp_path / "datasets--user--name"
    (cache / "snapshots").mkdir(parents=True)
    source.rename(cache / "snapshots" / "abc123")
    (cache / "refs").mkdir()
    (cache / "refs" / "main").write_text("abc123")
    assert len(uc.load(cache)) == len(X)
