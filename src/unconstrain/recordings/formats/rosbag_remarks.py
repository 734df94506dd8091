"""What is to be known of columns of a bag: which time it is, how often messages came, and in which frame they are."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from unconstrain.recordings.formats.rosbag_messages import Nanoseconds, TopicTable
from unconstrain.recordings.formats.rosbag_reading import TRANSFORM

STAMP, RECEIVED = "stamp", "receive_time"
"""The columns of time that every table has; of these, `stamp` only where messages carry stamps."""

BURST = 0.2
"""A message that follows another within this share of the typical step came in a burst."""

FEWEST_IN_BURSTS = 3

CHILD = "child_frame_id"

FRAMES = ("frame_id", CHILD)

MOST_FRAMES = 6

ODOMETRY = "nav_msgs/msg/Odometry"


@dataclass(frozen=True)
class Remark:
    """A sentence on columns.

    Parameters
    ----------
    text : str
    about : tuple of str
        How the columns begin that it is about: it is due where of each of these one is read. None for all.
    """

    text: str
    about: tuple[str, ...] = ()

    def is_due(self, columns: Sequence[str]) -> bool:
        """Whether it is due where these columns are read."""
        return all(any(name.startswith(start) for name in columns) for start in self.about)


def on_frames(table: TopicTable, prefix: str) -> Iterator[Remark]:
    """Say where numbers of a topic are of several frames.

    Parameters
    ----------
    table : TopicTable
    prefix : str
        Of its columns.

    Yields
    ------
    Remark
    """
    name, transforms = table.topic.name, table.topic.kind == TRANSFORM
    for path, each in table.fields.items():
        if path.split(".")[-1] not in FRAMES or (transforms and path != CHILD):
            continue
        frames = sorted(set(each.values.tolist()))
        if len(frames) > 1:
            shown = ", ".join(frames[:MOST_FRAMES]) + (", ..." if len(frames) > MOST_FRAMES else "")
            one = f"topic={name}:{frames[0]} reads one of them, or " if transforms else ""
            yield Remark(
                f"{path} of {name} changes ({shown}), so its numbers are of several frames; "
                f"{one}episode={prefix}{path} tells them apart"
            )
    if table.topic.kind == ODOMETRY:
        yield Remark(
            f"the velocities in {name} are along the axes of the moving {_first(table, CHILD)}, and the positions are "
            f"in {_first(table, 'header.frame_id')}; action=differentiate has both in the same frame",
            (f"{prefix}pose.pose.position", f"{prefix}twist.twist.linear"),
        )


def on_time(tables: Sequence[TopicTable]) -> list[Remark]:
    """Say what the columns of time are, and at which rate messages came.

    Parameters
    ----------
    tables : sequence of TopicTable
        The first is the one whose times are the columns.

    Returns
    -------
    list of Remark
    """
    first = tables[0]
    stamps, received = first.stamps, first.received
    bare = next((table for table in tables if table.stamps is None), None)
    reference = received if bare is not None or stamps is None else stamps
    bursts = _in_bursts(received, reference)
    uneven = f"{bursts} of {len(received)} messages came right after the one before, in bursts"
    received_at = f"receive_time, when messages were received{_rate(received)}"
    if bare is not None or stamps is None:
        assert bare is not None
        n, of = bare.unstamped, len(bare.received)
        lack = "no message" if n == of else f"{n} of {of} messages"
        carry = "carries a stamp that advances" if n == of else "carry no stamp"
        doubt = f"; {uneven}, so derivatives are not to be trusted" if bursts else ""
        text = f"time is {received_at}, since {lack} of {bare.topic.name} {carry}; time= names another column{doubt}"
        return [Remark(text, (RECEIVED,))]
    if _in_bursts(stamps, stamps) >= bursts:
        bursts = 0
    taken = f"time is the stamps in the messages{_rate(stamps)}"
    if not bursts:
        return [Remark(f"{taken}; time=receive_time takes when they were received", (STAMP,))]
    return [
        Remark(f"{taken}, not when they were received (time=receive_time): {uneven}", (STAMP,)),
        Remark(f"time is {received_at}: {uneven}; time=stamp takes the stamps in the messages", (RECEIVED,)),
    ]


def _first(table: TopicTable, path: str) -> str:
    return str(table.fields[path].values[0]) if path in table.fields else "frame"


def _rate(times: Nanoseconds) -> str:
    step = float(np.median(np.diff(times))) if len(times) > 1 else 0.0
    return f" ({1e9 / step:.4g} a second)" if step > 0 else ""


def _in_bursts(times: Nanoseconds, reference: Nanoseconds) -> int:
    """Count the messages that follow another within a small share of the typical step."""
    if len(times) < 2:
        return 0
    short = int(np.sum(np.diff(times) < BURST * np.median(np.diff(reference))))
    return short if short >= FEWEST_IN_BURSTS else 0
