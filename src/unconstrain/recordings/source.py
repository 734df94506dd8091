"""The one gateway to recordings: `open` finds out what there is, and what it returns reads it."""

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import wraps
from typing import Any, ParamSpec, TypeVar

import numpy as np

from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError
from unconstrain.memory import available_memory, check_memory
from unconstrain.recordings.batches import Batches
from unconstrain.recordings.blocks import Loaded, Source
from unconstrain.recordings.columns import Columns, Key, Keys
from unconstrain.recordings.notes import Note, add_up, combine
from unconstrain.recordings.opening import (
    check_plain,
    find_frames,
    open_demonstrations,
    open_files,
    open_frames,
    tell_apart,
)
from unconstrain.recordings.preparation import Preparation
from unconstrain.recordings.reading import without_tallies
from unconstrain.recordings.recording import Recording
from unconstrain.recordings.tables import Tables
from unconstrain.samples import Samples
from unconstrain.waiting import stage

BATCH_ROWS = 2**16
"""Rows in a block, unless another number is asked for."""

WHILE_LEARNING = 8
"""How many times the memory of what is loaded a fit to all of it at once may take, with what it is compared with."""

Arguments = ParamSpec("Arguments")


class Recordings:
    """Recordings of which it is known what their columns are and how they are prepared; `open` makes them.

    Nothing but what is asked for is held in memory.

    Parameters
    ----------
    source : Source
        Where the samples come from.
    columns : Columns
        As given.
    preparation : Preparation
        As given.

    Attributes
    ----------
    given : tuple of (Columns, Preparation)
        Both as they were given, by which other recordings can be opened alike.
    notes : tuple of Note
        What was found while reading; complete once the recordings were read through, by `load`, `blocks`, or a fit.
    source : Source
        The rows as streams and clusters read them: light blocks, which are not checked again.
    """

    def __init__(self, source: Source, columns: Columns, preparation: Preparation) -> None:
        self.source = source
        self.given = (columns, preparation)
        self.notes: tuple[Note, ...] = ()

    @property
    def columns(self) -> Columns:
        """Which column is what, as found in the first file."""
        if not isinstance(self.source, Tables):
            return self.given[0]
        return self.source.recordings[0].columns

    @property
    def preparation(self) -> Preparation:
        """What is done to samples, with the unit of time that was found, where it is the same in all files."""
        given = self.given[1]
        if not isinstance(self.source, Tables) or given.rate is not None:
            return given
        units = {each.clock.unit for each in self.source.recordings if each.roles.time is not None}
        return replace(given, time_unit=units.pop()) if len(units) == 1 else given

    @property
    def guessed(self) -> Preparation:
        """The preparation as given, with the unit of time and the kind of actions where these were guessed."""
        given = self.given[1]
        if not isinstance(self.source, Tables) or self.source.recordings[0].roles.time is None:
            return given
        clock = self.source.recordings[0].clock
        # What may be frames is to be doubted again in other recordings.
        return replace(given, time_unit=clock.unit) if clock.guessed and not clock.counts else given

    @property
    def names(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """The names of states and actions; none where the source is arrays."""
        if not isinstance(self.source, Tables):
            return (), ()
        first = self.source.recordings[0]
        return first.state_names, first.action_names

    @property
    def n_rows(self) -> int | None:
        """The number of rows in the files; None where it is not known."""
        return self.source.n_rows

    @property
    def fits_in_memory(self) -> bool:
        """Whether all of it may be loaded and learnt from at once, rather than in one pass by `fit_stream`."""
        left = available_memory()
        return left is None or WHILE_LEARNING * self._loaded_bytes < left

    @stage("reading")
    def load(self) -> Demonstrations:
        """Read all recordings into memory.

        Returns
        -------
        Demonstrations
            In the order of the files and their samples. Their `notes` say what was split, dropped or left out, and what
            looks suspicious.

        Raises
        ------
        DataError
            Anything cannot be read or used, in one sentence that names the file and the place in it, or it does not fit
            into memory.
        """
        self._check_memory()
        several = list(self.source.read_all(None))
        self.notes = self.findings(note for loaded in several for note in loaded.notes)
        full = [loaded for loaded in several if len(loaded)]
        if not full:
            raise self._too_slow(several)
        return self._assemble(full, _Labels(self._alone), self.notes)

    def blocks(self, batch_rows: int = BATCH_ROWS) -> Iterator[Demonstrations]:
        """Read the recordings block by block.

        The blocks, one after the other, hold what `load` returns.

        Parameters
        ----------
        batch_rows : int
            Rows in a block: at most as many, or, where blocks hold whole episodes, at least. Files that are read as a
            whole may give larger blocks.

        Yields
        ------
        Demonstrations

        Raises
        ------
        DataError
            As `load` does; also an episode that goes on after others were read, where its samples need their
            neighbours.
        """
        check_batch_rows(batch_rows)
        self.notes = ()
        notes: tuple[Note, ...] = ()
        labels = _Labels(self._alone)
        empty: list[Loaded] = []
        some = False
        for loaded in self.source.read_all(batch_rows):
            notes = combine((*notes, *loaded.notes))
            if len(loaded):
                some = True
                yield self._assemble([loaded], labels, without_tallies(add_up(loaded.notes)))
            elif not some:
                empty.append(replace(loaded, notes=()))
        self.notes = self.findings(notes)
        if not some:
            raise self._too_slow(empty)

    def without_projections(self) -> "Recordings":
        """Leave out the projections that files hold, which may be those of a simulation.

        Returns
        -------
        Recordings
            The same recordings otherwise.
        """
        if not isinstance(self.source, Tables):
            return self
        return Recordings(self.source.without_projections(), *self.given)

    def identity(self) -> str:
        """Say what tells these recordings from others.

        Returns
        -------
        str
            Of each file its path, size, time of the last change, and a digest of its beginning and end.
        """
        return self.source.identity()

    def findings(self, notes: Iterable[Note]) -> tuple[Note, ...]:
        """Add up the notes of all blocks, and those that need no block: what streams set `notes` to.

        Parameters
        ----------
        notes : iterable of Note
            Of the blocks, in the order of the files.

        Returns
        -------
        tuple of Note
            One for each finding in each file.
        """
        own = self.source.notes() if isinstance(self.source, Tables) else ()
        found = add_up((*own, *notes))
        return self.source.summarize(found) if isinstance(self.source, Tables) else found

    @property
    def _alone(self) -> bool:
        return not isinstance(self.source, Tables) or len(self.source.recordings) == 1

    def _too_slow(self, several: list[Loaded]) -> DataError:
        fastest = max((loaded.motion.fastest for loaded in several if loaded.motion), default=0.0)
        return DataError(
            f"no sample is as fast as min_speed={self.given[1].min_speed or 0.0:g}; "
            f"the fastest action has speed {fastest:.4g}, so choose less"
        )

    def _check_memory(self) -> None:
        pieces = [each.shown for each in self._in_pieces]
        what = " and ".join(pieces[:1]) + (f" and {len(pieces) - 1} more" if pieces[1:] else "")
        check_memory(self._loaded_bytes, f"loading {what}", "use fit_stream, or read them block by block")

    @property
    def _in_pieces(self) -> list[Recording]:
        """The recordings that need not be read as a whole, whose size is known before."""
        every = self.source.recordings if isinstance(self.source, Tables) else ()
        return [each for each in every if not any(file.at_once for file in each.files)]

    @property
    def _loaded_bytes(self) -> float:
        numbers = (each.n_rows * (len(each.roles.state) + 2 * each.n_actions) for each in self._in_pieces)
        return 8.0 * sum(numbers)

    def _assemble(self, several: list[Loaded], labels: "_Labels", notes: tuple[Note, ...]) -> Demonstrations:
        """Make demonstrations of samples; `labels` are those of the episodes met so far in this pass."""
        shared: frozenset[str] | None = None
        names: tuple[tuple[str, ...] | None, tuple[str, ...] | None] = (None, None)
        if isinstance(self.source, Tables):
            first = self.source.recordings[0]
            shared = self.source.shared
            names = (first.state_names, first.action_names)
        numbers: dict[tuple, int] = {}
        codes = []
        for loaded in several:
            groups = loaded.samples.groups
            assert groups is not None
            own = []
            for episode in loaded.episodes:
                labels.add(episode.key, episode.label)
                own.append(numbers.setdefault(episode.key, len(numbers)))
            codes.append(np.asarray(own, dtype=np.int64)[groups])

        def joined(what: str) -> np.ndarray | None:
            parts = [
                getattr(loaded.samples if what in Samples._fields else loaded, what) for loaded in several
            ]
            if parts[0] is None or (shared is not None and what not in ("states", "actions", *shared)):
                return None
            return parts[0] if len(parts) == 1 else np.concatenate(parts)

        states, actions = joined("states"), joined("actions")
        assert states is not None
        assert actions is not None
        return Demonstrations(
            states=states,
            actions=actions,
            episodes=codes[0] if len(codes) == 1 else np.concatenate(codes),
            time=joined("time"),
            policy=joined("policy"),
            projections=joined("projections"),
            forces=joined("forces"),
            free=joined("free"),
            space=self.source.space,
            state_names=names[0],
            action_names=names[1],
            episode_labels=[labels.of[key] for key in numbers],
            notes=[str(note) for note in notes],
            noise=self.source.noise,
        )


Openable = Recordings | Demonstrations | str | os.PathLike[str] | Iterable | Callable[[], Iterable]
"""What can be opened."""


@stage("opening")
def open(
    source: Openable,
    state: Keys | None = None,
    action: Keys | None = None,
    time: Key | None = None,
    episode: Key | None = None,
    *,
    force: Keys | None = None,
    free: Key | None = None,
    projections: Keys | None = None,
    relative_to: Keys | None = None,
    angle: Keys | None = None,
    rotation: Keys | None = None,
    topic: str | Sequence[str] | None = None,
    part: str | None = None,
    time_unit: str | None = None,
    rate: float | None = None,
    action_is: str | None = None,
    drop: str | Sequence[str] | None = None,
    resample: float | None = None,
    window: float | None = None,
    gap: float | None = None,
    max_speed: float | None = None,
    min_speed: float | None = None,
    min_duration: float | None = None,
    force_threshold: float | None = None,
    moving_centre: float | None = None,
    time_axis: str | None = None,
    angle_unit: str | None = None,
    angular_velocity: str | None = None,
    order: int | None = None,
    phase: bool | None = None,
    columns: Columns | None = None,
    preparation: Preparation | None = None,
) -> Recordings:
    """Open recordings, of any format and size.

    Parameters
    ----------
    source : path, pattern, URI, several of them, Demonstrations, data frames, or batches of arrays
        A file of text (CSV and the like under any suffix, also compressed; exports of Vicon, Motive, Qualisys, OpenSim
        and LabVIEW), JSON, JSON Lines, XLSX, C3D, Feather, MATLAB, HDF5, NPZ, NPY or Parquet, or a ROS bag; on disk,
        or at a URI such as ``s3://bucket/file`` that `pyarrow.fs.FileSystem.from_uri` opens. A folder is one of
        Parquet files that are parts of one recording, one of .npy arrays, a ROS 2 bag, or a LeRobot dataset (2.0, 2.1,
        3.0), whose columns have known names. A data frame of pandas or Polars, or an Arrow table, is a recording, and
        so is each of several. Batches are any iterable of ``(X, U)``, ``(X, U, groups)`` or ``(X, U, groups,
        projections)``: states (N, n), actions (N, d), episode labels (N,) or None, and projections (N, d, d), NaN where
        a constraint is not known; or a function that returns such an iterable, which can then be read more than once.
    state, action, time, episode, force, free, projections, relative_to, angle, rotation : column, or list of columns
        Which column is what, by name or by position from 0; see `Columns`. A file that `Demonstrations.save` wrote
        needs none of them.
    topic : str, or list of str, optional
        Which topics of a ROS bag are read; see `Columns`.
    part : str, optional
        Which sheet, section or set of a file is read; see `Columns`.
    time_unit, rate, action_is, drop, resample : optional
        What is done to the samples; see `Preparation`.
    window, gap, max_speed, min_speed, min_duration, force_threshold, moving_centre, time_axis : optional
        What is done to the samples; see `Preparation`.
    angle_unit, angular_velocity, order, phase : optional
        What states and actions are; see `Preparation`.
    columns : Columns, optional
        Instead of single columns.
    preparation : Preparation, optional
        Instead of single options.

    Returns
    -------
    Recordings
        To be read at once, block by block, or by `fit_stream`.

    Raises
    ------
    DataError
        There are no such files or columns, or they cannot be used, in one sentence that names the file.

    Notes
    -----
    The values of the episode column mean the same in all files of a folder, where an episode may go on in the next
    file. In files given one by one they do not, so episodes are called ``file:value`` then. Without that column every
    file is an episode. With `force` and `force_threshold`, or with `free`, samples come with the projections that
    `constraints.from_recording` makes of them; with `projections`, with those.

    Examples
    --------
    >>> import unconstrain as uc
    >>> wipes = uc.open("wipes/", state=["x", "y", "z"], time="t", episode="run")  # doctest: +SKIP
    >>> for demos in wipes.blocks():  # doctest: +SKIP
    ...     print(len(demos))
    """
    columns = _one_carrier(
        "columns",
        columns,
        Columns,
        {
            "state": state, "action": action, "time": time, "episode": episode, "force": force, "free": free,
            "projections": projections, "relative_to": relative_to, "angle": angle,
            "rotation": rotation, "topic": topic, "part": part,
        },
    )  # fmt: skip
    preparation = _one_carrier(
        "preparation",
        preparation,
        Preparation,
        {
            "time_unit": time_unit, "rate": rate, "action_is": action_is, "drop": drop, "resample": resample,
            "window": window, "gap": gap, "max_speed": max_speed, "min_speed": min_speed,
            "min_duration": min_duration, "force_threshold": force_threshold,
            "moving_centre": moving_centre, "time_axis": time_axis, "angle_unit": angle_unit,
            "angular_velocity": angular_velocity, "order": order, "phase": phase,
        },
    )  # fmt: skip
    if isinstance(source, Recordings):
        if (columns, preparation) != (Columns(), Preparation()):
            raise DataError("these recordings are open already: give columns and options when opening them")
        return source
    if isinstance(source, Demonstrations):
        return _of_tables(open_demonstrations(source, columns, preparation), columns, preparation)
    frames = find_frames(source)
    if frames:
        return _of_tables(open_frames(frames, columns, preparation), columns, preparation)
    paths, batches = tell_apart(source)
    if paths:
        return _of_tables(open_files(paths, columns, preparation), columns, preparation)
    check_plain(columns, preparation)
    return Recordings(Batches(batches, min_speed=preparation.min_speed), columns, preparation)


def _of_tables(tables: Tables, columns: Columns, preparation: Preparation) -> Recordings:
    found = tables.recordings[0].kind
    if found.found:  # so that other recordings are read alike
        preparation = replace(preparation, action_is="velocity" if found.kind == "scaled" else found.kind)
    return Recordings(tables, columns, preparation)


def _of(
    opening: Callable[Arguments, Recordings],
) -> Callable[[Callable], Callable[Arguments, Demonstrations]]:
    """Give a function the arguments of another."""

    def with_arguments(loading: Callable) -> Callable[Arguments, Demonstrations]:
        @wraps(opening)
        def load(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Demonstrations:
            return loading(*args, **kwargs)

        load.__name__, load.__qualname__, load.__doc__ = (
            loading.__name__,
            loading.__qualname__,
            loading.__doc__,
        )
        return load

    return with_arguments


@_of(open)
def load(*args: Any, **kwargs: Any) -> Demonstrations:
    """Load recordings of any format into memory: ``open(...).load()``.

    Parameters
    ----------
    source : path, pattern, URI, several of them, Demonstrations, or batches of arrays
        See `open`.
    state, action, time, episode, force, free, projections, relative_to, angle, rotation : column, or list of columns
        Which column is what; see `Columns`.
    topic : str, or list of str, optional
        Which topics of a ROS bag are read; see `Columns`.
    part : str, optional
        Which sheet, section or set of a file is read; see `Columns`.
    time_unit, rate, action_is, drop, resample : optional
        What is done to the samples; see `Preparation`.
    window, gap, max_speed, min_speed, min_duration, force_threshold, moving_centre, time_axis : optional
        What is done to the samples; see `Preparation`.
    angle_unit, angular_velocity, order, phase : optional
        What states and actions are; see `Preparation`.
    columns : Columns, optional
        Instead of single columns.
    preparation : Preparation, optional
        Instead of single options.

    Returns
    -------
    Demonstrations
        In the order of the files and their samples. Their `notes` say what was split, dropped or left out, and what
        looks suspicious.

    Raises
    ------
    DataError
        Anything cannot be read or used, in one sentence that names the file and the place in it.

    Examples
    --------
    >>> import unconstrain as uc
    >>> demos = uc.load("wipe.csv", state=["x", "y", "z"], time="t", episode="run")  # doctest: +SKIP
    """
    return open(*args, **kwargs).load()


def check_batch_rows(batch_rows: int) -> None:
    """Raise `DataError` for a number of rows that is none."""
    if isinstance(batch_rows, bool) or not isinstance(batch_rows, int | np.integer) or batch_rows < 1:
        raise DataError(f"batch_rows must be a whole number of at least 1, got {batch_rows!r}")


Carrier = TypeVar("Carrier", Columns, Preparation)


def _one_carrier(name: str, carrier: Carrier | None, kind: type[Carrier], single: dict[str, Any]) -> Carrier:
    """Return the carrier that is given, or one made of single options."""
    given = {option: value for option, value in single.items() if value is not None}
    if carrier is None:
        return kind(**given)
    if not isinstance(carrier, kind):
        raise DataError(f"{name}= must be a {kind.__name__}, got {carrier!r:.80}")
    if given:
        raise DataError(f"give either {name}= or {next(iter(given))}=, since both say the same")
    return carrier


class _Labels:
    """The labels of the episodes met in a pass: one that an episode of another recording has gets a number."""

    def __init__(self, alone: bool) -> None:
        self.of: dict[tuple, str] = {}
        self._taken: set[str] | None = None if alone else set()

    def add(self, key: tuple, label: str) -> None:
        if key in self.of:
            return
        distinct, number = label, 1
        if self._taken is not None:
            while distinct in self._taken:
                number += 1
                distinct = f"{label} ({number})"
            self._taken.add(distinct)
        self.of[key] = distinct
