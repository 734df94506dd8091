"""One recording: files whose episodes mean the same, with their columns in their roles."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from unconstrain.errors import DataError
from unconstrain.recordings.actions import VELOCITY, ActionKind
from unconstrain.recordings.blocks import number_values
from unconstrain.recordings.columns import NO_ANGLE, Columns
from unconstrain.recordings.derivative import longest_window
from unconstrain.recordings.files import label as label_files
from unconstrain.recordings.formats.base import ColumnKey, Declared, Format
from unconstrain.recordings.joined import read_labels
from unconstrain.recordings.pieces import Piece, read_numbers
from unconstrain.recordings.preparation import TIME_UNITS, Preparation
from unconstrain.recordings.roles import Roles
from unconstrain.recordings.smoothing import Smoothing
from unconstrain.recordings.steps import runs
from unconstrain.recordings.table import Field
from unconstrain.recordings.time import Clock
from unconstrain.spaces import Numbers, Phased, SecondOrder, Space

Codes = NDArray[np.int64]

BLOCKS = 5
"""Into how many contiguous blocks a single file without episodes is cut, which streams take for episodes."""

FIRST_ROWS = 10_000
"""Rows, at most, by which it is decided how stamps are read, what actions are, and how long states are smoothed."""


class Episodes(NamedTuple):
    """The episodes of some rows, numbered from 0.

    Parameters
    ----------
    values : list
        The value of each in the episode column, or the number of its file.
    labels : list of str
        What each is called.
    """

    values: list[Any]
    labels: list[str]


NEEDED = ("state", "relative_to", "action", "time")
"""What a row must hold to be used."""


@dataclass(frozen=True)
class Recording:
    """Files that are read one after the other. It can be sent to another process.

    Parameters
    ----------
    shown : str
        What the user calls it.
    name : str
        What notes call it.
    label : str
        What its episodes are called after.
    number : int
        Which of the recordings it is.
    alone : bool
        Whether it is the only one.
    files : tuple of Format
    roles : Roles
    columns : Columns
        As the user gives them.
    preparation : Preparation
    declared : Declared or None
        What the files say of themselves.
    is_along_episodes : bool
        Whether blocks end where episodes do even if samples are taken by themselves.
    kind : ActionKind
        What recorded actions are.
    leader : Recording, optional
        The recording whose unit of time is taken where it has to be guessed.
    known_space : Space, optional
        What the states in the files are, where they are no plain numbers.
    smoothing : Smoothing, optional
        Where something is differentiated, what was found of the states' noise.
    duration : float, optional
        Where states get a phase, how long an episode takes (s).
    """

    shown: str
    name: str
    label: str
    number: int
    alone: bool
    files: tuple[Format, ...]
    roles: Roles
    columns: Columns
    preparation: Preparation
    declared: Declared | None = None
    is_along_episodes: bool = False
    kind: ActionKind = VELOCITY
    leader: "Recording | None" = None
    known_space: Space | None = None
    smoothing: Smoothing | None = None
    duration: float | None = None

    @property
    def recorded_space(self) -> Space:
        """What the states in the files are."""
        return self.known_space or Numbers(len(self.roles.state))

    @property
    def space(self) -> Space:
        """What the states of samples are."""
        if not self.preparation.phase:
            return self._moving_space
        assert self.duration is not None
        return Phased(self._moving_space, self.duration)

    @property
    def _moving_space(self) -> Space:
        """What the states of samples are, without their phase."""
        return SecondOrder(self.recorded_space) if self.preparation.order == 2 else self.recorded_space

    @property
    def n_actions(self) -> int:
        """The number d of action dimensions."""
        return len(self.roles.action) or self.space.n_actions

    @property
    def state_names(self) -> tuple[str, ...]:
        """The names of the states of samples."""
        names = self.roles.state_names
        if self.preparation.order == 2:
            names = SecondOrder(self.recorded_space).state_names(names)
        space = self.space
        return space.state_names(names) if self.preparation.phase and isinstance(space, Phased) else names

    @property
    def action_names(self) -> tuple[str, ...]:
        """The names of the actions of samples."""
        if self.preparation.order == 2:
            return self.space.action_names(self.state_names)
        return self.roles.action_names

    @property
    def changes_states(self) -> bool:
        """Whether the states of samples are others than lie in the files, and not only smoother ones."""
        return self.is_relative or self.preparation.order == 2 or self.preparation.phase

    @cached_property
    def n_rows(self) -> int:
        """The number of rows in all files; text is read to count them."""
        return sum(sum(file.row_groups) for file in self.files)

    @property
    def differentiates(self) -> bool:
        """Whether the actions are the derivative of the states."""
        return not self.roles.action

    @property
    def smooths(self) -> bool:
        """Whether anything is differentiated over a window: states, or what they are relative to, or velocities."""
        return self.differentiates or bool(self.roles.reference) or self.preparation.order == 2

    @property
    def window(self) -> float:
        """Over how long (s) states are smoothed when they are differentiated."""
        if self.preparation.window is not None:
            return self.preparation.window
        # Where nothing could be found, the fewest samples that have a slope.
        return 2 * self.step if self.smoothing is None else self.smoothing.window

    def fit_window(self, stamps: NDArray[np.float64]) -> float:
        """Return over how long (s) an episode with these stamps (N,) is smoothed: what was found may be too long."""
        return min(self.window, longest_window(stamps)) if self.preparation.window is None else self.window

    @property
    def noise(self) -> float | None:
        """Standard deviation of the noise of actions that were differentiated, where it is known."""
        if self.preparation.order == 2 or self.roles.rotations:
            return None  # that of accelerations and of turning is not known
        if self.differentiates:
            return None if self.smoothing is None else self.smoothing.velocity_noise
        return self.declared.noise if self.saves and self.declared is not None else None

    @property
    def splits(self) -> bool:
        """Whether samples are prepared by their time: split, resampled, differentiated, or left out by it."""
        if not self.timed:
            return False
        how = self.preparation
        asked = not (how.gap is how.max_speed is how.resample is None)
        by_time = any(how.drops(what) for what in ("duplicates", "short", "pauses"))
        return self.smooths or asked or by_time or self.kind.kind == "increment"

    @property
    def fills(self) -> bool:
        """Whether columns that are filled at different rates are interpolated, each between its own stamps."""
        return self.timed and self.preparation.resample is not None and not self.saves

    @property
    def timed(self) -> bool:
        """Whether the time of samples is known."""
        return self.roles.time is not None or self.preparation.rate is not None

    @property
    def unwraps(self) -> bool:
        """Whether states are looked through for angles."""
        chosen = self.columns.angle
        if self.roles.rotations and self.differentiates:
            return True
        return chosen != NO_ANGLE and (self.differentiates or chosen is not None)

    @property
    def is_relative(self) -> bool:
        """Whether states are taken relative to something."""
        return not (self.columns.relative_to is self.preparation.moving_centre is None)

    @property
    def reads_projections(self) -> bool:
        """Whether files hold the projections."""
        return bool(self.roles.projections) and not self.makes_projections

    @property
    def makes_projections(self) -> bool:
        """Whether projections are made of forces or flags."""
        chosen, threshold = self.columns, self.preparation.force_threshold
        if chosen.projections is not None:
            return False
        if self.roles.force and (chosen.force is not None or threshold is not None):
            return threshold is not None
        return chosen.free is not None

    @property
    def knows_projections(self) -> bool:
        """Whether it is read for what is known of constraints. Raises `DataError` for forces without a threshold."""
        if self.columns.force is not None and self.preparation.force_threshold is None:
            raise DataError(
                "give force_threshold=, above which a force is a contact, in the unit of the forces"
            )
        return self.columns.projections is not None or self.makes_projections

    @property
    def whole_episodes_for(self) -> str | None:
        """What is done with a sample that takes its neighbours, where anything is."""
        if self.splits:
            return "differentiate" if self.differentiates else "split"
        if self.is_relative:
            return "find what is relative in"
        if self.preparation.phase:
            return "find the phase of"
        if self.unwraps or self.preparation.drop is not None:
            return "unwrap" if self.unwraps else "drop samples of"
        return "filter the forces of" if self.makes_projections and self.roles.force else None

    def read_pieces(
        self, keys: Sequence[ColumnKey], start: int = 0, stop: int | None = None
    ) -> Iterator[Piece]:
        """Read rows `start` to `stop` of these columns, in order, some at a time."""
        at = {key: i for i, key in enumerate(keys)}
        if start == 0 and stop is None:
            for number, file in enumerate(self.files):
                yield from (Piece(file, number, first, rows, at) for first, rows in file.read(keys))
            return
        stop = self.n_rows if stop is None else min(stop, self.n_rows)
        begin = 0  # row of the file at hand
        for number, file in enumerate(self.files):
            n_rows = sum(file.row_groups)
            low, high = max(start - begin, 0), min(stop - begin, n_rows)
            if low < high:
                yield from (
                    Piece(file, number, first, rows, at) for first, rows in file.read(keys, low, high)
                )
            begin += n_rows

    def read_plain(self, pieces: Sequence[Piece]) -> tuple[NDArray[Any], NDArray[Any] | None]:
        """Return the states (N, n) and actions (N, d) of pieces as they lie in the files, or None for actions."""
        roles = self.roles
        pieces = self.complete(pieces)
        if self.differentiates:
            return read_numbers(pieces, roles.state, "state").T, None
        both = read_numbers(pieces, (*roles.state, *roles.action), "state and action")
        n = len(roles.state)
        U = both[n:].T
        return both[:n].T, U / self.step if self.kind.kind == "increment" and self.timed else U

    def plain_keys(self) -> list[ColumnKey]:
        """Return the columns of states and actions."""
        return distinct(self.roles.state, self.roles.action)

    @cached_property
    def step(self) -> float:
        """The typical step (s) between samples, as they lie in the files; 0.0 where it is not known."""
        if self.roles.time is not None:
            return self.clock.step
        return 0.0 if self.preparation.rate is None else 1.0 / self.preparation.rate

    def labels(self, pieces: Sequence[Piece]) -> NDArray[Any]:
        """Return what is not torn apart in blocks of whole episodes, (N,): the values of the episode column."""
        if self.roles.episode is None:
            return np.repeat([piece.file for piece in pieces], [len(piece.rows) for piece in pieces])
        return read_labels(pieces, self.roles.episode)

    def groups(self, pieces: Sequence[Piece], start: int) -> NDArray[Any]:
        """Return what cross-validation leaves out, (N,), of pieces the first of which begins at row `start`."""
        if self.undivided:
            return self.divide(start + np.arange(sum(len(piece.rows) for piece in pieces)))
        values = self.labels(pieces)
        if self.alone:
            return values
        codes, found = number_values(values)
        return np.array([self.name_fragment(value, 0) for value in found])[codes]

    def divide(self, rows: Codes) -> Codes:
        """Return in which of `BLOCKS` contiguous blocks these rows (N,) of a recording without episodes lie."""
        return rows * BLOCKS // self.n_rows

    def count_time(self, codes: Codes) -> NDArray[np.float64]:
        """Return the time (s) of rows without stamps, (N,): their number within the episode by the rate.

        Parameters
        ----------
        codes : ndarray of shape (N,)
            The episode of each row, as a number from 0.

        Returns
        -------
        ndarray of shape (N,)
        """
        assert self.preparation.rate is not None
        time = np.empty(len(codes))
        for own in runs(codes):
            time[own] = np.arange(len(own)) / self.preparation.rate
        return time

    @cached_property
    def clock(self) -> Clock:
        """How stamps are read, decided by the first rows."""
        assert self.roles.time is not None
        episode = () if self.roles.episode is None else (self.roles.episode,)
        states = self.roles.state if self.preparation.drops("missing") else ()
        keys = distinct((self.roles.time,), episode, states)
        piece = next(piece for piece in self.read_pieces(keys) if len(piece.rows))
        piece = piece.slice(0, FIRST_ROWS) if not piece.format.at_once else piece
        timed = self.complete([piece], ("time",))[0]
        piece = self.complete([piece])[0]
        piece = piece if len(piece.rows) else timed
        codes, _ = number_values(self.labels([piece]))
        unit = "s" if self.saves else self.preparation.time_unit
        if unit is None and self.preparation.rate is None and self.roles.time.unit in TIME_UNITS:
            unit = self.roles.time.unit
        cells = piece.cells(self.roles.time, "time")
        own = Clock.decide(cells, codes, unit, self.preparation.rate)
        if unit is not None or self.leader is None or own.of_type:
            return own
        return own.led_by(self.leader.clock)

    @property
    def undivided(self) -> bool:
        """Whether nothing tells episodes apart, not even files."""
        return self.roles.episode is None and len(self.files) == 1 and self.alone

    @property
    def saves(self) -> bool:
        """Whether the files hold demonstrations that this package saved, which are given back as they were."""
        return self.declared is not None and self.declared.saved

    @property
    def shortest(self) -> float:
        """How long (s) a fragment of a split episode has to last."""
        window = self.window if self.smooths else 0.0
        return max(window, self.preparation.min_duration or 0.0)

    def keys(self, everything: bool) -> list[ColumnKey]:
        """Return the columns that are read for blocks: of all that there is, or of what is learnt from."""
        roles = self.roles
        fields = [*roles.state, *roles.action]
        columns: tuple[ColumnKey, ...] = ()
        made = self.makes_projections
        if roles.time is not None and (everything or self.splits or self.changes_states):
            fields.append(roles.time)
        fields += roles.reference
        if everything or self.reads_projections:
            columns = roles.projections
        if everything or made:
            fields += roles.force
            fields += () if roles.free is None else (roles.free,)
        last = () if roles.episode is None else (roles.episode,)
        return list(
            dict.fromkeys([*distinct(fields), *columns, *distinct(roles.policy if everything else (), last)])
        )

    def complete(self, pieces: Sequence[Piece], needed: Sequence[str] = NEEDED) -> Sequence[Piece]:
        """Leave out the rows without a state, what it is relative to, an action or a stamp, where that is asked for.

        Parameters
        ----------
        pieces : sequence of Piece
        needed : sequence of str
            What must be there.

        Returns
        -------
        sequence of Piece
        """
        if not (self.preparation.drops("missing") or self.fills):
            return pieces
        roles = self.roles
        several = (
            ("state", roles.state),
            ("relative_to", roles.reference),
            ("action", roles.action),
            ("time", () if roles.time is None else (roles.time,)),
        )
        wanted = [(role, field) for role, fields in several if role in needed for field in fields]
        complete = []
        for piece in pieces:
            missing = np.zeros(len(piece.rows), dtype=bool)
            for role, field in wanted:
                if field.key in piece.at:
                    missing |= piece.missing(field, role)
            complete.append(piece.without(missing) if missing.any() else piece)
        return complete

    def name_fragment(self, value: Any, part: int) -> str:
        """Return a name that no other fragment of the source has.

        Parameters
        ----------
        value : object
            Of the episode, as `labels` gives it.
        part : int
            Which of the episode's fragments it is, counted from 1; 0 where it is the only one.

        Returns
        -------
        str
        """
        if self.roles.episode is None and len(self.files) == 1:
            name = self.label
        else:
            name = self._with_label(_describe_label(value))
        return f"{name}/{part}" if part else name

    def number_episodes(self, values: NDArray[Any]) -> tuple[Episodes, Codes]:
        """Give the episodes of some rows their numbers.

        Parameters
        ----------
        values : ndarray of shape (N,)
            As `labels` gives them.

        Returns
        -------
        Episodes
        ndarray of shape (N,)
            The number of each row's episode.

        Raises
        ------
        DataError
            Saved demonstrations have no such episode.
        """
        if self.saves and self.roles.episode is not None:
            return self._saved_episodes(values)
        codes, found = number_values(values)
        if self.roles.episode is not None:
            labels = [self._with_label(_describe_label(value)) for value in found]
        elif len(self.files) == 1:
            labels = [self.label for _ in found]
        else:
            names = label_files([file.file.shown for file in self.files])
            labels = [self._with_label(names[number]) for number in found]
        return Episodes(found, labels), codes

    def _saved_episodes(self, values: NDArray[Any]) -> tuple[Episodes, Codes]:
        assert self.declared is not None
        distinct, codes = np.unique(values, return_inverse=True)
        numbers = distinct.tolist()
        try:
            labels = [self.declared.episode_labels[number] for number in numbers]
            if min(numbers, default=0) < 0:
                raise IndexError
        except (IndexError, TypeError) as error:
            raise DataError(f"{self.shown} is damaged and cannot be read as saved demonstrations") from error
        return Episodes(numbers, labels), codes.astype(np.int64)

    def _with_label(self, episode: str) -> str:
        """Call an episode after its recording too, where there are several."""
        return episode if self.alone else f"{self.label}:{episode}"


def _describe_label(value: Any) -> str:
    return str(int(value)) if isinstance(value, float) and value.is_integer() else str(value)


def distinct(*fields: Sequence[Field]) -> list[ColumnKey]:
    """Return the columns that fields are read from, each once."""
    return list(dict.fromkeys(field.key for each in fields for field in each))
