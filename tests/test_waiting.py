"""Whatever may take longer than a second says how far it has come, to whoever has asked."""

import io
import time

import numpy as np
import pytest

import unconstrain as uc
from unconstrain.constraints.mechanisms import find_mechanism
from unconstrain.diagnostics import identifiability
from unconstrain.evaluation import compare_risks
from unconstrain.limit_cycle import demonstrate
from unconstrain.recordings.smoothing import find_smoothing
from unconstrain.waiting import each, stage


class Seen:
    """A display that remembers what it was told."""

    def __init__(self):
        self.texts, self.told, self.ended = [], {}, 0

    def open(self, text, total, unit):
        self.texts.append(text)

        class Row:
            def __call__(row, done, total=None):
                self.told.setdefault(text, []).append((done, total))

            def begin(row, text):
                self.texts.append(text)

        return Row()

    def close(self, row):
        pass

    def end(self):
        self.ended += 1


@pytest.fixture
def seen(monkeypatch):
    display = Seen()
    monkeypatch.setattr("unconstrain.waiting._open", lambda: display)
    return display


@pytest.fixture(scope="module")
def demos():
    seen = demonstrate(8, noise=0.05, free=0.5, random_state=0)
    return uc.Demonstrations(seen.states, seen.actions, seen.episodes, time=np.tile(np.arange(40) * 0.02, 8))


@pytest.fixture(scope="module")
def policy(demos):
    return uc.ParametricPolicy(alpha=1e-3).fit(demos)


def _load(demos, policy, folder):
    demos.save(folder / "movements.parquet")
    uc.load(folder / "movements.parquet")


def _select(demos, policy, folder):
    uc.select_policy({"linear": uc.ParametricPolicy(risk="direct")}, demos)


def _mechanism(demos, policy, folder):
    angle = np.linspace(0.0, 1.5, 60)
    positions = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(60)])
    find_mechanism(positions + 1e-3 * np.random.default_rng(0).normal(size=(60, 3)))


ENTRIES = {
    "fitting": lambda demos, policy, folder: uc.ParametricPolicy(risk="corrected").fit(demos),
    "inferring contact": lambda demos, policy, folder: uc.ParametricPolicy(alpha=1e-3).fit(demos),
    "choosing λ": lambda demos, policy, folder: uc.ParametricPolicy(risk="direct").fit(demos),
    "adding up samples": lambda demos, policy, folder: uc.LocallyLinearPolicy(
        n_centers=3, alpha=1.0, risk="direct"
    ).fit(demos),
    "reading": _load,
    "opening": _load,
    "writing": _load,
    "fitting policies": _select,
    "comparing risks": lambda demos, policy, folder: compare_risks(uc.ParametricPolicy(alpha=1.0), demos),
    "evaluating": lambda demos, policy, folder: uc.evaluate(policy, demos),
    "finding what is determined": lambda demos, policy, folder: identifiability(policy, demos),
    "choosing what to record next": lambda demos, policy, folder: identifiability(
        policy, demos
    ).next_recordings(2),
    "telling which samples were free": lambda demos, policy, folder: policy.free_probability(demos),
    "rolling out": lambda demos, policy, folder: policy.rollout(demos.states[0], steps=5),
    "making it stable": lambda demos, policy, folder: policy.stabilized([0.0, 0.0], demos),
    "finding how long to smooth": lambda demos, policy, folder: find_smoothing(
        demos.states, demos.time, demos.episodes
    ),
    "comparing mechanisms": _mechanism,
    "learning": lambda demos, policy, folder: uc.fit_stream(
        uc.ParametricPolicy(alpha=1.0, risk="direct"), demos
    ),
}


@pytest.mark.parametrize("text", ENTRIES)
def test_what_may_take_long_is_told_and_ends(text, seen, demos, policy, tmp_path):
    ENTRIES[text](demos, policy, tmp_path)
    assert not seen.texts  # nobody has asked
    for old in tmp_path.iterdir():
        old.unlink()
    with uc.verbose():
        ENTRIES[text](demos, policy, tmp_path)
    assert any(each.startswith(text) for each in seen.texts)
    opened = seen.ended
    with pytest.raises(uc.errors.UnconstrainError), uc.verbose():
        uc.ParametricPolicy(alpha=-1.0).fit(demos)
    assert seen.ended == opened + 1  # by an error too


def test_passes_come_with_how_many_there_will_probably_be(seen, demos):
    with uc.verbose():
        uc.ParametricPolicy(alpha=1e-3).fit(demos)
    told = seen.told["inferring contact"]
    made, last = told[-1]
    assert made == last == len(told)
    assert all(done <= total <= 3 * made for done, total in told)


@pytest.mark.parametrize("delay", [0.0, 60.0])
def test_what_is_done_and_left_is_on_a_terminal_once_it_lasts(monkeypatch, delay):
    stream = io.StringIO()
    stream.isatty = lambda: True
    for name, value in {"TERM": "xterm", "COLUMNS": "120", "TTY_COMPATIBLE": "1"}.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr("sys.stderr", stream)
    monkeypatch.setattr("unconstrain.waiting.DELAY", delay)
    with uc.verbose(), stage("all of it"):
        for _ in each(range(4), "part [b]of it", unit="steps"):
            time.sleep(0.12)
    if delay:
        assert stream.getvalue() == ""
    else:
        assert "part [b]of it" in stream.getvalue()
        assert "3 of 4 steps" in stream.getvalue()
        assert "0:00:0" in stream.getvalue()


def test_loops_in_other_threads_are_not_shown_and_do_no_harm(seen):
    from concurrent.futures import ThreadPoolExecutor

    def work(_):
        with stage("beside"):
            return list(each(range(3), "beside"))

    with uc.verbose(), stage("before"), ThreadPoolExecutor(2) as pool:
        assert list(pool.map(work, range(4))) == [[0, 1, 2]] * 4
    assert seen.texts == ["before"]
