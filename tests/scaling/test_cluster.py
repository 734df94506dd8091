import os
import pickle
import signal
import sys

import numpy as np
import pytest
from sklearn.preprocessing import FunctionTransformer

import unconstrain as uc
from tests import written
from tests.scaling import test_stream_adaptive as adaptive
from tests.scaling import test_stream_known as known
from tests.scaling.test_stream import COLUMNS, EPISODES, ROLES, TIME, U, X, assert_same_fit, policies, spoilt
from unconstrain.scaling import cluster as distributed
from unconstrain.scaling import stream
from unconstrain.scaling.stream import fit_stream

dask = pytest.importorskip("distributed")


@pytest.fixture(scope="module")
def cluster():
    """Two worker processes."""
    with dask.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as cluster:
        yield cluster


@pytest.fixture
def client(cluster):
    with dask.Client(cluster) as client:
        client.wait_for_workers(2)
        yield client


@pytest.mark.parametrize("which", range(4))
def test_a_cluster_gives_the_fit_of_all_at_once(tmp_path, client, which):
    folder = written.write(tmp_path / "parts", X, U, EPISODES, TIME, [100, 101, 333], row_group_size=40)
    whole = policies()[which].fit(X, U, groups=EPISODES)
    policy = distributed.fit(
        policies()[which], uc.open(folder, **COLUMNS), client, part_rows=70, batch_rows=30
    )
    assert_same_fit(policy, whole)
    assert policy.resume().folds.fold_of == whole.resume().folds.fold_of


@pytest.mark.parametrize("which", [1, 2])
def test_noise_is_found_in_one_pass(tmp_path, client, which):
    folder = written.write(tmp_path / "parts", X, U, EPISODES, TIME, [100, 101, 333], row_group_size=40)
    whole = policies()[which].set_params(risk="corrected").fit(X, U, groups=EPISODES)
    policy = policies()[which].set_params(risk="corrected")
    distributed.fit(policy, uc.open(folder, **COLUMNS), client, part_rows=70, batch_rows=30)
    assert_same_fit(policy, whole)
    assert policy.noise_ == pytest.approx(whole.noise_, rel=1e-9)


@pytest.mark.parametrize("part_rows", [1, 45, 10_000])
def test_parts_of_whole_episodes_are_differentiated(tmp_path, client, part_rows):
    time = TIME.copy()
    for label in np.unique(EPISODES)[::3]:  # gaps, which make more episodes
        own = np.flatnonzero(label == EPISODES)
        time[own[len(own) // 2 :]] += 5.0
    folder = written.write(tmp_path / "parts", X, U, EPISODES, time, [100, 101, 333], lists=True)
    columns = ROLES | {"action": "differentiate", "time": "timestamp"}
    whole = fit_stream(policies()[2], uc.open(folder, **columns))
    policy = distributed.fit(policies()[2], uc.open(folder, **columns), client, part_rows=part_rows)
    assert_same_fit(policy, whole)
    assert policy.resume().folds.n_dealt == whole.resume().folds.n_dealt


def test_episodes_known_by_their_files(tmp_path, client):
    columns = {name: COLUMNS[name] for name in ("state", "action")}
    for cuts in ([], [100, 250, 400]):
        folder = written.write(tmp_path / str(len(cuts)), X, U, EPISODES, TIME, cuts, row_group_size=64)
        whole = fit_stream(uc.ParametricPolicy(risk="inconsistency", alpha="cv"), uc.open(folder, **columns))
        policy = distributed.fit(
            uc.ParametricPolicy(risk="inconsistency", alpha="cv"),
            uc.open(folder, **columns),
            client,
            part_rows=100,
        )
        assert_same_fit(policy, whole)


@pytest.mark.parametrize("part_rows", [45, 10_000])
@pytest.mark.parametrize("derived", [False, True])
@pytest.mark.parametrize("way", ["force and free", "free", "lists"])
def test_what_is_known_of_constraints_goes_along(tmp_path, client, way, derived, part_rows):
    folder = written.write(
        tmp_path / "parts", X, U, EPISODES, TIME, [100, 101, 333], more=known.TOUCHED, row_group_size=40
    )
    columns = COLUMNS | ({"action": None, "time": "timestamp"} if derived else {}) | known.WAYS[way]
    whole = fit_stream(known.policies()[1], uc.open(folder, **columns), batch_rows=10_000)
    policy = distributed.fit(
        known.policies()[1], uc.open(folder, **columns), client, part_rows=part_rows, batch_rows=30
    )
    known.assert_same_known(policy, whole)
    assert policy.resume().folds.n_dealt == whole.resume().folds.n_dealt
    if not derived:
        assert policy.resume().folds.fold_of == whole.resume().folds.fold_of


@pytest.mark.parametrize("cuts", [[], [100, 250, 400]])
def test_forces_of_a_file_stay_together_where_files_are_episodes(tmp_path, client, cuts):
    columns = {name: COLUMNS[name] for name in ("state", "action")} | known.FORCE
    folder = written.write(
        tmp_path / "parts", X, U, EPISODES, TIME, cuts, more=known.TOUCHED, row_group_size=64
    )
    whole = fit_stream(uc.ParametricPolicy(risk="inconsistency", alpha="cv"), uc.open(folder, **columns))
    policy = distributed.fit(
        uc.ParametricPolicy(risk="inconsistency", alpha="cv"),
        uc.open(folder, **columns),
        client,
        part_rows=100,
    )
    known.assert_same_known(policy, whole)
    assert policy.resume().folds.n_dealt == (len(cuts) + 1 if cuts else 5)


def test_what_counts_as_motion_does_not_depend_on_the_parts(tmp_path, client):
    actions = U.copy()
    actions[:200] = np.where(np.arange(200)[:, None] % 2, 1e-9, 1e-17)
    actions[400] = 3e3
    folder = written.write(tmp_path / "parts", X, actions, EPISODES, TIME, [200])
    policy = distributed.fit(
        uc.ParametricPolicy(risk="inconsistency", alpha=1e-3),
        uc.open(folder, **COLUMNS),
        client,
        part_rows=50,
    )
    assert_same_fit(policy, uc.ParametricPolicy(risk="inconsistency", alpha=1e-3).fit(X, actions))


def test_goes_on_where_a_fit_ended(tmp_path, client):
    today = written.write(tmp_path / "today", X[300:], U[300:], EPISODES[300:], TIME[300:], [100])
    whole = uc.ParametricPolicy(risk="inconsistency", alpha="cv").fit(X, U, groups=EPISODES)
    policy = uc.ParametricPolicy(risk="inconsistency", alpha="cv").fit(
        X[:300], U[:300], groups=EPISODES[:300]
    )
    distributed.fit(policy, uc.open(today, **COLUMNS), client, part_rows=50, partial=True)
    assert_same_fit(policy, whole)


def test_a_worker_killed_in_the_middle_changes_nothing(tmp_path, cluster, client):
    folder = written.write(tmp_path / "parts", X, U, EPISODES, TIME, [200, 400], row_group_size=20)
    features = FunctionTransformer(written.slowly)
    whole = uc.ParametricPolicy(FunctionTransformer(np.tanh), risk="inconsistency", alpha="cv").fit(
        X, U, groups=EPISODES
    )
    victim = cluster.workers[0].process.pid
    told = []

    def kill(done, total):
        told.append(done)
        if len(told) == 4:
            os.kill(victim, signal.SIGKILL)

    policy = uc.ParametricPolicy(features, risk="inconsistency", alpha="cv")
    distributed.fit(policy, uc.open(folder, **COLUMNS), client, part_rows=20, progress=kill)
    assert len(told) > 20  # most parts were still to come
    assert told[-1] == len(X)
    assert_same_fit(policy, whole)
    assert cluster.workers[0].process.pid != victim


@pytest.mark.parametrize(
    ("how", "sentence"),
    [
        ("pages", "part-1.parquet is damaged or not a Parquet file"),
        ("nan", "part-1.parquet: column 'x1' holds nan at row 17"),
        ("missing", "part-1.parquet has no column 'x1'"),
    ],
)
def test_broken_parts_are_named(tmp_path, client, how, sentence):
    policy = uc.ParametricPolicy(risk="inconsistency", alpha=1e-6)
    with pytest.raises(uc.errors.DataError, match=sentence) as caught:
        distributed.fit(policy, uc.open(spoilt(tmp_path / "parts", how), **COLUMNS), client, part_rows=50)
    assert "\n" not in str(caught.value)
    assert not hasattr(policy, "solution_")


def test_mistakes_about_constraints_are_told_in_one_sentence(tmp_path, client):
    episodes = EPISODES.copy()
    episodes[-10:] = episodes[0]
    folder = written.write(tmp_path / "parts", X, U, episodes, TIME, [], more=known.TOUCHED)
    for risk, options, sentence in (
        (
            "inconsistency",
            known.FORCE,
            "after others were read; to filter the forces of the data, sort them by episode",
        ),
        ("direct", known.WAYS["lists"], "projections are for risk"),
    ):
        policy = uc.ParametricPolicy(risk=risk, alpha=1e-6)
        with pytest.raises(uc.errors.UnconstrainError, match=sentence):
            distributed.fit(policy, uc.open(folder, **COLUMNS, **options), client, part_rows=50)
        assert not hasattr(policy, "solution_")


def test_mistakes_are_told_in_one_sentence(client, monkeypatch):
    with pytest.raises(uc.errors.DataError, match="a cluster learns from files"):
        distributed.fit(uc.ParametricPolicy(risk="inconsistency", alpha=1e-6), [(X, U)], client)
    with (
        pytest.raises(uc.errors.UnconstrainError, match=r"no Dask scheduler answered at tcp://127.0.0.1:1"),
        distributed.connected("tcp://127.0.0.1:1", timeout=0.5),
    ):
        pass
    monkeypatch.setitem(sys.modules, "distributed", None)
    with (
        pytest.raises(uc.errors.UnconstrainError, match=r"pip install 'unconstrain\[distributed\]'"),
        distributed.connected("local"),
    ):
        pass


@pytest.mark.parametrize(("make", "derived"), [(adaptive.parametric, False), (adaptive.local, True)])
def test_contact_is_inferred_in_as_many_passes_as_it_takes(tmp_path, client, make, derived):
    time = adaptive.TIME.copy()
    for label in np.unique(adaptive.EPISODES)[::3]:  # gaps, which make more episodes, dealt out on the spot
        own = np.flatnonzero(label == adaptive.EPISODES)
        time[own[len(own) // 2 :]] += 5.0
    folder = written.write(
        tmp_path / "parts", adaptive.X, adaptive.U, adaptive.EPISODES, time, [100, 101], row_group_size=20
    )
    columns = COLUMNS | ({"action": None, "time": "timestamp"} if derived else {})
    whole = fit_stream(make(), uc.open(folder, **columns))
    policy = distributed.fit(make(), uc.open(folder, **columns), client, part_rows=45, batch_rows=30)
    adaptive.assert_same(policy, whole)
    assert policy.history_[-1]["log_likelihood"] == pytest.approx(whole.history_[-1]["log_likelihood"])
    if not derived:
        adaptive.assert_same(policy, make().fit(adaptive.X, adaptive.U, groups=adaptive.EPISODES))
        assert policy.resume().folds.fold_of == whole.resume().folds.fold_of


def test_what_travels_is_what_the_documentation_says(tmp_path, client):
    sizes = []
    for name, times in (("once", 1), ("thrice", 3)):
        folder = written.write(
            tmp_path / name, *(np.tile(each.T, times).T for each in (X, U)), np.tile(EPISODES, times),
            np.tile(TIME, times), [100],
        )  # fmt: skip
        tables = pickle.loads(pickle.dumps(uc.open(folder, **COLUMNS).source))
        policy = uc.ParametricPolicy(risk="inconsistency", alpha="cv")
        empty = stream.begin(policy, tables, 100, 0, partial=False)
        folds = {label: i % 5 for i, label in enumerate(np.unique(EPISODES).tolist())}
        part = distributed._sum_of_part(
            distributed.Setup(empty, tables, 50), distributed.Part(0, tables.n_rows, folds)
        )
        sizes.append(len(pickle.dumps(part)))
    P = part.accumulator.total.moments[0].g.shape[0]
    assert (
        0 <= sizes[0] - 5 * 8 * (P * (P + 1) // 2 + P) < 8000
    )  # beside them: the model, and where states lie
    assert abs(sizes[1] - sizes[0]) < 1000

    def sent(dask_worker):
        return dask_worker.transfer_outgoing_bytes_total

    before = sum(client.run(sent).values())
    distributed.fit(
        uc.ParametricPolicy(risk="inconsistency", alpha="cv"),
        uc.open(folder, **COLUMNS),
        client,
        part_rows=50,
    )
    moved = sum(client.run(sent).values()) - before
    n_parts = len(list(distributed.divide(tables, 50, None)))
    assert 0 < moved <= (n_parts - 1) * sys.getsizeof(part) + 10_000
