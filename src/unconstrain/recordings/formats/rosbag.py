"""ROS bags: ROS 1 (`.bag`), ROS 2 (`.db3`, `.mcap`, and folders of them with `metadata.yaml`).

A topic is a table: one row a message, columns that are called by their path in it, such as `pose.pose.position.x`.
Of transforms (`/tf`) each is a row, and `/tf:base_link` is the table of those of one frame.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from unconstrain.errors import DataError, printable
from unconstrain.recordings.columns import Columns
from unconstrain.recordings.files import File
from unconstrain.recordings.formats import rosbag_reading
from unconstrain.recordings.formats.arrays import to_arrow
from unconstrain.recordings.formats.base import GUESS, ColumnKey, Declared
from unconstrain.recordings.formats.rosbag_alignment import align
from unconstrain.recordings.formats.rosbag_messages import Nanoseconds, TopicTable, Values, read_topic
from unconstrain.recordings.formats.rosbag_reading import TRANSFORM, Bag, Topic
from unconstrain.recordings.formats.rosbag_remarks import CHILD, RECEIVED, STAMP, Remark, on_frames, on_time
from unconstrain.recordings.table import Column, Header

OWN = "message."
"""What goes before a message's own field that is called like one of these."""

MOST_LISTED = 20


@dataclass(frozen=True)
class Table:
    """What is read of a bag.

    Parameters
    ----------
    topic : str
        The one whose messages are the rows.
    rows : ndarray of shape (N,)
        Which messages they are.
    times : dict of str to ndarray of shape (N,)
        `STAMP` and `RECEIVED` (ns).
    fields : dict of str to Values
    unusable : dict of str to str
    remarks : tuple of Remark
    frames : sequence of str
        Of each row, where the rows are transforms of several frames.
    """

    topic: str
    rows: NDArray[np.int64]
    times: dict[str, Nanoseconds]
    fields: dict[str, Values]
    unusable: dict[str, str]
    remarks: tuple[Remark, ...]
    frames: Sequence[str] = ()


class RosBag:
    """A bag, of which one topic is read, or several that are aligned.

    Parameters
    ----------
    file : File
        A bag, or the `metadata.yaml` of a folder that is one.
    topics : tuple of str
        Those to be read; by default the only one with numbers.
    """

    suffixes: ClassVar[tuple[str, ...]] = (".bag", ".mcap", ".db3")
    at_once: ClassVar[bool] = True

    def __init__(self, file: File, topics: tuple[str, ...] = ()) -> None:
        self.file = file
        self.topics = topics

    def __getstate__(self) -> dict[str, Any]:
        """Leave the messages behind when the file is sent to another process, which reads them itself."""
        return {name: value for name, value in vars(self).items() if name != "_table"}

    @classmethod
    def matches(cls, file: File) -> bool:
        """Whether the content is of this format, as its first bytes tell."""
        return rosbag_reading.is_bag_file(file)

    def topics_of_movement(self) -> tuple[str, ...]:
        """Return the topics that may hold a movement: those of poses and joints first, then by number of messages."""
        with rosbag_reading.opened(self.file) as bag:
            topics = [topic for topic in bag.topics() if topic.may_move]
        return tuple(topic.name for topic in sorted(topics, key=lambda topic: topic.rank))

    def for_topics(self, topics: tuple[str, ...]) -> "RosBag":
        """Return the same bag, of which these topics are read."""
        return RosBag(self.file, topics)

    def columns(self) -> Header:
        """Return the times, and the fields of messages."""
        table = self._table
        lists: dict[str, tuple[pa.DataType, int | None]] = {}
        n_rows = len(table.rows)
        columns = [Column(name, pa.duration("ns"), n_rows) for name in table.times]
        arrays = []
        for path, each in table.fields.items():
            kind = pa.string() if each.values.dtype == object else pa.from_numpy_dtype(each.values.dtype)
            if each.values.ndim == 1:
                columns.append(Column(path, kind, n_rows))
                continue
            width = each.values.shape[1]
            lists[path] = pa.list_(kind, width), n_rows
            names = [f"{path}.{name}" for name in each.names] or [f"{path}[{i}]" for i in range(width)]
            arrays += [Column(name, kind, n_rows, 0, path, i, width) for i, name in enumerate(names)]
        # Covariances would hide what comes after them from the reader of a sentence that lists columns.
        return Header(self.file.shown, [*columns, *arrays], lists, table.unusable)

    def declared(self) -> Declared | None:
        """Return the column of time."""
        return Declared(Columns(time=next(iter(self._table.times))))

    @property
    def row_groups(self) -> tuple[int, ...]:
        """The number of messages."""
        return (len(self._table.rows),)

    def read(
        self, columns: Sequence[ColumnKey], start: int = 0, stop: int | None = None
    ) -> Iterator[tuple[int, pa.RecordBatch]]:
        """Read messages as one piece, with its first row."""
        table = self._table
        names = [name for name, _ in columns]
        missing = [name for name in names if name not in table.times and name not in table.fields]
        if missing:
            raise DataError(
                f"{self.file.shown} has no column {missing[0]!r}, but other files of the recording have it; leave the "
                "file out, or choose other columns"
            )
        values = [
            pa.array(table.times[name][start:stop], pa.duration("ns"))
            if name in table.times
            else to_arrow(table.fields[name].values[start:stop])
            for name in names
        ]
        # Names of frames are a stranger's: no end of a line or escape sequence stays in a note.
        guesses = [printable(remark.text) for remark in table.remarks if remark.is_due(names)]
        rows = pa.RecordBatch.from_arrays(values, names=names)
        yield start, rows.replace_schema_metadata({GUESS: "\n".join(guesses).encode()}) if guesses else rows

    def place(self, index: int) -> str:
        """Say which message a row is."""
        table = self._table
        number = table.rows[index]
        if not table.frames:
            return f"message {number} of {table.topic} (counted from 0)"
        return f"transform {number} of {table.topic} (counted from 0; {table.topic}:{table.frames[index]} is one frame)"

    def in_one_thread(self) -> "RosBag":
        """Return the same bag."""
        return self

    def identity(self) -> str:
        """Say what tells the bag and the topics from others."""
        return repr((self.file.identity(), self.topics))

    @cached_property
    def _table(self) -> Table:
        with rosbag_reading.opened(self.file) as bag:
            topics, notes = self._choose(bag)
            tables = [read_topic(bag, topic, self.file.shown) for topic in topics]
            if not bag.defines_messages:
                notes.append("the bag does not define its messages, which are read as those of ROS 2 Humble")
        if rosbag_reading.has_log(self.file):
            notes.append(
                "messages in the database's log beside the bag (-wal) are not read; open it with sqlite3 once, which "
                "takes them in"
            )
        notes += [note for table in tables for note in table.notes]
        stamped = all(table.stamps is not None for table in tables)
        clocks = [_clock(table, stamped) for table in tables]
        first = tables[0]
        times = {STAMP: clocks[0]} if stamped else {}
        times[RECEIVED] = first.received
        rows = np.arange(len(first.received))
        fields, unusable = first.fields, first.unusable
        if len(tables) > 1:
            aligned = align(tables, clocks, self.file.shown)
            rows, fields = aligned.rows, aligned.fields
            notes += aligned.notes
            times = {name: each[rows] for name, each in times.items()}
            unusable = {
                f"{table.topic.name}/{path}": why for table in tables for path, why in table.unusable.items()
            }
        fields = {f"{OWN}{path}" if path in times else path: each for path, each in fields.items()}
        mixed = first.topic.kind == TRANSFORM and len(set(first.fields[CHILD].values.tolist())) > 1
        frames = first.fields[CHILD].values[rows].tolist() if mixed else ()
        remarks = [Remark(note) for note in notes]
        for table in tables:
            remarks += on_frames(table, f"{table.topic.name}/" if len(tables) > 1 else "")
        remarks += on_time(tables)
        return Table(first.topic.name, rows, times, fields, unusable, tuple(remarks), frames)

    def _choose(self, bag: Bag) -> tuple[list[Topic], list[str]]:
        """Return the topics to be read, and what was guessed."""
        shown, every = self.file.shown, {topic.name: topic for topic in bag.topics()}
        if not every:
            raise DataError(f"{shown} is empty: there are no messages in it")
        listing = ", ".join(map(str, list(every.values())[:MOST_LISTED]))
        more = len(every) - MOST_LISTED
        listing += f" and {more} more" if more > 0 else ""
        if not self.topics:
            measured = [topic for topic in every.values() if topic.may_move]
            if len(measured) != 1:
                which = "none of its topics has two messages with numbers" if not measured else "give topic="
                rest = "its topics are" if not measured else "the topic or topics to read; there are"
                raise DataError(f"{shown}: {which}, {rest} {listing}")
            note = f"topic {measured[0].name} is read, the only one with numbers; topic= names another"
            return measured, [note]
        chosen = []
        for name in dict.fromkeys(self.topics):
            whole, _, frame = name.partition(":")
            if whole in every and every[whole].kind == TRANSFORM and frame:
                chosen.append(replace(every[whole], name=name, frame=frame))
            elif name in every:
                chosen.append(every[name])
            else:
                close = get_close_matches(name, list(every), n=1)
                hint = f" (did you mean {close[0]!r}?)" if close else ""
                raise DataError(f"{shown} has no topic {name!r} with messages{hint}; there are {listing}")
        return chosen, []


def _clock(table: TopicTable, stamped: bool) -> Nanoseconds:
    if not stamped:
        return table.received
    assert table.stamps is not None
    return table.stamps
