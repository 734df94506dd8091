"""What a file format must do: one class a format, and a table of them in `unconstrain.recordings.formats`."""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import ClassVar, Protocol, Self, runtime_checkable

import pyarrow as pa

from unconstrain.errors import DataError
from unconstrain.recordings.columns import Columns, Key, Keys
from unconstrain.recordings.files import File
from unconstrain.recordings.table import Header, row
from unconstrain.spaces import Space

ColumnKey = tuple[str, int]
"""A column's name, and which of the columns of that name it is, from 0."""

GUESS = b"guess"
"""Where, in the schema's metadata of the rows that it reads, a format says what it guessed of them, a line each."""

MOST_PARTS = 8
"""Parts of a file that a sentence names."""


@dataclass(frozen=True)
class Declared:
    """What files say of their own columns.

    Parameters
    ----------
    columns : Columns
        The roles that are taken where the user gives none. Without states among them, they are taken beside those
        that the user gives.
    saved : bool
        Whether this package wrote the file: its episodes are then numbers into `episode_labels`, and the files of a
        folder are recordings by themselves.
    policy : column, or list of columns, optional
        The true policy.
    force, free, projections : column, or list of columns, optional
        What is known of constraints. `Columns` has these too, but there they exclude each other, since they are a
        choice of what to learn from; a file may hold them all.
    state_names, action_names, episode_labels, notes : tuple of str, optional
        As `Demonstrations` has them.
    space : Space, optional
    noise : float, optional
        As `Demonstrations` has it.
    """

    columns: Columns
    saved: bool = False
    policy: Keys | None = None
    force: Keys | None = None
    free: Key | None = None
    projections: Keys | None = None
    state_names: tuple[str, ...] | None = None
    action_names: tuple[str, ...] | None = None
    episode_labels: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    space: Space | None = None
    noise: float | None = None


def note_guesses(guesses: Iterable[str]) -> dict[bytes, bytes] | None:
    """Return the metadata of rows that tell what was guessed of them, without what a terminal would act on.

    Parameters
    ----------
    guesses : iterable of str
        A sentence each; those that come twice are told once.

    Returns
    -------
    dict or None
    """
    lines = ["".join(c for c in guess if c.isprintable()) for guess in dict.fromkeys(guesses)]
    return {GUESS: "\n".join(lines).encode()} if lines else None


class Format(Protocol):
    """A file of one format, opened. It can be sent to another process.

    To add a format, write a class like this in a file of its own and name it in `unconstrain.recordings.formats`.
    """

    suffixes: ClassVar[tuple[str, ...]]
    """Suffixes that promise this format, where the content does not tell."""

    at_once: ClassVar[bool]
    """Whether the file is read as a whole; otherwise rows are read as they are asked for."""

    file: File

    def __init__(self, file: File) -> None: ...

    @classmethod
    def matches(cls, file: File) -> bool:
        """Whether the content is of this format, as its first bytes tell."""
        ...

    def columns(self) -> Header:
        """Return the columns there are. Raises `DataError` for a file that is damaged, foreign or empty."""
        ...

    def declared(self) -> Declared | None:
        """Return what the file says of its columns, if anything."""
        ...

    @property
    def row_groups(self) -> tuple[int, ...]:
        """The numbers of rows that are decoded together."""
        ...

    def read(
        self, columns: Sequence[ColumnKey], start: int = 0, stop: int | None = None
    ) -> Iterator[tuple[int, pa.RecordBatch]]:
        """Read rows `start` to `stop` of these columns, in order, some at a time, each with its first row.

        What had to be guessed stands in the metadata of their schema, under `GUESS`, and becomes a note.
        """
        ...

    def place(self, index: int) -> str:
        """Say where in the file a row is."""
        ...

    def in_one_thread(self) -> "Format":
        """Return the same file, decoded by one thread: where there are as many tasks as threads already."""
        ...

    def identity(self) -> str:
        """Say what tells the content from that of other files."""
        ...


class OneFile:
    """What most formats have in common: they need nothing but their file, and say nothing of its columns.

    Parameters
    ----------
    file : File
    """

    suffixes: ClassVar[tuple[str, ...]] = ()
    at_once: ClassVar[bool] = True

    def __init__(self, file: File) -> None:
        self.file = file

    @classmethod
    def matches(cls, file: File) -> bool:
        """Whether the content is of this format, as its first bytes tell."""
        return False

    def declared(self) -> Declared | None:
        """Return nothing: such files say nothing of their columns but their names."""
        return None

    def place(self, index: int) -> str:
        """Say where in the file a row is."""
        return row(index)

    def in_one_thread(self) -> Self:
        """Return the same file, decoded by one thread."""
        return self

    def identity(self) -> str:
        """Say what tells the content from that of other files."""
        return repr(self.file.identity())


@runtime_checkable
class HasParts(Protocol):
    """What a format does too whose files may hold several tables side by side, of which one is read."""

    part: str | None
    """The one that the user names."""

    def parts(self) -> tuple[str, ...]:
        """Return what there is to choose from: sheets, sections of an export, files of an archive."""
        ...

    def for_part(self, name: str) -> Format:
        """Return the same file, of which nothing but this part is read. That it is not there, `columns` says."""
        ...


def note_part(taken: str, every: Sequence[str]) -> str:
    """Say which part of a file is read, and which option names another one.

    Parameters
    ----------
    taken : str
    every : sequence of str

    Returns
    -------
    str
    """
    others = [repr(name) for name in every if name != taken]
    more = f" and {len(others) - MOST_PARTS} more" if len(others) > MOST_PARTS else ""
    return (
        f"of its parts {taken!r} is read; part= names another one, of {', '.join(others[:MOST_PARTS])}{more}"
    )


def find_part(name: str | None, every: Sequence[str], shown: str) -> str | None:
    """Return the part that a name stands for, or None without a name.

    Parameters
    ----------
    name : str or None
        In whatever case, or the last part of a path.
    every : sequence of str
    shown : str
        The file, as the user calls it.

    Returns
    -------
    str or None

    Raises
    ------
    DataError
        There is none of that name.
    """
    if name is None:
        return None
    alike = [each for each in every if name.lower() in (each.lower(), each.lower().rsplit("/", 1)[-1])]
    if name in every or alike:
        return name if name in every else alike[0]
    more = f" and {len(every) - MOST_PARTS} more" if len(every) > MOST_PARTS else ""
    raise DataError(
        f"{shown} has no part {name!r}; its parts are {', '.join(map(repr, every[:MOST_PARTS]))}{more}"
        if every
        else f"{shown} has no parts of which part= could name one: leave it out"
    )


@runtime_checkable
class HasTopics(Protocol):
    """What a format does too whose files hold several tables, of which the user names some: topics of a bag."""

    def topics_of_movement(self) -> tuple[str, ...]:
        """Return the topics that may hold a movement, the likeliest first."""
        ...

    def for_topics(self, topics: tuple[str, ...]) -> Format:
        """Return the same file, of which nothing but these topics is read; with none, those that it chooses itself.

        Nothing is read yet: that a topic is not there, `columns` says.
        """
        ...


def narrow(opened: Format, topics: tuple[str, ...]) -> Format:
    """Return a file of which these topics are read.

    Parameters
    ----------
    opened : Format
    topics : tuple of str
        None of them for a file as it is.

    Returns
    -------
    Format

    Raises
    ------
    DataError
        Topics are given, and files of this format have none.
    """
    if not topics:
        return opened
    if not isinstance(opened, HasTopics):
        raise DataError(f"{opened.file.shown} has no topics, as only ROS bags have: leave out topic=")
    return opened.for_topics(topics)


@runtime_checkable
class ForeseesColumns(Protocol):
    """What a format does too that reads the columns that will be asked for all at once."""

    def for_columns(self, wanted: Columns) -> Format:
        """Return the same file, of which these columns will be read. That some are not there, `columns` says."""
        ...


def foresee(opened: Format, wanted: Columns) -> Format:
    """Return a file that knows which of its columns will be read, where it makes use of that.

    Parameters
    ----------
    opened : Format
    wanted : Columns
        As given.

    Returns
    -------
    Format
    """
    return opened.for_columns(wanted) if isinstance(opened, ForeseesColumns) else opened


def narrow_to_part(opened: Format, part: str | None) -> Format:
    """Return a file of which one part is read.

    Parameters
    ----------
    opened : Format
    part : str or None
        None for a file as it is.

    Returns
    -------
    Format

    Raises
    ------
    DataError
        A part is given, and files of this format have none.
    """
    if part is None:
        return opened
    if not isinstance(opened, HasParts):
        raise DataError(
            f"{opened.file.shown} has no sheets, sections or sets to choose from: leave out part="
        )
    return opened.for_part(part)


@contextmanager
def damage_named(shown: str, kind: str) -> Iterator[None]:
    """Turn whatever a reader stumbles over in a damaged or hostile file into one sentence that names the file."""
    try:
        yield
    except (DataError, GeneratorExit):
        raise
    except (FileNotFoundError, PermissionError) as error:
        raise DataError(f"{shown} cannot be read: {error.strerror or error}") from error
    except (
        Exception
    ) as error:  # readers of foreign files raise anything, RecursionError and MemoryError among them
        raise DataError(f"{shown} is damaged or not {kind}; write it again") from error
