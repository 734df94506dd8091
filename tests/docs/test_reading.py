"""The table of docs/reading.md: every command prints what its row says."""

import contextlib
import io
import re
import shlex
from pathlib import Path

import numpy as np
import pytest

import unconstrain as uc
from unconstrain import limit_cycle as toy
from unconstrain.cli.app import run
from unconstrain.recordings.text import write_csv

ROOT = Path(__file__).parents[2]
DATA = ROOT.parent / "shared" / "data"
PAGE = (ROOT / "docs" / "reading.md").read_text(encoding="utf-8")
ROWS = re.findall(r"^\|[^|]*\| `(unconstrain [^`]+)` \| (.+?) \|$", PAGE, flags=re.MULTILINE)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The files of the table: real recordings, found by their names, and those that are written here."""
    place = tmp_path_factory.mktemp("reading")
    for path in DATA.rglob("*"):
        link = place / path.name
        if not link.exists():
            link.symlink_to(path)
    demos = toy.demonstrate(40, random_state=0)
    write_csv(demos, place / "movements.csv")
    demos.save(place / "saved.npz")
    t = np.arange(200) / 50
    pos = np.stack([np.cos(t), np.sin(t)], axis=1)
    np.savez(place / "arrays.npz", t=t, pos=pos, vel=pos[:, ::-1] * [-1, 1])
    x = np.random.default_rng(0).normal(size=(200, 2)).cumsum(axis=0)
    ends = np.array([50, 120, 200])
    np.savez(place / "replay.npz", **{"data/state": x, "data/action": x, "meta/episode_ends": ends})
    last = np.isin(np.arange(200), ends - 1)
    np.savez(place / "d4rl.npz", observations=x, terminals=last & (np.arange(200) < 60), timeouts=last)
    return place


def say(words):
    said = io.TextIOWrapper(io.BytesIO(), encoding="utf-8")
    with contextlib.redirect_stdout(said):
        code = run(words)
    said.flush()
    return code, said.buffer.getvalue().decode()


@pytest.mark.parametrize(("command", "told"), ROWS)
def test_a_row_is_what_its_command_prints(folder, command, told):
    program, *words = shlex.split(command)
    assert program == "unconstrain"
    with contextlib.chdir(folder):
        if not DATA.is_dir() and not Path(words[1]).exists():
            pytest.skip("the recordings are not part of the project")
        code, said = say(words)
    assert code == 0
    assert told in " ".join(said.split())


def test_what_is_converted_is_read_again(folder):
    block = re.findall(r"```sh\n(.*?)```", PAGE, flags=re.DOTALL)[1]
    with contextlib.chdir(folder):
        for line in block.strip().splitlines():
            assert say(shlex.split(line)[1:])[0] == 0
        for name in ("movements.parquet", "movements-lerobot"):
            assert len(uc.load(name)) == len(uc.load("saved.npz"))
