"""The table of docs/reading.md: every command prints what its row says."""

import contextlib
import io
import json
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
    write_texts(place, t[:40], pos[:40])
    x = np.random.default_rng(0).normal(size=(200, 2)).cumsum(axis=0)
    ends = np.array([50, 120, 200])
    np.savez(place / "replay.npz", **{"data/state": x, "data/action": x, "meta/episode_ends": ends})
    last = np.isin(np.arange(200), ends - 1)
    np.savez(place / "d4rl.npz", observations=x, terminals=last & (np.arange(200) < 60), timeouts=last)
    return place


def write_texts(place, t, pos):
    """Write text as the programs of the table do."""

    def table(header, rows, mark=",", footer=""):
        return "\n".join([*header, *(mark.join(map(str, row)) for row in rows)]) + "\n" + footer

    rows = [(f"{s:.3f}", f"{x:.5f}", f"{y:.5f}") for s, (x, y) in zip(t, pos, strict=True)]
    half = table(["t,x,y"], rows)
    streams = [(s / 100, f"{np.cos(s / 100):.5f}", "") for s in range(200)]
    streams += [(s / 40 + 0.0003, "", f"{np.sin(s / 40):.5f}") for s in range(80)]
    texts = {
        "plotjuggler.csv": table(["__time,/pose/x,/pose/y"], sorted(streams)),
        "restarts.csv": half + half + "Total,1,2\n",
        "headers.csv": table(["time,hand,", ",x,y", "s,mm,mm"], rows),
        "excel.csv": "\ufeff"
        + table(["Zeit;x;y"], ((f"26.11.2026 14:03:0{s}", x, y) for s, x, y in rows), ";")
        .replace(".", ",")
        .replace("26,11,2026", "26.11.2026"),
        "kuka.log": table(
            ["ZeitInSec ZeitInNanoSec cartPos_X cartPos_Y"],
            ((1_700_000_000 + int(float(s)), round(float(s) % 1 * 1e9), x, y) for s, x, y in rows),
            " ",
        ),
        "qualisys.tsv": table(
            ["NO_OF_FRAMES\t40", "FREQUENCY\t100", "MARKER_NAMES\thand"],
            ((x, y, s) for s, x, y in rows),
            "\t",
        ),
        "records.json": json.dumps(
            {
                "frames": [
                    {"t": s, "pose": {"x": x, "y": y}}
                    for s, (x, y) in zip(t.tolist(), pos.tolist(), strict=True)
                ]
            }
        ),
    }
    for name, text in texts.items():
        (place / name).write_text(text, encoding="utf-8")


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
