import os

import pytest

from unconstrain.cli.outputs import check_outputs
from unconstrain.errors import UnconstrainError


@pytest.fixture
def files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "parts").mkdir()
    for name in ("d.csv", "old.skops", "parts/a.parquet"):
        (tmp_path / name).write_text("kept")
    os.symlink("d.csv", "soft.csv")
    os.link("d.csv", "hard.csv")
    os.symlink("nowhere", "dangling.skops")
    return tmp_path


@pytest.mark.parametrize("overwrite", [False, True])
@pytest.mark.parametrize(
    ("inputs", "out"),
    [
        (["d.csv"], "d.csv"),
        (["d.csv"], "./parts/../d.csv"),
        (["soft.csv"], "d.csv"),
        (["d.csv"], "soft.csv"),
        (["hard.csv"], "d.csv"),
        (["*.csv"], "d.csv"),
        (["parts"], "parts/a.parquet"),
    ],
)
def test_what_is_read_is_never_written(files, inputs, out, overwrite):
    with pytest.raises(UnconstrainError, match="read: choose another name"):
        check_outputs(inputs, {"out": files / out}, overwrite=overwrite)


def test_what_exists_is_replaced_only_if_told_to(files):
    out = files / "old.skops"
    with pytest.raises(UnconstrainError, match="exists: give overwrite="):
        check_outputs(["d.csv"], {"out": out}, overwrite=False)
    check_outputs(["d.csv"], {"out": out}, overwrite=True)
    check_outputs(["d.csv"], {"out": files / "new.skops"}, overwrite=False, continued={"checkpoint": out})
    (files / "parts" / "p.skops").write_text("kept")
    check_outputs(["parts"], {"out": files / "parts" / "p.skops"}, overwrite=True)
    assert out.read_text() == "kept"
    assert not (files / "new.skops").exists()


def test_two_outputs_are_two_files(files):
    with pytest.raises(UnconstrainError, match="out= and figure= are the same file"):
        check_outputs(
            [], {"out": files / "a.png", "figure": files / "parts" / ".." / "a.png"}, overwrite=True
        )
    with pytest.raises(UnconstrainError, match="out= and checkpoint= are the same file"):
        check_outputs([], {"out": files / "a"}, overwrite=True, continued={"checkpoint": files / "a"})


@pytest.mark.parametrize("out", ["parts", "nowhere/p.skops", "/dev/null"])
def test_what_cannot_be_written_is_told_before_the_work(files, out):
    with pytest.raises(UnconstrainError, match="cannot write"):
        check_outputs(["s3://bucket/folder", "d.csv"], {"out": files / out}, overwrite=True)
