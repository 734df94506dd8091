import numpy as np
import pyarrow.parquet as pq
import pytest

import unconstrain as uc
from tests import written
from tests.scaling import test_stream_known as known
from tests.scaling.test_stream import EPISODES, TIME, U, X, assert_same_fit
from unconstrain.fitting.accumulator import Accumulator

COLUMNS = ("--state", "x0,x1,x2", "--action", "u0,u1,u2", "--episode", "episode_index")


@pytest.fixture
def folder(tmp_path):
    return written.write(tmp_path / "parts", X, U, EPISODES, TIME, [100, 333]).name


@pytest.fixture
def touched(tmp_path):
    return written.write(tmp_path / "felt", X, U, EPISODES, TIME, [], more=known.TOUCHED).name


def test_noise_is_found_in_a_stream(run, folder):
    code, out, err = run("fit", folder, *COLUMNS, "--risk", "corrected", "--checkpoint", "run.npz")
    assert code == 0, err
    assert "noise: " in out
    assert "λ: " in out
    assert uc.load_policy("policy.skops").noise_ > 0


def test_a_folder_is_read_as_a_stream(run, folder):
    code, out, err = run(
        "fit", folder, *COLUMNS, "--model", "linear", "--resumable", "--checkpoint", "run.npz"
    )
    assert code == 0, err
    assert f"read: {len(X)} samples in {len(np.unique(EPISODES))} episodes" in out
    assert "held-out log-likelihood of a sample" in out
    assert "not compared with ordinary regression" in out
    assert f"{len(X)} of {len(X)} rows" in err
    assert_same_fit(
        uc.load_policy("policy.skops"), uc.ParametricPolicy(alpha="cv").fit(X, U, groups=EPISODES)
    )
    code, _, err = run("fit", folder, *COLUMNS, "--model", "rbf", "--checkpoint", "run.npz", "--overwrite")
    assert code == 2
    assert "checkpoint of another policy" in err


def test_other_folders_are_read_as_the_one_learnt_from(run, folder):
    code, out, err = run("fit", folder, *COLUMNS, "--model", "linear")
    assert code == 0, err
    assert "unconstrain evaluate policy.skops" in out
    code, out, err = run("evaluate", "policy.skops", folder)
    assert code == 0, err
    assert f"read: {len(X)} samples, {len(np.unique(EPISODES))} episodes" in out


def test_a_folder_is_read_at_once_if_it_fits_into_memory(run, folder, monkeypatch):
    code, out, err = run("fit", folder, *COLUMNS, "--model", "linear")
    assert code == 0, err
    assert "verdict: " in out
    at_once = uc.load_policy("policy.skops").predict(X)
    monkeypatch.setattr("unconstrain.recordings.source.available_memory", lambda: 1000.0)
    code, out, err = run("fit", folder, *COLUMNS, "--model", "linear", "--overwrite")
    assert code == 0, err
    assert "held-out log-likelihood of a sample" in out
    assert "verdict: " not in out
    np.testing.assert_allclose(uc.load_policy("policy.skops").predict(X), at_once, atol=1e-9)


def test_what_needs_all_data_gets_a_folder_at_once(run, folder, tmp_path):
    code, out, err = run(
        "fit", folder, *COLUMNS, "--model", "linear", "--figure", "a.png", "--min-speed", "0.01"
    )
    assert code == 0, err
    assert "verdict: " in out
    assert (tmp_path / "a.png").exists()


def test_a_cluster_of_this_machine(run, folder):
    pytest.importorskip("distributed")
    code, _, err = run("fit", folder, *COLUMNS, "--model", "linear", "--resumable", "--cluster", "local")
    assert code == 0, err
    assert_same_fit(
        uc.load_policy("policy.skops"), uc.ParametricPolicy(alpha="cv").fit(X, U, groups=EPISODES)
    )


def test_a_worker_that_cannot_read_says_so_in_one_sentence(run, touched):
    pytest.importorskip("distributed")
    options = ("--free", "x0", "--cluster", "local")
    code, _, err = run("fit", touched, *COLUMNS, *options)
    assert code == 2
    assert "column 'x0' holds" in err
    assert "Traceback" not in err


def test_names_that_hold_commas_are_quoted(run, tmp_path):
    table = pq.read_table(written.write(tmp_path / "parts", X, U, EPISODES, TIME, []) / "part-0.parquet")
    names = ["größe, in m" if name == "x0" else name for name in table.column_names]
    pq.write_table(table.rename_columns(names), tmp_path / "named.parquet")
    code, out, err = run(
        "fit", "named.parquet", "--state", '"größe, in m", x1,x2', *COLUMNS[2:], "--model", "linear"
    )
    assert code == 0, err
    assert "states größe, in m, x1, x2" in out


@pytest.mark.parametrize("where", [(), ("--checkpoint", "run.npz"), ("--cluster", "local")])
def test_what_is_known_of_constraints_is_used(run, touched, where):
    if "--cluster" in where:
        pytest.importorskip("distributed")
    options = ("--force", "f0,f1,f2", "--force-threshold", 2, "--free", "free")
    code, out, err = run("fit", touched, *COLUMNS, "--model", "linear", "--resumable", *options, *where)
    assert code == 0, err
    whole = known.in_memory(
        uc.ParametricPolicy(alpha="cv"), f"{touched}/part-0.parquet", known.COLUMNS, "force and free"
    )[0]
    assert f"constraints: known of {whole.n_known_constraints_ / len(X):.1%} of the samples" in out
    known.assert_same_known(uc.load_policy("policy.skops"), whole)


def test_files_that_uc_save_wrote_need_no_more_than_the_columns_that_tell(run, tmp_path):
    demos = uc.Demonstrations(X, U, EPISODES, free=known.TOUCHED["free"])
    (tmp_path / "saved").mkdir()
    demos.save(tmp_path / "saved" / "a.parquet")
    code, out, err = run("fit", "saved", "--model", "linear", "--free", "free")
    assert code == 0, err
    assert f"constraints: known of {demos.free.mean():.1%} of the samples" in out
    assert uc.load_policy("policy.skops").n_known_constraints_ == demos.free.sum()


def test_ctrl_c_says_how_to_go_on(run, folder, monkeypatch):
    sums, calls = Accumulator.sums, []

    def interrupted(self, *args, **kwargs):
        calls.append(1)
        if len(calls) == 1:
            raise KeyboardInterrupt  # which is what the main thread sees when it asks for the result
        return sums(self, *args, **kwargs)

    monkeypatch.setattr(Accumulator, "sums", interrupted)
    arguments = ("fit", folder, *COLUMNS, "--model", "linear", "--checkpoint", "run.npz")
    code, _, err = run(*arguments)
    assert code == 130
    assert "the same call with checkpoint run.npz goes on from there" in err
    assert "nothing was left half written" in err
    code, _, err = run(*arguments)
    assert code == 0, err


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (("--force", "f0,f1,f2"), "--force-threshold"),
        (("--free", "u9"), "no column 'u9' for free"),
        (
            ("--free", "x0", "--risk", "direct"),
            "leave out --risk direct, or else --force, --free, --projections and --constraint",
        ),
        (("--figure", "a.png", "--cluster", "local"), "--figure needs all data in memory"),
        (("--model", "auto", "--checkpoint", "a.npz"), "--model auto needs all data in memory"),
        (("--cluster", "local", "--checkpoint", "a.npz"), "leave out --checkpoint or --cluster"),
        (("--cluster", "tcp://127.0.0.1:1"), "no Dask scheduler answered"),
    ],
)
def test_mistakes_are_told_in_one_sentence(run, folder, options, sentence):
    code, _, err = run("fit", folder, *COLUMNS, *options)
    assert code == 2
    assert sentence in err
    assert "Traceback" not in err
