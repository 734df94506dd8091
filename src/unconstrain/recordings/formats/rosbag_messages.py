"""The messages of a topic as a table: one row a message, and columns that are called by their path in it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.errors import DataError
from unconstrain.memory import check_memory
from unconstrain.recordings.formats.rosbag_reading import TRANSFORM, Bag, Definitions, Topic

Nanoseconds = NDArray[np.int64]

LONGEST = 100
"""Numbers in an array that are columns; a longer one is an image or a scan."""

MOST_PARTS = 32
"""Messages in a list within a message whose fields are columns."""

BATCH_MESSAGES, BATCH_BYTES = 8192, 2**26
"""How many messages are unfolded together, at most."""

MOST_LATE = 20
"""Places by which messages that arrive in another order than they were sent are apart, at most."""

STAMPS = ("header.stamp", "stamp")
"""Where a message may say when it was measured."""

NAMES = ("name", "joint_names")
"""Fields that name the components of the arrays beside them, as in sensor_msgs/JointState."""

QUATERNION = "geometry_msgs/msg/Quaternion"


@dataclass(frozen=True)
class Values:
    """A field of all messages.

    Parameters
    ----------
    values : ndarray of shape (N,) or (N, k)
        Numbers, truth values, or text.
    names : tuple of str
        Of the k components, where the messages name them.
    by_nearest : bool
        Whether values between two messages are those of the nearest: of text, whole numbers and quaternions.
    """

    values: NDArray[Any]
    names: tuple[str, ...] = ()
    by_nearest: bool = False


@dataclass(frozen=True)
class TopicTable:
    """The messages of a topic, in the order in which they were received.

    Parameters
    ----------
    topic : Topic
    received : ndarray of shape (N,)
        When (ns).
    stamps : ndarray of shape (N,) or None
        When the message says that it was measured (ns); None where messages do not say it.
    fields : dict of str to Values
        By path.
    unusable : dict of str to str
        Of the paths that are no columns, why.
    notes : tuple of str
    """

    topic: Topic
    received: Nanoseconds
    stamps: Nanoseconds | None
    fields: dict[str, Values]
    unusable: dict[str, str]
    notes: tuple[str, ...] = ()
    unstamped: int = field(default=0)
    """How many messages do not say when they were measured."""


def read_topic(bag: Bag, topic: Topic, shown: str) -> TopicTable:
    """Read all messages of a topic.

    Parameters
    ----------
    bag : Bag
    topic : Topic
    shown : str
        The bag, as the user calls it.

    Returns
    -------
    TopicTable

    Raises
    ------
    DataError
        Messages are of several types or of an unknown one, or do not fit into memory.
    """
    if not topic.kind:
        raise DataError(f"{shown}: topic {topic.name} holds messages of several types; choose another topic")
    if topic.kind not in bag.definitions:
        raise DataError(
            f"{shown} does not say what messages of type {topic.kind} consist of: convert it with ROS 2 Iron or newer, "
            "or choose another topic"
        )
    unfold = Unfolding(bag.definitions)
    received: list[int] = []
    parts: list[dict[str, Values | str]] = []
    for some, messages in _batches(bag, topic):
        received += some
        parts.append(dict(unfold.fields(messages, topic.kind)))
        if len(parts) == 1:
            size = sum(part.values.nbytes for part in parts[0].values() if isinstance(part, Values))
            needed = size / len(messages) * max(topic.n_messages - len(messages), 0)
            check_memory(needed, f"reading {topic.name} of {shown}", "cut the bag into several")
    if not received:
        lack = f"no transforms of the frame {topic.frame!r}" if topic.frame else "no messages"
        raise DataError(f"{shown}: topic {topic.name} holds {lack}; choose another")
    fields: dict[str, Values] = {}
    unusable: dict[str, str] = {}
    for path in dict.fromkeys(path for part in parts for path in part):
        joined = _join([part.get(path, VARIES) for part in parts])
        if isinstance(joined, Values):
            fields[path] = joined
        else:
            unusable[path] = joined
    stamps, unstamped = _stamps(fields, len(received))
    notes = [
        f"{path} of {topic.name} comes in several orders, and its components are put into the first"
        for path in sorted(unfold.reordered)
    ]
    if len(received) != topic.n_messages and topic.kind != TRANSFORM:
        notes.append(
            f"{topic.name} holds {len(received)} messages where the bag's index says {topic.n_messages}"
        )
    table = TopicTable(
        topic, np.array(received, dtype=np.int64), stamps, fields, unusable, tuple(notes), unstamped
    )
    return _in_order(table)


def _in_order(table: TopicTable) -> TopicTable:
    """Put messages that arrived a little late into the order of their stamps; where a clock was set back, none."""
    stamps = table.stamps
    if stamps is None or np.all(np.diff(stamps) >= 0):
        return table
    order = np.argsort(stamps, kind="stable")
    if np.max(np.abs(order - np.arange(len(order)))) > MOST_LATE:
        return table
    fields = {path: replace(each, values=each.values[order]) for path, each in table.fields.items()}
    moved = int(np.sum(np.diff(stamps) < 0))
    note = (
        f"{moved} message{'' if moved == 1 else 's'} of {table.topic.name} came after later ones and are put into "
        "the order of their stamps"
    )
    return replace(
        table, received=table.received[order], stamps=stamps[order], fields=fields, notes=(*table.notes, note)
    )


VARIES = "holds another number of values in some messages than in others"


class Unfolding:
    """Takes messages apart, some at a time; names of components are ordered as in the first message.

    Parameters
    ----------
    definitions : mapping
        As `Bag.definitions`.
    """

    def __init__(self, definitions: Definitions) -> None:
        self.reordered: set[str] = set()
        self._definitions = definitions
        self._named: dict[str, tuple[str, ...]] = {}

    def fields(
        self, messages: Sequence[Any], kind: str, prefix: str = ""
    ) -> Iterator[tuple[str, "Values | str"]]:
        """Yield the path and the values of each field, or why it is no column.

        Parameters
        ----------
        messages : sequence of N messages
            All of one type.
        kind : str
            Their type.
        prefix : str
            Of the paths.

        Yields
        ------
        path : str
        Values or str
        """
        names, orders, mixed = self._names(messages, kind, prefix)
        for name, (node, detail) in self._definitions[kind][1]:
            path = f"{prefix}{name}"
            values = [getattr(message, name) for message in messages]
            if node.name == "BASE":
                yield path, _scalars(values, kind == QUATERNION)
                continue
            if node.name == "NAME":
                yield from self.fields(values, detail, f"{path}.")
                continue
            (inner, of), _ = detail
            lengths = {len(each) for each in values}
            width = lengths.pop()
            if lengths:
                yield path, VARIES
            elif not width:
                yield path, "is empty"
            elif inner.name == "NAME" and width <= MOST_PARTS:
                for i in range(width):
                    yield from self.fields([each[i] for each in values], of, f"{path}[{i}].")
            elif inner.name == "NAME" or width > LONGEST:
                yield path, f"holds {width} values in each message"
            elif "string" in of[0]:
                yield path, "holds lists of text"
            elif mixed:
                yield path, f"belongs to other {mixed} in some messages than in others"
            else:
                array = np.array([np.asarray(each) for each in values])
                fits = len(names) == width
                if fits and orders is not None:
                    array = np.take_along_axis(array, orders, axis=1)
                yield path, Values(array, names if fits else (), array.dtype.kind != "f")

    def _names(
        self, messages: Sequence[Any], kind: str, prefix: str
    ) -> tuple[tuple[str, ...], NDArray[np.int64] | None, str]:
        """Return the names of components, where each is in each message (N, k), and the field if these differ."""
        for name, (node, detail) in self._definitions[kind][1]:
            if name not in NAMES or node.name not in ("ARRAY", "SEQUENCE") or "string" not in detail[0][1][0]:
                continue
            every = [tuple(getattr(message, name)) for message in messages]
            first = self._named.setdefault(f"{prefix}{name}", every[0])
            if len(set(first)) < len(first):
                return (), None, ""
            distinct = set(every)
            if distinct == {first}:
                return first, None, ""
            if any(len(each) != len(first) or set(each) != set(first) for each in distinct):
                return (), None, name
            self.reordered.add(f"{prefix}{name}")
            where = {each: [each.index(one) for one in first] for each in distinct}
            return first, np.array([where[each] for each in every]), ""
        return (), None, ""


def _batches(bag: Bag, topic: Topic) -> Iterator[tuple[list[int], list[Any]]]:
    times: list[int] = []
    messages: list[Any] = []
    size = 0
    for received, message, n_bytes in bag.messages(topic):
        times.append(received)
        messages.append(message)
        size += n_bytes
        if len(messages) >= BATCH_MESSAGES or size >= BATCH_BYTES:
            yield times, messages
            times, messages, size = [], [], 0
    if messages:
        yield times, messages


def _scalars(values: list[Any], is_quaternion: bool) -> Values:
    if isinstance(values[0], str):
        text = np.empty(len(values), dtype=object)
        text[:] = values
        return Values(text, by_nearest=True)
    array = np.asarray(values)
    return Values(array, by_nearest=is_quaternion or array.dtype.kind != "f")


def _join(parts: Sequence[Values | str]) -> Values | str:
    reasons = [part for part in parts if isinstance(part, str)]
    if reasons:
        return reasons[0] if len(set(map(str, reasons))) == 1 else VARIES
    own = [part for part in parts if isinstance(part, Values)]
    if len({(part.values.shape[1:], part.names) for part in own}) > 1:
        return VARIES
    return own[0] if len(own) == 1 else replace(own[0], values=np.concatenate([part.values for part in own]))


def _stamps(fields: dict[str, Values], n_messages: int) -> tuple[Nanoseconds | None, int]:
    """Return the stamps that messages carry, if all do and they advance; and how many do not."""
    path = next((path for path in STAMPS if f"{path}.sec" in fields and f"{path}.nanosec" in fields), None)
    if path is None:
        return None, n_messages
    seconds, rest = (fields[f"{path}.{part}"].values.astype(np.int64) for part in ("sec", "nanosec"))
    stamps = seconds * 10**9 + rest
    missing = int(np.sum(stamps == 0))
    if not missing and len(stamps) > 1 and np.all(stamps == stamps[0]):
        missing = len(stamps)
    return (None if missing else stamps), missing
