"""Opening ROS bags with `rosbags`: which topics there are, and their messages one by one. No ROS is needed."""

import shutil
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from unconstrain.errors import DataError
from unconstrain.recordings.files import File, Folder, named_errors

METADATA = "metadata.yaml"
"""The file by which a folder is a ROS 2 bag."""

FOLDER_KEY = b"rosbag2_bagfile_information"

MAGIC = {b"#ROSBAG V": ".bag", b"\x89MCAP": ".mcap", b"SQLite format 3": ".db3"}
"""How bags begin, and the suffix by which `rosbags` knows them."""

COMPRESSED = (".zst", ".zstd")
"""What the names of the files of a bag end in besides that are compressed as files."""

RECOVERY = {
    ".bag": "rosbag reindex",
    ".mcap": "mcap recover",
    ".db3": "ros2 bag reindex",
    "": "ros2 bag reindex",
}

HOUSEKEEPING = ("rcl_interfaces", "rosgraph_msgs", "diagnostic_msgs", "lifecycle_msgs", "bond")
"""Packages whose messages are about the program, not about the robot."""

UNMEASURED = ("std_msgs/msg/Header", "builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration")
"""Messages whose numbers say nothing of a movement."""

TRANSFORMS = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")
"""Types whose messages are nothing but lists of transforms, of as many frames."""

TRANSFORM = "geometry_msgs/msg/TransformStamped"

MOVEMENTS = (
    "geometry_msgs/msg/PoseStamped",
    "nav_msgs/msg/Odometry",
    "sensor_msgs/msg/JointState",
    "geometry_msgs/msg/PoseWithCovarianceStamped",
    "geometry_msgs/msg/Pose",
)
"""Types of messages that are made to show a movement."""

Definitions = Mapping[str, tuple[Any, Any]]
"""By message type, its constants and its fields, as `rosbags` has them."""


@dataclass(frozen=True)
class Topic:
    """A topic of a bag.

    Parameters
    ----------
    name : str
    kind : str
        The type of its messages; empty where they are of several types.
    n_messages : int
    has_numbers : bool
        Whether its messages hold numbers other than stamps.
    frame : str
        Of transforms, the child frame to which they are narrowed.
    """

    name: str
    kind: str
    n_messages: int
    has_numbers: bool
    frame: str = ""

    @property
    def may_move(self) -> bool:
        """Whether its messages may show a movement."""
        return self.has_numbers and self.n_messages > 1

    @property
    def rank(self) -> tuple[int, int]:
        """Sort key by which topics that are made to show a movement come first, and then those of many messages."""
        likely = MOVEMENTS.index(self.kind) if self.kind in MOVEMENTS else len(MOVEMENTS)
        return likely, -self.n_messages

    def __str__(self) -> str:
        """Return the topic as a sentence lists it."""
        plural = "" if self.n_messages == 1 else "s"
        return f"{self.name} ({self.kind or 'several types'}, {self.n_messages} message{plural})"


class Bag:
    """A bag that is open; see `opened`.

    Parameters
    ----------
    reader : rosbags.highlevel.AnyReader
        Open.
    """

    def __init__(self, reader: Any) -> None:
        self._reader = reader

    @property
    def definitions(self) -> Definitions:
        """What messages consist of."""
        return self._reader.typestore.fielddefs

    @property
    def defines_messages(self) -> bool:
        """Whether the bag itself says what its messages consist of."""
        return any(connection.msgdef.data for connection in self._reader.connections)

    def topics(self) -> tuple[Topic, ...]:
        """Return the topics that have messages, in the order of their names."""
        return tuple(
            Topic(name, _unpacked(info.msgtype or ""), info.msgcount, self._has_numbers(info.msgtype or ""))
            for name, info in self._reader.topics.items()
            if info.msgcount
        )

    def messages(self, topic: Topic) -> Iterator[tuple[int, Any, int]]:
        """Yield when a message was received (ns), the message, and its size (bytes), in the order of receipt."""
        name = topic.name.partition(":")[0]
        connections = [each for each in self._reader.connections if each.topic == name]
        for connection, received, raw in self._reader.messages(connections):
            message = self._reader.deserialize(raw, connection.msgtype)
            if connection.msgtype not in TRANSFORMS:
                yield received, message, len(raw)
                continue
            for each in message.transforms:
                if topic.frame in ("", each.child_frame_id):
                    yield received, each, len(raw)

    def _has_numbers(self, kind: str) -> bool:
        if kind.split("/")[0] in HOUSEKEEPING:
            return False
        waiting, seen = [kind], set(UNMEASURED)
        while waiting:
            one = waiting.pop()
            if one in seen or one not in self.definitions:
                continue
            seen.add(one)
            for _, (node, detail) in self.definitions[one][1]:
                inner = detail[0] if node.name in ("ARRAY", "SEQUENCE") else (node, detail)
                if inner[0].name == "NAME":
                    waiting.append(inner[1])
                elif "string" not in inner[1][0]:
                    return True
        return False


def _unpacked(kind: str) -> str:
    return TRANSFORM if kind in TRANSFORMS else kind


def is_bag(folder: Folder) -> bool:
    """Whether a folder is a ROS 2 bag."""
    import pyarrow.fs

    about = folder.file(METADATA)
    with named_errors(folder.shown):
        return about.info.type == pyarrow.fs.FileType.File and FOLDER_KEY in about.begin()


def as_file(folder: Folder) -> File:
    """Return the file that stands for a folder that is a bag: its description, under the folder's name."""
    about = folder.file(METADATA)
    return File(folder.shown, about.path, about.filesystem)


def is_bag_file(file: File) -> bool:
    """Whether a file is a bag, or the description of one."""
    if file.path.endswith(METADATA):
        return FOLDER_KEY in file.begin()
    return any(file.magic.startswith(magic) for magic in MAGIC) or _is_compressed(file)


def _is_compressed(file: File) -> bool:
    path = Path(file.path)
    return path.suffix in COMPRESSED and Path(path.stem).suffix in MAGIC.values()


def has_log(file: File) -> bool:
    """Whether the program that wrote a bag was stopped before the database took in all messages."""
    path = Path(file.path)
    logs = path.parent.glob("*.db3-wal") if path.name == METADATA else [Path(f"{path}-wal")]
    return file.local and any(log.is_file() and log.stat().st_size > 0 for log in logs)


@contextmanager
def opened(file: File) -> Iterator[Bag]:
    """Open a bag.

    Parameters
    ----------
    file : File
        A bag, or the `metadata.yaml` of a folder that is one.

    Yields
    ------
    Bag

    Raises
    ------
    DataError
        The package `rosbags` is missing, or the bag is damaged, in whatever way the reader stumbles over it.
    """
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise DataError(
            f"{file.shown} is a ROS bag, and reading it needs the package rosbags, which is not installed: pip install "
            "'unconstrain[ros]'"
        ) from None
    kind = _kind(file)
    try:
        # Bags from before ROS 2 Iron do not say what their messages consist of.
        assumed = get_typestore(Stores.ROS2_HUMBLE)
        with _on_this_machine(file, kind) as path, AnyReader([path], default_typestore=assumed) as reader:
            yield Bag(reader)
    except (DataError, GeneratorExit):
        raise
    except (FileNotFoundError, PermissionError) as error:
        raise DataError(f"{file.shown} cannot be read: {error.strerror or error}") from error
    except Exception as error:  # a reader of foreign files raises anything
        if "Profile is not ros2" in str(error):
            raise DataError(
                f"{file.shown} is an MCAP file, but not of ROS 2, whose messages alone can be read: write it as CSV or "
                "Parquet"
            ) from error
        if kind == ".mcap" and isinstance(error, KeyError):
            raise DataError(
                f"{file.shown} holds messages that are not encoded as those of ROS 2 ({error!s:.40}), which alone are "
                "read: write it as CSV or Parquet"
            ) from error
        reason = " ".join((str(error) or type(error).__name__).split()).rstrip(".")
        raise DataError(
            f"{file.shown} is damaged, cut short or no ROS bag ({reason:.160}): recover it with `{RECOVERY[kind]}`, or "
            "record it again"
        ) from error


def _kind(file: File) -> str:
    """Return the suffix that belongs to the content, or else the one that there is; none for a folder."""
    if file.path.endswith(METADATA):
        return ""
    if _is_compressed(file):
        return Path(Path(file.path).stem).suffix
    own = (suffix for magic, suffix in MAGIC.items() if file.magic.startswith(magic))
    return next(own, file.suffix)


@contextmanager
def _on_this_machine(file: File, suffix: str) -> Iterator[Path]:
    """Give a local path with the suffix by which `rosbags` knows the format."""
    path = Path(file.path)
    if file.local and (not suffix or path.suffix == suffix):
        yield path.parent if not suffix else path
        return
    if not suffix:
        raise DataError(f"{file.shown} is a bag of several files elsewhere: copy the folder to this machine")
    with tempfile.TemporaryDirectory() as folder:
        near = Path(folder) / f"bag{suffix}"
        if file.local and not _is_compressed(file):
            near.symlink_to(path.resolve())
        else:
            with named_errors(file.shown), _content(file) as source, near.open("wb") as copy:
                shutil.copyfileobj(source, copy)
        yield near


@contextmanager
def _content(file: File) -> Iterator[Any]:
    """Open a file, decompressed."""
    import pyarrow as pa

    with file.open() as source:
        if not _is_compressed(file):
            yield source
            return
        with pa.CompressedInputStream(source, "zstd") as unpacked:
            yield unpacked
