"""The command line: every option of every command, as click declares them, with values of all kinds."""

import os
import sys
from pathlib import Path
from typing import Any

import click
import numpy as np

import unconstrain as uc
from tests.fuzz import recordings
from tests.fuzz.engine import Case, check_sentence
from tests.fuzz.values import TEXTS, pick
from unconstrain.cli import main
from unconstrain.cli.app import program
from unconstrain.errors import UnconstrainError
from unconstrain.recordings.text import write_csv

NUMBERS = (
    "0",
    "-1",
    "1",
    "3",
    "0.5",
    "nan",
    "inf",
    "-inf",
    "1e308",
    "1e-320",
    "1e400",
    "1_0",
    "0x3",
    " 2 ",
    "٣",
    "1e9",
    "999999999999",
)
PLACES = (
    "new", "new.csv", "new.png", "new.svg", "no/such/folder/new.png", "/dev/full", "/dev/null", "/proc/nothing", ".",
    "taken.csv", "taken.png", "taken.skops", "-o.csv", "a\nb.csv", "[/red].png", "x" * 300, "policy.skops",
    "movements.csv",
    "~nobody/new", "link.skops", "locked/new.csv", "", "new\0.csv", "pipe.csv", "loop.csv", "./movements.csv",
)  # fmt: skip
SLOW = {"demo"}
"""Commands that take seconds whatever they are given: called with what is refused, and now and then."""

ENDLESS = {"view"}
"""Commands that serve a page until they are interrupted."""


def stock(folder: Path) -> None:
    """Movements, and a policy of them."""
    from unconstrain import limit_cycle

    demos = limit_cycle.demonstrate(6, random_state=0)
    write_csv(demos, folder / "movements.csv")
    demos.save(folder / "movements.npz")
    uc.ParametricPolicy().fit(demos.states, demos.actions, groups=demos.episodes).save(
        folder / "policy.skops", resumable=True
    )


def case(rng: np.random.Generator, folder: Path, stock: Path) -> Case:
    """A command with what it needs and some options more."""
    for path in stock.iterdir():
        (folder / path.name).write_bytes(path.read_bytes())
    for name in ("taken.csv", "taken.png", "taken.skops"):
        (folder / name).write_bytes(b"this is somebody's work\n")
    os.symlink("policy.skops", folder / "link.skops")
    os.mkfifo(folder / "pipe.csv")
    os.symlink("loop.csv", folder / "loop.csv")
    ending = [n for n in program.commands if n not in ENDLESS]
    name = pick(rng, [n for n in ending if n not in SLOW or rng.random() < 0.2])
    command = program.commands[name]
    arguments, needs = [name], {"files": ["movements.csv"], "policy": ["policy.skops"]}
    spoils = rng.random() < 0.8
    layout = ["--state", "x1,x2", "--action", "u1,u2", "--episode", "episode"]
    if spoils and rng.random() < 0.3 and "files" in {p.name for p in command.params}:
        recording = recordings.make(rng, folder)
        if isinstance(recording.source, str | Path):
            needs["files"], layout = [str(recording.source)], _as_options(recording.how)
    elif rng.random() < 0.2:
        needs["files"], layout = ["movements.npz"], []
    names = {option for parameter in command.params for option in parameter.opts}
    if "--state" in names and name != "evaluate":
        arguments += layout
    if "--start" in names:
        arguments += ["--start", "0.5,0.5"]
    if "--steps" in names and rng.random() < 0.8:
        arguments += ["--steps", "20"]
    options = [p for p in command.params if isinstance(p, click.Option)]
    for option in rng.permutation(np.array(options, dtype=object))[: int(rng.integers(4))]:
        arguments += _given(rng, option, spoils)
    places = [
        each for p in command.params if isinstance(p, click.Argument) for each in needs.get(str(p.name), [])
    ]
    if spoils and rng.random() < 0.1:
        places = [pick(rng, ([], ["nothing.csv"], places * 2, ["pipe.csv"], ["loop.csv"], ["."], [""], ["a\0b"], ["gs://x/y"],
                             ["file:///etc/passwd"], ["*"], ["taken.skops"], ["~/x"], ["-"]))]  # fmt: skip
        places = places[0]
    arguments += places
    if spoils and rng.random() < 0.05 and len(arguments) > 1:
        del arguments[int(rng.integers(1, len(arguments)))]
    out = folder.parent / "log"
    arguments = [
        os.fsencode(a.replace("\0", "")).decode("utf-8", "surrogateescape") if _encodable(a) else "x"
        for a in arguments
    ]
    taken = {parameter.name for parameter in command.params}
    inputs = {"movements.csv", "movements.npz", "pipe.csv", "loop.csv"} if "files" in taken else set()
    inputs |= {"policy.skops"} if "policy" in taken else set()
    existing = {str(p.relative_to(folder)) for p in folder.rglob("*")}
    replaced = "--overwrite" in arguments
    state = {"new": set[str]()}

    def run() -> None:
        sys.argv = ["unconstrain", *arguments]
        start = out.stat().st_size
        try:
            main()
            code: Any = 0
        except SystemExit as end:
            code = end.code or 0
        sys.stdout.flush()
        sys.stderr.flush()
        text = out.read_bytes()[start:].decode("utf-8", "backslashreplace")
        assert "Traceback" not in text, text
        assert "\x1b" not in text, f"it printed control characters: {text!r:.500}"
        assert code in (0, 2), f"it ended with {code}: {text}"
        lines = text.splitlines()
        if code == 2:
            errors = [line for line in lines if line.startswith("error:")]
            assert len(errors) == 1, text
            check_sentence(errors[0])
            tail = lines[lines.index(errors[0]) + 1 :]
            assert len(tail) <= 1, f"more than one sentence: {tail}"
            assert all(line.startswith("see unconstrain") for line in tail), tail
            _check_words(errors[0], command)
        assert ".py:" not in text, f"a warning of Python's own: {text}"
        now = {str(p.relative_to(folder)) for p in folder.rglob("*")}
        new = now - existing
        assert not any(Path(n).name.startswith(".") for n in new), f"left behind: {new}"
        assert code == 0 or not new, f"half of it was written: {new}"
        assert all((folder / n).is_dir() or (folder / n).stat().st_size > 20 for n in new), f"empty: {new}"
        state["new"] |= new
        if code == 2:
            raise UnconstrainError(errors[0])

    class Writes(set):
        """What may change: new files, and those that were to be replaced."""

        def __rsub__(self, other: set) -> set:
            free = {n for n in other if n not in existing and n in state["new"]}
            may = existing - inputs if replaced else set()
            return {n for n in other if n not in free and n not in may}

    return Case(" ".join(map(repr, arguments)), run, writes=Writes())


def _encodable(text: str) -> bool:
    try:
        os.fsencode(text)
    except UnicodeEncodeError:
        return False
    return True


def _as_options(how: dict[str, Any]) -> list[str]:
    """The columns of a recording as options."""
    given = []
    for key, value in how.items():
        names = value if isinstance(value, list) else [value]
        given += [f"--{key}", ",".join(f'"{n}"' if "," in str(n) else str(n) for n in names)]
    return given


def _given(rng: np.random.Generator, option: click.Option, spoils: bool) -> list[str]:
    """An option with a value: one that it takes, or, where things are to be spoiled, any."""
    name = pick(rng, option.opts)
    if option.is_flag:
        return [name]
    kind = option.type
    if spoils and rng.random() < 0.5:
        texts = [t for t in TEXTS if isinstance(t, str)]
        value = pick(rng, [*NUMBERS, *texts, *PLACES, "x1", "x1,x2", "0,1", "x1,,x2", "u1,u2", "episode"])
    elif isinstance(kind, click.Choice):
        value = pick(rng, list(kind.choices))
    elif isinstance(kind, click.Path):
        value = pick(rng, PLACES)
    elif "number" in kind.name or isinstance(kind, click.types.IntParamType | click.types.FloatParamType):
        value = pick(rng, NUMBERS[2:])
    elif "integer" in kind.name or "range" in kind.name:
        value = pick(rng, ("1", "2", "20", "1000000000"))
    elif "column" in kind.name:
        value = pick(rng, ("x1", "x2", "x1,x2", "u1,u2", "0", "episode", "t", "nothing", "differentiate"))
    else:
        value = pick(rng, ("s", "ms", "x1", "episode", "local", "tcp://127.0.0.1:9", "inconsistency"))
    if name == "--cluster":
        value = pick(
            rng, ("nowhere", "tcp://", "tcp://127.0.0.1:x", "", "unix://x")
        )  # a port that is closed takes long
    return [f"{name}={value}"] if name.startswith("--") and rng.random() < 0.5 else [name, value]


def _check_words(error: str, command: click.Command) -> None:
    """A mistake names options as they are typed, and not as Python calls them."""
    for parameter in command.params:
        if isinstance(parameter, click.Option) and parameter.name:
            assert f" {parameter.name}=" not in error.replace(f"'{parameter.name}=", ""), error
