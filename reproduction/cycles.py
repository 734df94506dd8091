"""Whether periodic movements keep their amplitude and period over ten periods, plain and kept on a cycle."""

import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from reproduction.markdown import table
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError
from unconstrain.policies import LocallyLinearPolicy
from unconstrain.policies.base import Policy
from unconstrain.recordings import load
from unconstrain.stability import Cycle
from unconstrain.stopping import MovementStopped

PERIODS = 10
"""How long movements are, in periods of the recording."""

STARTS = 8
"""Recorded states from which they begin."""

DT, FINE = 0.02, 0.002
"""Seconds a step."""

KEPT = 0.1
"""By how much amplitude and period may differ from those recorded."""

CENTER = 0.5
"""Seconds over which the moving centre is taken."""

ENDS = 0.2
"""Share of a wiping demonstration at either end in which the hand comes and goes."""


@dataclass(frozen=True)
class Recorded:
    """A recording of something that goes round and round.

    Parameters
    ----------
    name : str
        As a table has it.
    learnt, other : Demonstrations
        What is learnt from, and what amplitude and period are measured on.
    """

    name: str
    learnt: Demonstrations
    other: Demonstrations


@dataclass(frozen=True)
class Kept:
    """How movements keep amplitude and period, as ratios to the recorded ones.

    Parameters
    ----------
    period, amplitude : ndarray of shape (S,)
        Time of a turn over the whole movement, and root mean square distance from the middle in its last period.
    """

    period: np.ndarray
    amplitude: np.ndarray

    @property
    def share(self) -> float:
        """Share of movements that keep both."""
        return float(np.mean((np.abs(self.period - 1) <= KEPT) & (np.abs(self.amplitude - 1) <= KEPT)))

    def describe(self) -> str:
        """Return the share, and the medians of period and amplitude."""
        return f"{self.share:.0%} ({np.median(self.period):.2f}, {np.median(self.amplitude):.3g})"


@dataclass(frozen=True)
class Row:
    """What was found of a recording.

    Parameters
    ----------
    name : str
        Of it.
    turns, period, amplitude : float
        Of what was measured on: how many, seconds, and in the unit of the states.
    plain, fine, stable : Kept
        The plain policy in steps of 20 ms and of 2 ms, and the one on a cycle in steps of 20 ms.
    change : float
        What that changes of the actions in the recorded states, as a share of their length.
    errors : tuple of float
        Of the velocities of the other recording, as a share of these: plain, and on a cycle.
    """

    name: str
    turns: float
    period: float
    amplitude: float
    plain: Kept
    fine: Kept
    stable: Kept
    change: float
    errors: tuple[float, float]


def list_recordings(folder: Path) -> list[Recorded]:
    """Read what goes round: the finger on two surfaces, and the wiping on two, each demonstration by itself.

    Parameters
    ----------
    folder : path
        With planer_circle.csv, curve_circle.csv and wiping/*.mat.

    Returns
    -------
    list of Recorded
        The finger's also in halves, one learnt from and the other measured on.
    """
    found = []
    for surface, file in (("flat", "planer_circle.csv"), ("curved", "curve_circle.csv")):
        demos = load(
            folder / file,
            state=[1, 2, 3],
            time="rosbagTimestamp",
            window=0.2,
            max_speed=1,
            min_duration=1,
            moving_centre=CENTER,
        )
        half = np.arange(len(demos)) < len(demos) // 2
        first, second = demos.select(half), demos.select(~half)
        found += [
            Recorded(f"finger, {surface}", demos, demos),
            Recorded(f"finger, {surface}, first half on second", first, second),
            Recorded(f"finger, {surface}, second half on first", second, first),
        ]
    for surface in ("rim", "fender"):
        demos = load(
            folder / "wiping" / f"demos_{surface}_processed_data.mat",
            state=["X[0]", "X[1]", "X[2]"],
            time="time",
            moving_centre=CENTER if surface == "rim" else None,
        )
        for number in range(demos.n_episodes):
            wiped = demos.episode(number)
            if surface == "rim":
                ends = int(ENDS * len(wiped))
                wiped = wiped.select(slice(ends, len(wiped) - ends))
            found.append(Recorded(f"{surface} no. {number + 1}", wiped, wiped))
    return found


def measure(recorded: Recorded) -> Row:
    """Learn a policy, follow it for ten periods from recorded states, and compare with the recording.

    Parameters
    ----------
    recorded : Recorded
        What to learn from, and to compare with.

    Returns
    -------
    Row
        Figures.

    Raises
    ------
    DataError
        The recording does not go round and round.
    """
    learnt, other = recorded.learnt, recorded.other
    policy = LocallyLinearPolicy().fit(learnt)
    stable = policy.stabilized("cycle", learnt, hold=DT)
    U, changed = policy.predict(learnt.states), stable.predict(learnt.states)
    assert isinstance(stable.stability_, Cycle)
    assert other.time is not None
    truth = Cycle.learn(policy.space_, policy.scale_, other.states, other.episodes, other.time, DT)
    follows = other.episodes[1:] == other.episodes[:-1]
    turns = float(np.sum(np.diff(other.time)[follows])) / truth.period
    return Row(
        recorded.name,
        turns,
        truth.period,
        truth.amplitude(other.states),
        _follow(policy, learnt, truth, other, DT),
        _follow(policy, learnt, truth, other, FINE),
        _follow(stable, learnt, truth, other, DT),
        _size(changed - U) / _size(U),
        (
            _size(policy.predict(other.states) - other.actions) / _size(other.actions),
            _size(stable.predict(other.states) - other.actions) / _size(other.actions),
        ),
    )


def tabulate(rows: list[Row]) -> str:
    """Lay rows out as a table.

    Parameters
    ----------
    rows : list of Row
        One a recording.

    Returns
    -------
    str
        Markdown.
    """
    heads = (
        *("recording", "turns", "period, s", "amplitude", "plain, 20 ms", "plain, 2 ms", "on a cycle, 20 ms"),
        *("changed by", "error: plain", "on a cycle"),
    )
    return table(
        heads,
        [
            (
                *(row.name, f"{row.turns:.1f}", f"{row.period:.2f}", f"{row.amplitude:.3g}"),
                *(each.describe() for each in (row.plain, row.fine, row.stable)),
                *(f"{row.change:.0%}", f"{row.errors[0]:.0%}", f"{row.errors[1]:.0%}"),
            )
            for row in rows
        ],
    )


def _follow(policy: Policy, begins: Demonstrations, truth: Cycle, other: Demonstrations, dt: float) -> Kept:
    starts = begins.states[np.linspace(0, len(begins) - 1, STARTS).astype(int)]
    steps = round(PERIODS * truth.period / dt)
    last = round(truth.period / dt)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MovementStopped)
        movement = policy.rollout(starts, steps, dt, beyond=np.inf)
    periods, amplitudes = [], []
    for number in range(STARTS):
        X = movement.states[movement.episodes == number]
        # About the middle of its own last period: the plain policy may go round elsewhere.
        W = (X - X[-last:].mean(axis=0)) / truth.scale @ truth.axes[:2].T
        phases = np.unwrap(np.arctan2(W[:, 1], W[:, 0]))
        turns = abs(float(phases[-1] - phases[0])) / (2 * np.pi)
        periods.append((len(X) - 1) * dt / turns / truth.period if turns else np.inf)
        amplitudes.append(truth.amplitude(X[-last:]) / truth.amplitude(other.states))
    return Kept(np.array(periods), np.array(amplitudes))


def _size(U: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.sum(U**2, axis=1))))


def measure_all(folder: Path) -> tuple[list[Row], list[str]]:
    """Measure all recordings.

    Parameters
    ----------
    folder : path
        As for `list_recordings`.

    Returns
    -------
    rows : list of Row
        Of those that go round.
    refused : list of str
        Of the others: why not.
    """
    rows, refused = [], []
    for recorded in list_recordings(folder):
        try:
            rows.append(measure(recorded))
        except DataError as error:
            refused.append(f"{recorded.name}: {error}")
    return rows, refused
