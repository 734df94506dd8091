"""Looking at a recording of any format without being told what its columns are."""

import math
import os
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.errors import DataError, UnconstrainError
from unconstrain.recordings.actions import find_kind
from unconstrain.recordings.columns import DIFFERENTIATE, Columns
from unconstrain.recordings.formats.base import Format, HasParts
from unconstrain.recordings.formats.lerobot import ACTION, EPISODE, STATE, TIME, LeRobot
from unconstrain.recordings.inspection.command import fit_command
from unconstrain.recordings.inspection.kinds import TIME as TIME_WORDS
from unconstrain.recordings.inspection.kinds import (
    ColumnReport,
    are_tracks,
    epoch_unit,
    judge,
    sign_flips,
    tells_episodes,
    with_unit,
    words,
    wraps,
)
from unconstrain.recordings.inspection.looking import Looked, look_at
from unconstrain.recordings.inspection.proposal import (
    Group,
    choose_actions,
    choose_episodes,
    choose_rotations,
    choose_states,
    choose_time,
    key_of,
    keys_of,
    rises_evenly,
)
from unconstrain.recordings.inspection.result import Inspection
from unconstrain.recordings.inspection.timing import Timing, explained_by, judge_stamps
from unconstrain.recordings.preparation import TIME_UNITS, Preparation
from unconstrain.recordings.recognizing import Found, open_formats
from unconstrain.recordings.source import open as open_recordings
from unconstrain.waiting import stage

Array = NDArray[np.float64]
Codes = NDArray[np.int64]

AGREES = 0.7
"""The share of the motion that velocities must explain to be taken for the derivative of positions."""

MOST_TRIED = 12
"""Proposals that are tried before it is said that there is no movement."""

TRIED_ROWS = 3_000_000
"""Rows of files that are read to try a proposal; of more, it is proposed without."""

COARSE = 0.34
"""Where fewer of the stamps differ from the one before, they are coarser than the samples."""

SPARSE = 0.5
"""Where fewer of the rows hold all columns, these are filled at different rates."""

NANOSECOND_STEP = 1e5
"""Stamps of which nothing tells the unit are nanoseconds if their typical step is as large."""

LIKELY = {
    "target": "commanded states",
    "increment": "steps to the next state",
    "scaled": "commands within -1 and 1 that a controller scales",
}
"""What actions are that are no velocities."""

MOVING_TYPES = ("Odometry", "PoseStamped", "JointState", "TransformStamped", "Pose", "Path", "Twist")
"""The kinds of messages that are looked at first, where a file holds several tables."""

MOST_TOPICS = 30
"""Tables of one file that are looked into."""


@stage("inspecting")
def inspect(
    source: str | os.PathLike[str] | Iterable[str | os.PathLike[str]], part: str | None = None
) -> Inspection:
    """Look at recordings, and find the command that learns from them.

    Parameters
    ----------
    source : path, pattern, URI, or several of them
        Files of any format that `open` reads.
    part : str, optional
        Which part of each file, such as a sheet; see `Columns`. By default the one that `open` reads, or else the first
        that holds a movement.

    Returns
    -------
    Inspection
        Its `next` was tried: `open` reads the files with these columns.

    Raises
    ------
    DataError
        There is no such file, or it cannot be read.

    Examples
    --------
    >>> import unconstrain as uc
    >>> print(uc.inspect("wipe.csv"))  # doctest: +SKIP
    """
    paths = _paths(source)
    chosen = Columns(part=part)
    found = open_formats(paths, chosen)
    shown, files, robot = found[0]
    topics = _topics(files[0])
    with np.errstate(over="ignore", invalid="ignore"):  # any numbers may be in a file
        if topics:
            return _inspect_topics(paths, shown, files[0], topics)
        inspected = _inspect(paths, found, robot, chosen)
        if inspected.next is None and part is None and len(found) == 1 and isinstance(files[0], HasParts):
            return _inspect_parts(paths, files[0], inspected)
        return inspected


def list_keys(
    source: str | os.PathLike[str] | Iterable[str | os.PathLike[str]], part: str | None = None
) -> list[str]:
    """List the columns that there are, or, of a file that holds several tables, these.

    Parameters
    ----------
    source : path, pattern, URI, or several of them
    part : str, optional
        Which part of each file.

    Returns
    -------
    list of str
        One line each; positions in place of names that are missing.

    Raises
    ------
    DataError
        There is no such file, or it cannot be read.
    """
    paths = _paths(source)
    file = open_formats(paths, Columns(part=part))[0].formats[0]
    topics = _topics(file)
    if topics:
        return [str(topic) for topic in topics]
    header = file.columns()
    listed = [column.name or f"column {i}" for i, column in enumerate(header.columns)]
    return [*listed, *(f"{name} ({why})" for name, why in header.unusable.items())]


@dataclass(frozen=True)
class _Topic:
    """One of the tables of a file: its name, and the kind and number of its messages where they are known."""

    name: str
    kind: str = ""
    count: int | None = None

    def __str__(self) -> str:
        if self.count is None:
            return self.name
        return f"{self.name} ({self.kind}, {self.count} message{'' if self.count == 1 else 's'})"

    @property
    def rank(self) -> int:
        """How soon it is looked at."""
        kind = self.kind.split("/")[-1]
        return MOVING_TYPES.index(kind) if kind in MOVING_TYPES else len(MOVING_TYPES)


def _topics(file: Format) -> list[_Topic]:
    """Return the tables of a file that holds several, the likeliest to hold a movement first.

    A format may list them with `topics()`, by name, kind and count, or with `topics_of_movement()`, by name alone.
    """
    if not hasattr(file, "for_topics"):
        return []
    ask = getattr(file, "topics", None)
    if callable(ask):
        return sorted((_Topic(*topic) for topic in ask()), key=lambda topic: topic.rank)
    ask = getattr(file, "topics_of_movement", None)
    return [_Topic(name) for name in ask()] if callable(ask) else []


def _inspect_topics(paths: list[Any], shown: str, file: Any, topics: list[_Topic]) -> Inspection:
    """Look into each table of a file, and take the first that holds a movement."""
    listed = []
    if len(topics) > 1:
        which = ", ".join(map(str, topics[:MOST_TOPICS]))
        listed = [f"the topics that may hold a movement are {which}; --topic chooses others"]
    best: Inspection | None = None
    for topic in topics[:MOST_TOPICS]:
        if topic.count == 0:
            continue
        name = topic.name
        try:
            one = _inspect(paths, [Found(shown, [file.for_topics((name,))])], None, Columns(topic=name))
        except UnconstrainError as error:
            listed.append(f"topic {name} was not looked into: {error}")
            continue
        one = replace(one, source=f"{one.source} {name}")
        if best is None or one.next is not None:
            best = one
        if one.next is not None:
            break
    if best is None:
        return Inspection(shown, 0, 0, None, None, (), (*listed, "no topic holds a movement"), None)
    return replace(best, notes=(*listed, *best.notes))


def _inspect_parts(paths: list[Any], file: HasParts, first: Inspection) -> Inspection:
    """Look into the parts of a file, and take the first that holds a movement, or else the part that is read."""
    for name in file.parts()[:MOST_TOPICS]:
        chosen = Columns(part=name)
        try:
            one = _inspect(paths, open_formats(paths, chosen), None, chosen)
        except UnconstrainError:
            continue
        if one.next is not None:
            every = ", ".join(map(repr, file.parts()))
            other = f"part {name!r} holds a movement; --part chooses another one, of {every}"
            return replace(one, notes=(other, *one.notes))
    return first


@dataclass(frozen=True)
class _Clock:
    """A column taken for the time: where it is, its unit if that is known, and whether only its steps say so."""

    place: int
    unit: str
    is_typed: bool
    seconds: Array


def _inspect(
    paths: list[Any],
    found: Sequence[Found],
    robot: LeRobot | None,
    chosen: Columns,
) -> Inspection:
    shown, first, _ = found[0]
    header = first[0].columns()
    names = [column.name for column in header.columns]
    alike = [f for f in found if [column.name for column in f[1][0].columns().columns] == names]
    numbered = [
        (number, file)
        for number, (_, formats, _) in enumerate(alike)
        for file in formats
        if file.at_once or any(file.row_groups)
    ]
    files = [file for _, file in numbered]
    if not files:
        raise DataError(f"{shown} has no samples")
    looked = look_at(files, [number for number, _ in numbered])
    notes = list(looked.notes)
    if len(alike) < len(found):
        others = next(f[0] for f in found if f not in alike)
        notes.append(f"{others} has other columns than {shown}, so that one `fit` cannot read both")
    called = [_called(column.name, column.part_of, column.component, robot) for column in looked.columns]
    reports = judge(called, looked.values, looked.units)
    reports = [
        with_unit(report, column.unit, values)
        for report, column, values in zip(reports, looked.columns, looked.values, strict=True)
    ]
    notes += _unread(reports, looked)
    if are_tracks(looked.names, looked.values):
        notes.append(
            "the first two columns are taken for the numbers of frames and of those who are seen in them; --time and "
            "--episode overrule this, and --rate says how many frames there are a second"
        )
    reports = [
        replace(report, kind="episode")
        if i in looked.texts and tells_episodes(report.name, looked.texts[i])
        else report
        for i, report in enumerate(reports)
    ]
    declared = first[0].declared()
    knows = declared is not None and declared.columns.state is not None
    given = None if declared is None else declared.columns.episode
    told = [i for i, column in enumerate(looked.columns) if given is not None and column.name == given]
    named = told or choose_episodes(reports, looked.values, None)[0]
    before = _codes(named[0] if named else None, looked)
    clocks = [_clock(i, reports[i], looked) for i in choose_time(reports, looked.values, before)]
    clock = clocks[0] if clocks else None
    rising = None if clock is None or len(alike) > 1 else clock.seconds
    episodes, is_guess = (told, False) if told else choose_episodes(reports, looked.values, rising)
    codes = _codes(episodes[0] if episodes else None, looked)
    timing = None if clock is None else judge_stamps(clock.seconds, codes)
    if clock is not None and timing is not None:
        reports[clock.place] = replace(reports[clock.place], unit=clock.unit, kind="time")
        notes += _time_notes(looked.names[clock.place] or f"column {clock.place}", clock, timing, reports)
    if is_guess:
        name = looked.names[episodes[0]]
        notes.append(
            f"episodes are told apart by {name}, which changes where the time starts anew; else give --episode"
        )
    reports = _without_held(reports, looked, codes)
    notes += _oddities(reports, looked, codes)
    judged = _Judged(looked, reports, clocks, episodes, codes, chosen)
    tried = _try(paths, judged, robot, knows, len(alike) == len(found))
    notes += tried.notes
    timing = _of_the_states(timing, clock, codes, looked, tried.states)
    counted = None if clock is None else _rate_of_runs(clock, codes)
    if timing is not None and counted is not None:
        timing = replace(timing, rate_hz=counted)
    reports = [replace(report, name=name) for report, name in zip(tried.reports, looked.names, strict=True)]
    rows, n_episodes = looked.n_rows, len(np.unique(codes)) if len(codes) else 0
    rate = None if timing is None or timing.rate_hz is None else float(f"{timing.rate_hz:.6g}")
    return Inspection(
        _several([name for name, _, _ in alike]),
        rows,
        n_episodes,
        rate,
        None if timing is None else timing.duration_s,
        tuple(reports),
        tuple(dict.fromkeys(notes)),
        tried.next,
    )


@dataclass(frozen=True)
class _Judged:
    looked: Looked
    reports: list[ColumnReport]
    clocks: list[_Clock]
    episodes: list[int]
    codes: Codes
    chosen: Columns
    """The topic or the part that is looked into."""


@dataclass(frozen=True)
class _Tried:
    next: str | None
    notes: list[str]
    reports: list[ColumnReport]
    states: tuple[int, ...] = ()


@dataclass(frozen=True)
class _Proposal:
    columns: Columns
    preparation: Preparation
    notes: tuple[str, ...] = ()
    velocities: tuple[int, ...] = ()
    positions: tuple[int, ...] = ()


def _kind_in(proposal: _Proposal, place: int, kind: str) -> str:
    """Return the kind of a column now that it is known which role it can play."""
    if place in proposal.velocities:
        return "velocity"
    return "position" if place in proposal.positions and kind == "number" else kind


def _try(paths: list[Any], judged: _Judged, robot: LeRobot | None, knows: bool, alike: bool) -> _Tried:
    """Try proposals one after the other until one can be read."""
    if not alike:
        return _Tried(None, [], judged.reports)
    if robot is not None and STATE in robot.features:
        proposals = _for_robot(judged)
    elif knows:
        proposals = iter([_Proposal(judged.chosen, Preparation())])
    else:
        proposals = _proposals(judged)
    problem = ""
    for number, proposal in enumerate(proposals):
        if number >= MOST_TRIED:
            break
        notes = list(proposal.notes)
        if judged.looked.n_rows <= TRIED_ROWS:
            try:
                demos = open_recordings(
                    paths, columns=proposal.columns, preparation=proposal.preparation
                ).load()
            except UnconstrainError as error:
                problem = problem or str(error)
                continue
            notes += demos.notes
        else:
            notes.append("the command was not tried, as there is much to read")
        reports = [
            replace(report, kind=_kind_in(proposal, i, report.kind))
            for i, report in enumerate(judged.reports)
        ]
        command = fit_command(paths, proposal.columns, proposal.preparation)
        return _Tried(command, notes, reports, proposal.positions)
    return _Tried(None, [*judged.looked.guesses, _why_none(judged, problem)], judged.reports)


def _why_none(judged: _Judged, problem: str) -> str:
    if problem:
        return f"no movement can be read as it is: {problem}"
    if not judged.looked.columns:
        return "no movement was found: there are no columns of numbers"
    return "no movement was found: no column looks like a position or an angle that changes"


def _for_robot(judged: _Judged) -> Iterator[_Proposal]:
    columns, values = judged.looked.columns, judged.looked.values
    states = tuple(i for i, column in enumerate(columns) if (column.part_of or column.name) == STATE)
    actions = tuple(i for i, column in enumerate(columns) if (column.part_of or column.name) == ACTION)
    times = [i for i, column in enumerate(columns) if column.name == TIME]
    episode = next((i for i, column in enumerate(columns) if column.name == EPISODE), None)
    differentiated = Columns(action=DIFFERENTIATE)
    seconds = values[times[0]] if times else None
    if states and len(states) == len(actions) and seconds is not None:
        share = explained_by(
            _matrix(values, states), _matrix(values, actions), seconds, _codes(episode, judged.looked)
        )
        if share > AGREES:
            yield _Proposal(Columns(), Preparation(), velocities=actions, positions=states)
            return
        codes = _codes(episode, judged.looked)
        kind = _kind_of_actions(_matrix(values, states), _matrix(values, actions), codes, seconds)
        likely = LIKELY.get(kind, "commanded states, perhaps")
        text = (
            f"{ACTION} is not the velocity of {STATE} (it explains {max(share, 0.0):.0%} of the motion), but {likely}, "
            "so the states are differentiated; --action overrules this"
        )
        yield _Proposal(differentiated, Preparation(), (text,), positions=states)
        return
    yield _Proposal(differentiated, Preparation(), positions=states)


def _proposals(judged: _Judged) -> Iterator[_Proposal]:
    """Propose roles of columns, best first."""
    looked, reports = judged.looked, judged.reports
    clocks: list[_Clock | None] = [*judged.clocks[:2], None]
    episode = judged.episodes[0] if judged.episodes else None
    counting = {
        i
        for i, report in enumerate(reports)
        if report.kind in ("number", "position") and rises_evenly(looked.values[i], judged.codes)
    }
    untimed = "no column tells the time, so samples are taken to be a second apart; --rate overrules this"
    rate = _rate_of_runs(judged.clocks[0], judged.codes) if judged.clocks else None
    if rate is not None:
        clocks = [None]
        called = _name(looked.names[judged.clocks[0].place], judged.clocks[0].place)
        untimed = (
            f"{called} has one stamp for many samples in a row, so these are counted instead, at {rate:g} Hz; --rate "
            "overrules this"
        )
    for clock in clocks:
        taken = {i for i in (clock.place if clock else None, episode) if i is not None} | counting
        taken |= {each.place for each in judged.clocks} if rate is not None else set()
        groups = choose_states(reports, looked.columns, looked.values, taken)
        for group in groups:
            notes = _group_notes(group, groups, looked)
            if group.kind == "position" and len(group.places) == 3:
                notes += _pose_notes(group, looked, reports)
            clockwork = _several(
                [_name(looked.names[i], i) for i in sorted(counting - {clock and clock.place})]
            )
            if clockwork:
                notes = (*notes, f"{clockwork}: rises evenly, as a clock does, and is left out of the state")
            refused: list[str] = []
            for actions in choose_actions(group, reports, looked.columns):
                share, guessed = _agreement(group, actions, clock, judged)
                if share > AGREES:
                    note = (f"the velocities agree with the positions' derivative to {share:.1%}{guessed}",)
                    yield from _roles(judged, group, actions, clock, (*notes, *note))
                elif clock is not None:
                    listed = _several([_name(looked.names[i], i) for i in actions.places])
                    kind = _kind_of_actions(
                        _matrix(looked.values, group.places),
                        _matrix(looked.values, actions.places),
                        judged.codes,
                        clock.seconds,
                    )
                    likely = f", but {LIKELY[kind]}" if kind in LIKELY else ""
                    refused.append(
                        f"{listed}: no derivative of the positions (of whose motion they explain "
                        f"{max(share, 0.0):.0%}){likely}, so the states are differentiated; --action overrules this"
                    )
            if clock is not None:
                yield from _roles(judged, group, None, clock, (*notes, *refused))
            elif not any(clocks):
                yield from _roles(judged, group, None, None, (*notes, untimed), rate or 1.0)


def _roles(
    judged: _Judged,
    group: Group,
    actions: Group | None,
    clock: _Clock | None,
    notes: tuple[str, ...],
    rate: float = 1.0,
) -> Iterator[_Proposal]:
    looked = judged.looked
    at = looked.positions
    columns = replace(
        judged.chosen,
        state=keys_of(group.places, looked.columns, at),
        action=None if actions is None else keys_of(actions.places, looked.columns, at),
        time=None if clock is None else key_of(clock.place, looked.columns, at),
        episode=key_of(judged.episodes[0], looked.columns, at) if judged.episodes else None,
    )
    if group.kind == "rotation":
        columns = replace(columns, rotation=keys_of(group.places, looked.columns, at))
    unit = None if clock is None or clock.is_typed or clock.unit == "s" else clock.unit
    plain = Preparation(time_unit=unit, rate=rate if clock is None and actions is None else None)
    velocities = () if actions is None else actions.places
    yield _Proposal(columns, plain, notes, velocities, group.places)
    resampled = _rate_of_each(group.places, clock, judged)
    if resampled is not None:
        text = (
            f"the states are filled at different times, so each is interpolated between its own stamps, to "
            f"{resampled:g} Hz; --resample names another rate"
        )
        yield _Proposal(columns, replace(plain, resample=resampled), (*notes, text), velocities, group.places)
    # Samples are left out only if the recording cannot be used with them.
    dropping = replace(plain, drop="missing,duplicates,short")
    yield _Proposal(columns, dropping, notes, velocities, group.places)


def _rate_of_each(places: Sequence[int], clock: _Clock | None, judged: _Judged) -> float | None:
    """Return the rate (Hz) of the column that is filled most often, where few rows hold all columns."""
    if clock is None:
        return None
    there = np.isfinite(_matrix(judged.looked.values, places))
    counts = there.sum(axis=0)
    best = there[:, int(np.argmax(counts))]
    if there.all(axis=1).sum() > SPARSE * best.sum():
        return None
    rate = judge_stamps(clock.seconds[best], judged.codes[best]).rate_hz
    return None if rate is None else float(f"{rate:.3g}")


def _rate_of_runs(clock: _Clock, codes: Codes) -> float | None:
    """Return the rate (Hz) of samples that share stamps too coarse for them; None where most stamps differ."""
    order = np.argsort(codes, kind="stable")
    seconds, own = clock.seconds[order], codes[order]
    fresh = np.flatnonzero((np.diff(seconds) != 0) | (np.diff(own) != 0)) + 1
    if len(fresh) < 2 or len(fresh) > COARSE * len(seconds):
        return None
    # The first and the last stamp are cut off.
    lengths, steps = np.diff(fresh), np.diff(seconds[fresh])
    forward = steps > 0
    if not forward.any():
        return None
    return float(f"{np.median(lengths[forward] / steps[forward]):.3g}")


def _of_the_states(
    timing: Timing | None, clock: _Clock | None, codes: Codes, looked: Looked, states: Sequence[int]
) -> Timing | None:
    """Return what the stamps say of the rows that hold states, where most rows hold others."""
    if timing is None or clock is None or not states:
        return timing
    there = np.isfinite(_matrix(looked.values, states)).any(axis=1)
    return timing if there.mean() > SPARSE else judge_stamps(clock.seconds[there], codes[there])


def _unread(reports: Sequence[ColumnReport], looked: Looked) -> list[str]:
    """Say which columns hold text that looks like times or numbers and is neither."""
    notes = []
    odd: list[int] = []
    for i, report in enumerate(reports):
        first = "".join(looked.texts[i][:1]) if i in looked.texts else ""
        if TIME_WORDS & set(words(report.name)) and re.search(r"\d[:./-]\d", first):
            notes.append(
                f"{_name(report.name, i)} holds text such as {first!r}, of which no time can be made: write it as "
                "2024-12-31 23:59:59.5, or in seconds"
            )
        elif re.search(r"\d[.,]\d", first):
            odd.append(i)
    if odd:
        named = _several([_name(reports[i].name, i) for i in odd])
        notes.append(
            f"{named}: text such as {str(looked.texts[odd[0]][0])!r}, which is no number, and left out"
        )
    return notes


def _agreement(group: Group, actions: Group, clock: _Clock | None, judged: _Judged) -> tuple[float, str]:
    """Return the share of the motion that actions explain; without a time, in units of an unknown step."""
    values = judged.looked.values
    X, V = _matrix(values, group.places), _matrix(values, actions.places)
    if clock is not None:
        return explained_by(X, V, clock.seconds, judged.codes), ""
    rows = np.arange(len(X), dtype=np.float64)
    order = np.argsort(judged.codes, kind="stable")
    within = np.diff(judged.codes[order]) == 0
    moved, told = np.diff(X[order], axis=0)[within], V[order][:-1][within]
    whole = np.isfinite(moved).all(axis=1) & np.isfinite(told).all(axis=1)
    total = float(np.sum(told[whole] ** 2))
    step = float(np.sum(moved[whole] * told[whole])) / total if total > 0 else 0.0
    if step <= 0:
        return 0.0, ""
    return explained_by(X, V * step, rows, judged.codes), f", if samples are {step:.3g} s apart"


def _kind_of_actions(states: Array, actions: Array, codes: Codes, seconds: Array) -> str:
    """Return what actions are, as `find_kind` has it, of rows in any order of the episodes."""
    order = np.argsort(codes, kind="stable")
    return find_kind(states[order], actions[order], codes[order], seconds[order])


def _clock(place: int, report: ColumnReport, looked: Looked) -> _Clock:
    values = looked.values[place]
    assert values is not None
    typed = looked.units[place]
    steps = np.diff(values)
    forward = steps[steps > 0]
    typical = float(np.median(forward)) if len(forward) else 0.0
    unit = typed or report.unit or epoch_unit(values) or _guess_unit(typical, forward)
    start = values[np.isfinite(values)][0] if np.isfinite(values).any() else 0.0
    return _Clock(place, unit, typed is not None, (values - start) / TIME_UNITS[unit])


def _guess_unit(typical: float, forward: Array) -> str:
    """Guess the unit of stamps by their typical step; a step of exactly one tells nothing."""
    if typical >= NANOSECOND_STEP:
        return "ns"
    if typical >= 1000:
        return "us"
    whole = bool(np.all(forward == np.round(forward)))
    return "ms" if whole and typical > 1 else "s"


def _time_notes(name: str, clock: _Clock, timing: Timing, reports: Sequence[ColumnReport]) -> list[str]:
    notes = []
    called = repr(name)
    if math.isclose(timing.step, 1.0, rel_tol=1e-12) and clock.unit == "s" and timing.even:
        notes.append(
            f"time {called} goes on in steps of exactly 1, read as seconds: if these are milliseconds or frames, "
            "give --time-unit or another --time"
        )
    elif clock.unit != "s" and not clock.is_typed:
        notes.append(f"time {called} is read in {clock.unit}; if that is wrong, give --time-unit")
    if timing.gaps:
        notes.append(
            f"{timing.gaps} gap{'s' if timing.gaps != 1 else ''} of more than five typical steps, the longest of "
            f"{timing.longest_gap:.3g} s"
        )
    if timing.repeated:
        notes.append(
            f"time {called} repeats a stamp at {timing.repeated} step{'s' if timing.repeated != 1 else ''}"
        )
    if timing.backwards:
        notes.append(
            f"time {called} goes back at {timing.backwards} step{'s' if timing.backwards != 1 else ''}: more than one "
            "episode, or samples out of order"
        )
    if timing.bursts:
        notes.append(
            f"stamps in {called} come in bursts, as when messages are stamped on arrival: use the stamps of the sender "
            "if there are any"
        )
    others = [r.name for r in reports if r.kind == "time" and r is not reports[clock.place]]
    if others:
        notes.append(f"{', '.join(map(repr, others))} may be the time as well; --time overrules the choice")
    return notes


def _without_held(reports: list[ColumnReport], looked: Looked, codes: Codes) -> list[ColumnReport]:
    """Take columns that do not change within episodes for constant: a goal moves only from one to the next."""
    within = np.diff(codes) == 0
    if np.all(within) or not np.any(within):
        return reports
    return [
        replace(report, kind="constant", detail="in each episode")
        if report.kind not in ("time", "episode", "text", "empty", "constant", "index", "quaternion")
        and (values := looked.values[i]) is not None
        and not np.any(np.diff(values)[within])
        else report
        for i, report in enumerate(reports)
    ]


def _oddities(reports: Sequence[ColumnReport], looked: Looked, codes: Codes) -> list[str]:
    """Say what is odd about the columns."""
    notes = []
    for kind, what in (("constant", "do not change"), ("empty", "hold no value")):
        which = [_name(report.name, i) for i, report in enumerate(reports) if report.kind == kind]
        if which:
            notes.append(f"{_several(which)}: columns that {what}")
    lacking = [
        (_name(r.name, i), r.missing) for i, r in enumerate(reports) if r.missing and r.kind != "empty"
    ]
    if lacking:
        total = sum(count for _, count in lacking)
        notes.append(
            f"{total} missing value{'s' if total != 1 else ''}, in {_several([n for n, _ in lacking])}"
        )
    for i, (report, values) in enumerate(zip(reports, looked.values, strict=True)):
        if report.kind == "angle" and values is not None:
            count, turn = wraps(values)
            if count:
                notes.append(
                    f"{_name(report.name, i)} is an angle that wraps by {'360' if turn == 360 else '2π'} {count} "
                    f"time{'s' if count != 1 else ''}: its derivative is wrong there"
                )
    for start in _quaternion_starts(reports):
        four = _matrix(looked.values, tuple(range(start, start + 4)))
        flips = sign_flips(four, codes)
        if flips:
            notes.append(
                f"the quaternion at column {start} changes its sign {flips} time{'s' if flips != 1 else ''} without "
                "turning"
            )
    return notes


def _quaternion_starts(reports: Sequence[ColumnReport]) -> list[int]:
    starts, i = [], 0
    while i < len(reports):
        if reports[i].kind == "quaternion":
            starts.append(i)
            i += 4
        else:
            i += 1
    return starts


def _group_notes(group: Group, groups: Sequence[Group], looked: Looked) -> tuple[str, ...]:
    notes = []
    if group.kind == "number":
        listed = _several([_name(looked.names[i], i) for i in group.places])
        notes.append(f"{listed}: taken for the state because they change smoothly; --state overrules this")
    named = [other.places for other in groups if other.kind in ("position", "state", "angle")]
    others = sorted({i for places in named for i in places} - set(group.places))
    if others:
        listed = _several([_name(looked.names[i], i) for i in others])
        notes.append(f"{listed}: left out of the state; --state overrules the choice")
    return tuple(notes)


def _pose_notes(group: Group, looked: Looked, reports: Sequence[ColumnReport]) -> tuple[str, ...]:
    """Say how positions are learnt with the rotation beside them, where there is one quaternion."""
    rotations = choose_rotations(reports)
    if len(rotations) != 1:
        return ()
    at, columns = looked.positions, looked.columns
    four = ",".join(map(str, keys_of(rotations[0], columns, at)))
    three = ",".join(map(str, keys_of(group.places, columns, at)))
    return (f"to learn poses: --state {three},{four} --rotation {four}, and no --action",)


def _codes(place: int | None, looked: Looked) -> Codes:
    """Return the episode of each row, as a number: by file and, if there is one, by a column."""
    if place is None:
        return np.unique(looked.files, return_inverse=True)[1].astype(np.int64)
    # Their values mean the same in all files of a recording.
    own: Any = looked.values[place]
    if own is None:
        own = looked.texts[place]
    inner = np.unique(own, return_inverse=True)[1]
    codes = looked.recordings * (int(inner.max()) + 1) + inner if len(inner) else inner
    return np.unique(codes, return_inverse=True)[1].astype(np.int64)


def _matrix(values: Sequence[Array | None], places: Sequence[int]) -> Array:
    """Return columns of numbers as an array (N, k)."""
    chosen = [own for i in places if (own := values[i]) is not None]
    return np.stack(chosen, axis=1)


def _called(name: str, part_of: str, component: int | None, robot: LeRobot | None) -> str:
    """Name a component as the dataset does, to be judged by that."""
    if robot is None or component is None:
        return name
    own = robot.component_names(part_of)
    return f"{part_of} {own[component]}" if own else name


def _name(name: str, place: int) -> str:
    return name or f"column {place}"


def _several(names: Sequence[str]) -> str:
    shown = ", ".join(names[:6])
    return shown if len(names) <= 6 else f"{shown} and {len(names) - 6} more"


def _paths(source: Any) -> list[str | os.PathLike[str]]:
    if isinstance(source, str | os.PathLike):
        return [source]
    if not isinstance(source, Iterable):
        raise DataError(f"inspect takes a path or several of them, got {source!r:.60}")
    return list(source)
