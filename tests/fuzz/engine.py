"""Run each input in a process of its own, and judge what came of it.

A pass is a right result, or one `UnconstrainError` of a single sentence. A failure is anything else: another exception,
a crash, a hang, a gigabyte, a file that changed, or one that was left behind.
"""

import hashlib
import json
import os
import pkgutil
import re
import resource
import select
import shutil
import signal
import sys
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from sklearn.exceptions import NotFittedError

import unconstrain
from unconstrain.errors import UnconstrainError

AREAS = ("recordings", "archives", "commands", "arguments")
"""The modules of this package that make inputs."""
SECONDS = 120
"""An input that takes longer hangs. Even on a busy machine the slowest takes a few seconds."""
GIGABYTE = 2**30
"""What an input may take besides what the imports took."""
KEPT_OF_A_KIND = 3
"""How many of the inputs that failed alike are kept."""


@dataclass
class Case:
    """One input.

    Parameters
    ----------
    said : str
        The call, as a person would write it.
    call : callable
        Makes the call and returns its result.
    check : callable
        Raises `AssertionError` for a result that is not right.
    writes : set of str
        Files that the call may write or change, relative to the case's folder.
    """

    said: str
    call: Callable[[], Any]
    check: Callable[[Any], None] = lambda result: None
    writes: set[str] = field(default_factory=set)


@dataclass(frozen=True)
class Verdict:
    """What came of an input: "result", "sentence", or a failure with the place where it failed."""

    outcome: str
    said: str = ""
    detail: str = ""
    kind: str = ""

    @property
    def failed(self) -> bool:
        """Whether this is neither a result nor a sentence."""
        return self.outcome not in ("result", "sentence")


Make = Callable[[np.random.Generator, Path, Path], Case]
"""From a generator, the case's own folder, and the area's stock of files to a case."""


def check_sentence(text: str) -> None:
    """Raise `AssertionError` unless a text is one printable sentence that says something."""
    assert text.strip(), "the sentence is empty"
    assert "\n" not in text.strip(), f"it is more than one line: {text!r:.300}"
    assert "Traceback" not in text
    assert len(text) < 1500, f"the sentence has {len(text)} characters: {text!r:.200}"
    assert not re.search(r"[\x00-\x08\x0b-\x1f\x7f]", text), f"it holds control characters: {text!r:.300}"


def snapshot(folder: Path) -> dict[str, str]:
    """Describe everything in a folder: files by their content, links by their target."""
    found = {}
    for place, folders, files in os.walk(folder):
        for name in folders + files:
            path = Path(place, name)
            if path.is_symlink():
                about = f"link to {os.readlink(path)}"
            elif path.is_dir():
                about = "folder"
            elif path.is_file():
                about = hashlib.sha1(path.read_bytes()).hexdigest()
            else:
                about = "special"
            found[os.path.relpath(path, folder)] = about
    return found


def judge(case: Case, folder: Path) -> Verdict:
    """Make the call, and say what came of it."""
    before = snapshot(folder)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            warnings.simplefilter("error", RuntimeWarning)
            result = case.call()
    except NotFittedError as error:
        outcome, text, allowed = "sentence", str(error), set()
    except UnconstrainError as error:
        outcome, text, allowed = "sentence", str(error), set()
    else:
        outcome, text, allowed = "result", "", case.writes
    if outcome == "sentence":
        check_sentence(text)
    else:
        case.check(result)
    after = snapshot(folder)
    changed = {name for name in before | after if before.get(name) != after.get(name)} - allowed
    assert not changed, (
        f"after a {outcome} ({text:.200}) these changed or were left behind: {sorted(changed)}"
    )
    return Verdict(outcome, case.said, text)


def _child(make: Make, seeds: list[int], folder: Path, stock: Path, log: Path) -> Verdict:
    streams = os.open(log, os.O_CREAT | os.O_WRONLY | os.O_APPEND)
    os.dup2(streams, 1)
    os.dup2(streams, 2)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.chdir(folder)
    taken = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (taken + 3 * GIGABYTE, resource.RLIM_INFINITY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    try:
        case = make(np.random.default_rng(seeds), folder, stock)
    except BaseException:
        return Verdict("fault of the fuzzer", "", traceback.format_exc(), _place(sys.exc_info()[1]))
    (log.parent / "said").write_text(case.said, "utf-8", "surrogateescape")
    try:
        return judge(case, folder)
    except AssertionError as error:
        if "unconstrain/" in _place(error):
            return Verdict("exception", case.said, traceback.format_exc(), _place(error))
        return Verdict("wrong", case.said, traceback.format_exc(), f"{error}"[:100] + _place(error))
    except BaseException as error:
        return Verdict("exception", case.said, traceback.format_exc(), _place(error))


def _place(error: BaseException | None) -> str:
    """The kind of an exception, and where in the library it passed last."""
    frames = traceback.extract_tb(error.__traceback__ if error else None)
    own = [frame for frame in frames if "/unconstrain/" in frame.filename] or frames[-1:]
    where = "".join(f" {Path(f.filename).name}:{f.name}:{f.lineno}" for f in own[-1:])
    return f"{type(error).__name__}{where}"


@dataclass
class _Running:
    pid: int
    pipe: int
    name: str
    folder: Path
    started: float
    said: bytes = b""


def run_all(
    areas: dict[str, Make],
    seed: int,
    numbers: dict[str, range],
    keep: Path,
    jobs: int,
) -> tuple[Counter, dict[tuple[str, str, str], list[str]]]:
    """Run inputs, several at a time.

    Parameters
    ----------
    areas : dict
        How inputs are made, by the name of the area.
    seed : int
    numbers : dict of range
        Which inputs of each area.
    keep : path
        A folder: of the areas' stock in `stock`, and of inputs that failed.
    jobs : int
        How many at a time.

    Returns
    -------
    counts : Counter
        By area and outcome.
    failures : dict
        By area, outcome and kind the names of the inputs that failed.
    """
    counts: Counter = Counter()
    failures: dict[tuple[str, str, str], list[str]] = {}
    waiting = ((area, number) for area, range_ in numbers.items() for number in range_)
    running: list[_Running] = []
    base = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    slowest = (0.0, "")
    while True:
        while len(running) < jobs and (following := next(waiting, None)):
            running.append(_start(areas[following[0]], seed, *following, keep))
        if not running:
            break
        for ended, verdict, peak in list(_finished(running)):
            running.remove(ended)
            taken = time.monotonic() - ended.started
            slowest = max(slowest, (taken, ended.name))
            if not verdict.failed and peak - base > GIGABYTE:
                verdict = Verdict(
                    "gigabyte",
                    verdict.said,
                    f"it took {(peak - base) / GIGABYTE:.1f} GB\n{verdict.detail}",
                    "",
                )
            own = ended.name.split("-")[0]
            counts[own, verdict.outcome] += 1
            if not verdict.failed:
                shutil.rmtree(ended.folder, ignore_errors=True)
                continue
            alike = failures.setdefault((own, verdict.outcome, verdict.kind), [])
            alike.append(ended.name)
            if len(alike) > KEPT_OF_A_KIND:
                shutil.rmtree(ended.folder, ignore_errors=True)
                continue
            (ended.folder / "report.txt").write_text(
                f"{ended.name}: {verdict.outcome} {verdict.kind}\n\n{verdict.said}\n\n{verdict.detail}\n",
                "utf-8",
                "backslashreplace",
            )
            if len(alike) == 1:
                print(f"\n{ended.folder}: {verdict.outcome}\n{verdict.said}\n{verdict.detail}", flush=True)
    print(f"slowest: {slowest[1]}, {slowest[0]:.1f} s")
    return counts, failures


def _start(make: Make, seed: int, area: str, number: int, keep: Path) -> _Running:
    name = f"{area}-{seed}-{number}"
    folder = keep / name
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "files").mkdir(parents=True)
    reading, writing = os.pipe()
    sys.stdout.flush()
    pid = os.fork()
    if pid == 0:
        verdict = Verdict("crash")
        try:
            os.setsid()
            os.close(reading)
            seeds = [seed, AREAS.index(area), number]
            verdict = _child(make, seeds, folder / "files", keep / "stock" / area, folder / "log")
        finally:
            os.write(writing, json.dumps(vars(verdict)).encode())
            os._exit(0)
    os.close(writing)
    return _Running(pid, reading, name, folder, time.monotonic())


def _finished(running: list[_Running]) -> Iterator[tuple[_Running, Verdict, int]]:
    ready, _, _ = select.select([each.pipe for each in running], [], [], 1.0)
    for each in running:
        if each.pipe in ready:
            more = os.read(each.pipe, 1 << 20)
            each.said += more
            if more:
                continue
        elif time.monotonic() - each.started < SECONDS:
            continue
        hung = each.pipe not in ready
        with suppress(ProcessLookupError):
            os.killpg(each.pid, signal.SIGKILL)
        _, status, usage = os.wait4(each.pid, 0)
        os.close(each.pipe)
        yield each, _verdict(each, hung, status), usage.ru_maxrss * 1024


def _verdict(ended: _Running, hung: bool, status: int) -> Verdict:
    noted = ended.folder / "said"
    said = noted.read_text("utf-8", "surrogateescape") if noted.exists() else "while the input was made"
    if hung:
        return Verdict("hang", said, f"it did not end within {SECONDS} s", said[:20])
    if not ended.said:
        return Verdict("crash", said, f"it ended with status {status}", f"{status}")
    return Verdict(**json.loads(ended.said))


def import_all() -> None:
    """Import all of the library and what it is built on, so that no input has to."""
    import sklearn.cluster
    import sklearn.preprocessing  # noqa: F401

    for module in pkgutil.walk_packages(unconstrain.__path__, "unconstrain."):
        if not module.name.endswith("__main__"):
            import_module(module.name)


def area(name: str) -> ModuleType:
    """The module that makes the inputs of an area, by `stock` and `case`."""
    return import_module(f"tests.fuzz.{name}")


def prepare(stock: Callable[[Path], None], folder: Path) -> None:
    """Fill an area's stock of files, in a process of its own: threads that have run do not survive a fork."""
    folder.mkdir(parents=True, exist_ok=True)
    pid = os.fork()
    if pid == 0:
        code = 1
        try:
            stock(folder)
            code = 0
        except BaseException:
            traceback.print_exc()
        finally:
            sys.stderr.flush()
            os._exit(code)
    if os.waitpid(pid, 0)[1] != 0:
        raise RuntimeError("the stock of files could not be made")
