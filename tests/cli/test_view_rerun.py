"""`unconstrain view --rerun`: a file for Rerun's viewer instead of the page."""

import pytest

from tests.cli.commands import COLUMNS

pytest.importorskip("rerun")


def test_a_file_for_rerun_is_written_once_and_nothing_is_served(run, movements, policy, tmp_path):
    command = ("view", policy, movements, *COLUMNS, "--time", "t", "--rerun")
    code, out, err = run(*command, "kept.rrd")
    assert code == 0, err
    assert "for Rerun's viewer: kept.rrd" in out
    assert "note: An arrow of the field" in out
    assert "page:" not in out
    written = (tmp_path / "kept.rrd").read_bytes()
    assert written[:4] == b"RRF2"
    for more, sentence in (
        (["kept.rrd"], "kept.rrd exists: give --overwrite to replace it"),
        (["kept.mcap"], "ends in .rrd"),
        (["new.rrd", "--robot", "arm.urdf"], "leave one of them out"),
        (["new.rrd", "--shown", "x1,x9"], "there is no state x9 for --shown"),
    ):
        code, _, err = run(*command, *more)
        assert code == 2
        assert sentence in err
    assert (tmp_path / "kept.rrd").read_bytes() == written
    assert not (tmp_path / "new.rrd").exists()
