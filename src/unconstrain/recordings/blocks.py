"""What a stream is read as: blocks of samples, one after the other."""

from collections.abc import Callable, Generator, Hashable, Iterator
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from unconstrain.recordings.episodewise import norms
from unconstrain.recordings.notes import Note
from unconstrain.samples import Samples
from unconstrain.spaces import Space

Array = NDArray[np.float64]


class Episode(NamedTuple):
    """An episode of a pass over recordings.

    Parameters
    ----------
    key : tuple
        What tells it from all others: the recording, its value in the episode column, and which fragment it is.
    label : str
    """

    key: tuple[Hashable, ...]
    label: str


@dataclass(frozen=True)
class Motion:
    """What moves in samples, before slow ones are left out.

    Parameters
    ----------
    n_samples : int
    moves : bool
        Whether any action differs from zero.
    fastest : float
        The length of the longest action.
    """

    n_samples: int = 0
    moves: bool = False
    fastest: float = 0.0

    @classmethod
    def of(cls, U: Array) -> "Motion":
        """Look at actions (N, d)."""
        return cls(len(U), bool(np.any(U)), float(norms(U).max(initial=0.0)))

    def __add__(self, other: "Motion") -> "Motion":
        """Return the motion of both together."""
        fastest = max(self.fastest, other.fastest)
        return Motion(self.n_samples + other.n_samples, self.moves or other.moves, fastest)


@dataclass(frozen=True)
class Loaded:
    """Samples, and what else a block holds.

    Parameters
    ----------
    samples : Samples
        float32 where files hold nothing else, or float64. `groups` are episode labels, or numbers into `episodes`.
    notes : tuple of Note
        What was found in these samples.
    motion : Motion or None
    episodes : tuple of Episode
        Where the samples are to become demonstrations; so are all that follow.
    time : ndarray of shape (N,) or None
    policy : ndarray of shape (N, d) or None
    forces : ndarray of shape (N, m) or None
    free : ndarray of shape (N,) or None
    """

    samples: Samples
    notes: tuple[Note, ...] = ()
    motion: Motion | None = None
    episodes: tuple[Episode, ...] = ()
    time: Array | None = None
    policy: Array | None = None
    forces: Array | None = None
    free: Array | None = None

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self.samples.states)


@dataclass(frozen=True)
class Block:
    """Rows `start` to `stop` of a source, which `load` turns into samples; threads may load several at a time."""

    start: int
    stop: int
    load: Callable[[], Loaded]


class Source(Protocol):
    """Where samples come from: what `Recordings`, streams and clusters read."""

    @property
    def n_rows(self) -> int | None:
        """The number of rows, where it is known."""
        ...

    @property
    def row_groups(self) -> tuple[int, ...] | None:
        """The numbers of rows that are read together, where parts of the source can be read by themselves."""
        ...

    @property
    def repeatable(self) -> bool:
        """Whether it can be read more than once."""
        ...

    @property
    def scalar_actions(self) -> bool:
        """Whether the actions were of shape (N,)."""
        ...

    @property
    def space(self) -> Space | None:
        """What states are, where that is known."""
        ...

    @property
    def knows_projections(self) -> bool:
        """Whether samples come with projections. Raises `DataError` where it takes more to make them."""
        ...

    @property
    def noise(self) -> float | None:
        """Standard deviation of the actions' noise, where it is known."""
        ...

    @property
    def whole_episodes_for(self) -> str | None:
        """What is done to a sample with its neighbours, so that blocks hold whole episodes."""
        ...

    @property
    def relabels(self) -> bool:
        """Whether it is known only after preparation which episodes there are."""
        ...

    def along_episodes(self) -> "Source":
        """Return the same source, in whose blocks no samples of an episode that follow each other are torn apart."""
        ...

    def head(self) -> tuple[NDArray[Any], NDArray[Any] | None]:
        """Read a few states (N, n) and actions (N, d); None for actions that are yet to be differentiated."""
        ...

    def sample(self, n_rows: int, random_state: int | None) -> tuple[NDArray[Any], NDArray[Any] | None]:
        """Read states and actions, as `head` does, of at most `n_rows` rows; of all where there are no more."""
        ...

    def blocks(
        self, batch_rows: int, start: int = 0, stop: int | None = None
    ) -> Generator[Block, None, None]:
        """Read light blocks from row `start`, where an earlier block ended, to row `stop`."""
        ...

    def labels(self, start: int, stop: int, *, whole: bool = False) -> Iterator[tuple[NDArray[Any], int]]:
        """Read the labels of rows alone, some at a time, each with the row where they begin.

        They are those of the samples' groups, or with `whole` those of what is not torn apart in blocks.
        """
        ...

    def read_all(self, batch_rows: int | None) -> Iterator[Loaded]:
        """Read everything there is, as `Recordings.blocks` gives it, or with None a whole recording at a time."""
        ...

    def identity(self) -> str:
        """Say what tells this source from another, for a checkpoint."""
        ...


def leave_out_slow(loaded: Loaded, least: float) -> Loaded:
    """Leave out samples whose action is shorter than `least`, with a note of how many went."""
    U = loaded.samples.actions
    speeds = norms(U)
    keep = speeds >= least
    text = f"left out {{}} of {{}} slower than {least:g}"
    note = Note("slow", "", text, (int(np.sum(~keep)), len(U)), ("", "sample"))
    motion = Motion(len(U), bool(np.any(U)), float(speeds.max(initial=0.0)))
    loaded = replace(loaded, notes=(*loaded.notes, note), motion=motion)
    return loaded if keep.all() else select(loaded, keep)


def select(loaded: Loaded, keep: NDArray[np.bool_]) -> Loaded:
    """Return the samples of a mask (N,); episodes that have none left are gone."""

    def kept(array: Array | None) -> Array | None:
        return None if array is None else array[keep]

    whole = loaded.samples
    samples = whole._replace(
        states=whole.states[keep],
        actions=whole.actions[keep],
        groups=None if whole.groups is None else whole.groups[keep],
        projections=kept(whole.projections),
    )
    episodes = loaded.episodes
    if episodes and samples.groups is not None:
        used, codes = np.unique(samples.groups, return_inverse=True)
        samples = samples._replace(groups=codes.astype(np.int64))
        episodes = tuple(episodes[i] for i in used)
    return replace(
        loaded,
        samples=samples,
        episodes=episodes,
        time=kept(loaded.time),
        policy=kept(loaded.policy),
        forces=kept(loaded.forces),
        free=kept(loaded.free),
    )


def number_values(values: NDArray[Any]) -> tuple[NDArray[np.int64], list[Any]]:
    """Assign numbers to values in the order in which they appear.

    Parameters
    ----------
    values : ndarray of shape (N,)

    Returns
    -------
    ndarray of shape (N,)
        Numbers from 0.
    list
        The value of each number.
    """
    if not len(values):
        return np.zeros(0, dtype=np.int64), []
    # Equal values mostly follow each other, so only where they change is a value looked up.
    begins = np.concatenate([[True], values[1:] != values[:-1]])
    numbers: dict[Any, int] = {}
    codes = [numbers.setdefault(value, len(numbers)) for value in values[begins].tolist()]
    lengths = np.diff(np.flatnonzero(np.append(begins, True)))
    return np.repeat(np.asarray(codes, dtype=np.int64), lengths), list(numbers)
