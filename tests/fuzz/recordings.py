"""Recordings: every format in many dresses, whole, with odd values, with damaged bytes, or asked for wrongly."""

import csv
import io
import os
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

import unconstrain as uc
from tests import written
from tests.fuzz.engine import Case
from tests.fuzz.values import CELLS, NUMBERS, OBJECTS, TEXTS, anything, damaged, pick, shown, strange_place
from unconstrain.errors import UnconstrainError

NAMES = (
    "x", "y", "z", "u", "v", "w", "a b", "λ", "x [mm]", "a=b", "-x", "[/red]", "\x1b[31mx", "'", "x/y", "state.pos",
    "%s", "{x}", "ß", "日本", "#h", "q\\n", "Time (s)",
)  # fmt: skip


@dataclass
class Recording:
    """What is on the disk, how it is to be read, and what is in it.

    Parameters
    ----------
    source : object
        What is given to `load`.
    how : dict
        Which column is what.
    states, actions, episodes : array
        What was written.
    exact : bool
        Whether it was written in double precision.
    done : list of str
        What was done to it since.
    """

    source: Any
    how: dict[str, Any]
    states: np.ndarray
    actions: np.ndarray
    episodes: np.ndarray
    exact: bool = True
    done: list[str] = field(default_factory=list)


class Table:
    """Columns that can be written in any format, and what they say."""

    def __init__(self, rng: np.random.Generator) -> None:
        n, count = int(rng.integers(1, 4)), int(rng.integers(4, 60))
        many = int(rng.integers(1, 4))
        names = rng.permutation(NAMES).tolist()
        self.states = rng.normal(size=(count, n)).round(6) * pick(rng, (1.0, 1.0, 1e3, 1e-3))
        self.actions = rng.normal(size=(count, n)).round(6)
        self.episodes = np.sort(np.arange(count) % many)
        self.time = 0.02 * np.arange(count) + pick(rng, (0.0, 10.0, 1.7e9))
        self.state_names, self.action_names = names[:n], names[n : 2 * n]
        self.columns: dict[str, Any] = {"t": self.time.tolist(), "run": self.episodes.tolist()}
        self.columns |= {name: self.states[:, i].tolist() for i, name in enumerate(self.state_names)}
        self.columns |= {name: self.actions[:, i].tolist() for i, name in enumerate(self.action_names)}
        self.how: dict[str, Any] = {"state": list(self.state_names), "action": list(self.action_names)}
        if rng.random() < 0.7:
            self.how["time"] = "t"
        if many > 1 or rng.random() < 0.5:
            self.how["episode"] = "run"
        else:
            self.episodes = np.zeros(count, dtype=int)
            self.columns["run"] = self.episodes.tolist()
        self.done: list[str] = []

    def spoil(self, rng: np.random.Generator) -> None:
        """Change some of what the columns hold."""
        name = pick(rng, list(self.columns))
        values = list(self.columns[name])
        way = int(rng.integers(9)) if values else 8
        if way == 5 and any(isinstance(v, list | dict | tuple | bytes) for v in values):
            way = 8
        if way <= 3:
            for _ in range(int(rng.integers(1, 3))):
                value = pick(rng, [*NUMBERS, *TEXTS, *CELLS, [1.0], [], [[1]], b"x", {"a": 1}])
                values[int(rng.integers(len(values)))] = value
            self.done.append(f"{name!r} holds {shown(value)}")
        elif way == 4:
            values = [pick(rng, [*NUMBERS, *TEXTS])] * len(values)
            self.done.append(f"{name!r} is all {shown(values[0])}")
        elif way == 5:
            values = list(rng.permutation(np.array(values)).tolist())
            self.done.append(f"{name!r} is shuffled")
        elif way == 6:
            values = [
                v * pick(rng, (1e160, 1e308, 1e-200, 0, 1e20)) if isinstance(v, float) else v for v in values
            ]
            self.done.append(f"{name!r} is scaled")
        elif way == 7:
            count = int(pick(rng, (0, 1, 2, 3)))
            self.columns = {key: list(each)[:count] for key, each in self.columns.items()}
            self.done.append(f"{count} rows")
            return
        else:
            del self.columns[name]
            self.done.append(f"{name!r} is missing")
            return
        self.columns[name] = values


def _text(rng: np.random.Generator, table: Table, folder: Path) -> Any:
    delimiter = pick(rng, ",,;\t ")
    headed = rng.random() < 0.8
    columns = {name: [_cell(v) for v in values] for name, values in table.columns.items()}
    if delimiter == " ":
        columns = {name.replace(" ", "_"): values for name, values in columns.items()}
        table.how = {k: _renamed(v) for k, v in table.how.items()}
    if not headed:
        order = list(columns)
        table.how = {k: _places(v, order) for k, v in table.how.items()}
    file = io.StringIO()
    writer = csv.writer(file, delimiter=delimiter, lineterminator=pick(rng, ("\n", "\r\n", "\n")))
    if headed:
        writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    text = file.getvalue()
    if rng.random() < 0.2:
        text = f"# made by a program\n{text}\n\n"
    encoding = pick(rng, ("utf-8", "utf-8", "utf-8-sig"))
    if rng.random() < 0.05:
        encoding = pick(rng, ("utf-16", "utf-16-le", "latin-1", "utf-32", "utf-7"))
        table.done.append(f"in {encoding}")
    suffix = {",": ".csv", ";": ".csv", "\t": ".tsv", " ": ".txt"}[delimiter]
    path = folder / f"{pick(rng, ('wipe', 'a b', '[x]', 'ü', '-a', 'x=1', '[red]'))}{suffix}"
    path.write_bytes(text.encode(encoding, "replace"))
    return path


def _cell(value: Any) -> str:
    try:
        return repr(value) if isinstance(value, float) else str(value)
    except ValueError:  # of too many digits
        return "9" * 400


def _renamed(names: Any) -> Any:
    return [n.replace(" ", "_") for n in names] if isinstance(names, list) else names.replace(" ", "_")


def _called(names: Any, old: str, new: str) -> Any:
    return (
        [new if n == old else n for n in names] if isinstance(names, list) else new if names == old else names
    )


def _places(names: Any, order: list[str]) -> Any:
    known = {name: i for i, name in enumerate(order)}
    return [known.get(n, 99) for n in names] if isinstance(names, list) else known.get(names, 99)


def _npz(rng: np.random.Generator, table: Table, folder: Path) -> Any:
    path = folder / "wipe.npz"
    if rng.random() < 0.5 and not table.done:
        np.savez(path, X=table.states, U=table.actions, t=table.time, run=table.episodes)
        table.how |= {"state": "X", "action": "U"}
        return path
    arrays = {}
    for number, (name, values) in enumerate(table.columns.items()):
        try:
            array = np.array(values)
        except (ValueError, OverflowError):
            array = np.array([*values, None], dtype=object)[:-1]
        plain = name if name.isidentifier() and name != "file" else f"c{number}"
        table.how = {k: _called(v, name, plain) for k, v in table.how.items()}
        arrays[plain] = array
    np.savez(path, **arrays, allow_pickle=True)
    return path


def _arrow(table: Table) -> pa.Table:
    columns = {}
    for name, values in table.columns.items():
        try:
            columns[name] = pa.array(values)
        except (pa.ArrowException, OverflowError, ValueError, TypeError):
            columns[name] = pa.array([_cell(v).encode("utf-8", "replace").decode() for v in values])
    return pa.table(columns)


def _parquet(rng: np.random.Generator, table: Table, folder: Path) -> Any:
    path = folder / "wipe.parquet"
    arrow = _arrow(table)
    if rng.random() < 0.05 and len(arrow.column_names) > 2:
        names = list(arrow.column_names)
        names[0] = names[1]
        arrow = arrow.rename_columns(names)
        table.done.append("two columns of one name")
    pq.write_table(
        arrow,
        path,
        row_group_size=int(pick(rng, (1, 7, 1000))),
        compression=pick(rng, ("snappy", "none", "zstd")),
    )
    return path


def _folder(rng: np.random.Generator, table: Table, folder: Path) -> Any:
    place = folder / "wipes"
    place.mkdir()
    arrow = _arrow(table)
    cut = int(rng.integers(1, max(2, len(arrow))))
    pq.write_table(arrow.slice(0, cut), place / "a.parquet")
    second = arrow.slice(cut)
    if rng.random() < 0.1 and len(second.column_names) > 1:
        second = second.drop_columns([pick(rng, second.column_names)])
        table.done.append("the second file lacks a column")
    pq.write_table(second, place / "b.parquet")
    if rng.random() < 0.1:
        strange_place(rng, place / "c.parquet")
        table.done.append("something odd in the folder")
    if rng.random() < 0.1:
        (place / "again").symlink_to(place)
        table.done.append("a link to itself")
    if "episode" not in table.how:
        table.episodes = (np.arange(len(table.states)) >= cut).astype(int)  # an episode is a file then
    return place


def _lists(rng: np.random.Generator, table: Table, folder: Path) -> Any:
    path = folder / "lists.parquet"
    states, actions = table.states.tolist(), table.actions.tolist()
    if rng.random() < 0.3:
        row = int(rng.integers(len(states)))
        states[row] = pick(rng, ([], None, states[row] + [1.0], [None] * len(states[row]), [np.nan]))
        table.done.append(f"row {row} is {states[row]}")
    columns = {"x": pa.array(states), "u": pa.array(actions), "t": table.time, "run": table.episodes}
    pq.write_table(pa.table(columns), path, row_group_size=13)
    table.how |= {"state": "x", "action": "u"}
    return path


def _saved(rng: np.random.Generator, table: Table, folder: Path) -> Any:
    path = folder / pick(rng, ("saved.npz", "saved.parquet"))
    demos = uc.Demonstrations(table.states, table.actions, table.episodes, time=table.time)
    demos.save(path)
    table.how = {}
    return path


def _lerobot(rng: np.random.Generator, table: Table, folder: Path) -> Any:
    version = pick(rng, ("v3.0", "v2.1"))
    place = written.lerobot(
        folder / "robot", table.states, table.actions, table.episodes, table.time - table.time[0], version
    )
    table.how = {"action": "action"}
    info = place / "meta" / "info.json"
    if rng.random() < 0.3:
        text = info.read_text()
        for old, new in (pick(rng, _INFOS),):
            text = text.replace(old, new)
        info.write_text(text)
        table.done.append("another info.json")
    return place


_INFOS = [
    ("50", "0"), ("50", "NaN"), ("50", "1e999"), ('"fps": 50', '"fps": "x"'), ("v3.0", "v9.9"), ("v2.1", "v1.0"),
    ('"shape": [1]', '"shape": [-1]'), ("float32", "object"), ("{", "["), ("features", "future"), ("}", ""),
    ("data/", "../"), ("{chunk_index:03d}", "{chunk_index.__class__}"), ("{file_index:03d}", "{0:999999999}"),
    ('"names": null', '"names": {"a": [{"b": []}]}'), ("null", "[" * 5000), ('"total_frames": ', '"total_frames": -'),
    ('"total_frames": ', '"total_frames": 9'),
]  # fmt: skip

FORMATS: tuple[Callable[[np.random.Generator, Table, Path], Any], ...] = (
    _text, _text, _text, _npz, _parquet, _folder, _lists, _saved, _lerobot,
)  # fmt: skip


def make(rng: np.random.Generator, folder: Path) -> Recording:
    """A recording on the disk, often spoiled."""
    table = Table(rng)
    written_by = pick(rng, FORMATS)
    spoils = rng.random() < 0.5
    if spoils and written_by in (_text, _npz, _parquet, _folder):
        for _ in range(int(rng.integers(1, 3))):
            if table.columns:
                table.spoil(rng)
    source = written_by(rng, table, folder)
    how, done = dict(table.how), table.done
    if rng.random() < 0.2:
        files = [path for path in folder.rglob("*") if path.is_file()]
        path = pick(rng, sorted(files)) if files else source
        if rng.random() < 0.7 and files:
            path.write_bytes(damaged(rng, path.read_bytes()))
            done.append(f"{path.name} is damaged")
        else:
            done.append(f"{path.name}: {strange_place(rng, path)}")
    if rng.random() < 0.1 and isinstance(source, Path) and not source.is_dir():
        other = source.with_name(
            pick(rng, ("wipe", "wipe.csv", "wipe.npz", "wipe.parquet", "w.xlsx", "w.gz", "w.skops"))
        )
        os.replace(source, other)
        source = other
        done.append(f"called {other.name}")
    if rng.random() < 0.1:
        source, what = pick(
            rng,
            (
                ([source, source], "given twice"),
                (str(folder / "*"), "a pattern"),
                ([], "no source"),
                (f"{source}\0", "a null"),
                (str(folder / "nothing-*.csv"), "a pattern without matches"),
                ([source, folder / "nothing.csv"], "one file more"),
                (folder, "the folder"),
                (f"file://{source}", "a URI"),
                (pick(rng, OBJECTS[:8]), "an object"),
            ),
        )
        done.append(what)
    return Recording(
        source, how, table.states, table.actions, table.episodes, written_by is not _lerobot, done
    )


OPTIONS = (
    "time_unit",
    "window",
    "gap",
    "max_speed",
    "min_speed",
    "min_duration",
    "force",
    "free",
    "force_threshold",
)


def stock(folder: Path) -> None:
    """Nothing is prepared."""


def case(rng: np.random.Generator, folder: Path, stock: Path) -> Case:
    """A recording, loaded and read in blocks."""
    recording = make(rng, folder)
    how, done = recording.how, recording.done
    if rng.random() < 0.25:
        for _ in range(int(rng.integers(1, 3))):
            key = pick(rng, [*OPTIONS, "state", "action", "time", "episode", "projections"])
            how[key] = pick(
                rng,
                (
                    anything(rng),
                    pick(rng, ("t", "run", 0, 1, -1, [0, 1], ["t"], ["t", "t"], "nothing", 1e3, 0.01)),
                ),
            )
            done.append(f"{key}={shown(how[key])}")
    if rng.random() < 0.2 and "action" in how:
        how["action"] = "differentiate"
        done.append("differentiated")
    rows = int(pick(rng, (1, 5, 1000)))
    said = f"load({recording.source}, {', '.join(f'{k}={shown(v)}' for k, v in how.items())})  # {'; '.join(done)}"

    def run() -> Any:
        try:
            demos = uc.load(recording.source, **how)
        except UnconstrainError as error:
            if not done:
                raise AssertionError(f"a good recording was refused: {error}") from error
            _check_blocks(recording.source, how, rows, None)
            raise
        _check_blocks(recording.source, how, rows, demos)
        return demos

    def check(demos: Any) -> None:
        assert np.isfinite(demos.states).all()
        assert np.isfinite(demos.actions).all()
        assert len(demos.states) == len(demos.actions) == len(demos.episodes)
        repr(demos)
        if done:
            return
        tolerance = 0 if recording.exact else 1e-5
        np.testing.assert_allclose(demos.states, recording.states, rtol=tolerance, err_msg="states")
        np.testing.assert_allclose(demos.actions, recording.actions, rtol=tolerance, err_msg="actions")
        _, codes = np.unique(recording.episodes, return_inverse=True)
        np.testing.assert_array_equal(demos.episodes, codes, err_msg="episodes")

    return Case(said, run, check)


def _check_blocks(source: Any, how: dict[str, Any], rows: int, whole: Any) -> None:
    """Blocks hold what `load` returns, and are refused where it refuses."""
    try:
        blocks = list(uc.open(source, **how).blocks(rows))
    except UnconstrainError as error:
        # An episode that comes back later can be read at once, but not block by block.
        comes_back = whole is not None and (np.diff(whole.episodes) < 0).any()
        if comes_back:
            return
        if whole is not None and "after others" not in str(error) and "goes on" not in str(error):
            raise AssertionError(f"blocks were refused: {error}") from error
        return
    assert whole is not None, "load refused what blocks read"
    np.testing.assert_array_equal(np.concatenate([b.states for b in blocks]), whole.states, err_msg="blocks")
    np.testing.assert_array_equal(
        np.concatenate([b.actions for b in blocks]), whole.actions, err_msg="blocks"
    )
