"""Bags that tests write."""

from pathlib import Path

import numpy as np

CUSTOM = "float64[3] force\nfloat64 grip\nuint8 mode\nstring label\ngeometry_msgs/Pose pose\n"


def store(version):
    """The types that messages of ROS 1 or 2 are of, with one of our own."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    types = get_typestore(Stores.ROS1_NOETIC if version == 1 else Stores.ROS2_JAZZY)
    types.register(get_types_from_msg(CUSTOM, "lab_msgs/msg/Grasp"))
    return types


class Writing:
    """A bag that is being written, of ROS 1 (`bag`) or ROS 2 (`db3`, `mcap`)."""

    def __init__(self, path, kind):
        from rosbags import rosbag1, rosbag2

        self.version = 1 if kind == "bag" else 2
        self.types = store(self.version)
        self.path = Path(path)
        if self.version == 1:
            self._writer = rosbag1.Writer(self.path)
        else:
            plugin = rosbag2.StoragePlugin.MCAP if kind == "mcap" else rosbag2.StoragePlugin.SQLITE3
            self._writer = rosbag2.Writer(self.path, version=9, storage_plugin=plugin)
        self._connections = {}

    def __enter__(self):
        self._writer.open()
        return self

    def __exit__(self, *_):
        self._writer.close()

    def write(self, topic, kind, received, message):
        """Write a message that was received at a time (s)."""
        if topic not in self._connections:
            self._connections[topic] = self._writer.add_connection(topic, kind, typestore=self.types)
        encode = self.types.serialize_ros1 if self.version == 1 else self.types.serialize_cdr
        self._writer.write(self._connections[topic], round(received * 1e9), encode(message, kind))

    def make(self, kind, **fields):
        """Make a message."""
        return self.types.types[kind](**fields)

    def header(self, stamp, frame="world"):
        ns = round(stamp * 1e9)
        time = self.make("builtin_interfaces/msg/Time", sec=ns // 10**9, nanosec=ns % 10**9)
        first = {"seq": 0} if self.version == 1 else {}
        return self.make("std_msgs/msg/Header", **first, stamp=time, frame_id=frame)

    def point(self, kind, *values):
        return self.make(f"geometry_msgs/msg/{kind}", **dict(zip("xyzw", map(float, values), strict=False)))

    def pose(self, position, rotation=(0, 0, 0, 1)):
        return self.make(
            "geometry_msgs/msg/Pose",
            position=self.point("Point", *position),
            orientation=self.point("Quaternion", *rotation),
        )

    def stamped_pose(self, topic, stamp, position, rotation=(0, 0, 0, 1), received=None):
        kind = "geometry_msgs/msg/PoseStamped"
        message = self.make(kind, header=self.header(stamp), pose=self.pose(position, rotation))
        self.write(topic, kind, stamp + 0.01 if received is None else received, message)

    def joints(self, topic, stamp, names, positions, received=None):
        kind = "sensor_msgs/msg/JointState"
        message = self.make(
            kind,
            header=self.header(stamp),
            name=list(names),
            position=np.array(positions, dtype=np.float64),
            velocity=np.zeros(0),
            effort=np.zeros(0),
        )
        self.write(topic, kind, stamp if received is None else received, message)

    def grasp(self, topic, received, force, grip, mode=0, label="", position=(0, 0, 0)):
        kind = "lab_msgs/msg/Grasp"
        message = self.make(
            kind,
            force=np.array(force, float),
            grip=float(grip),
            mode=mode,
            label=label,
            pose=self.pose(position),
        )
        self.write(topic, kind, received, message)

    def transforms(self, topic, stamp, **frames):
        each = [
            self.make(
                "geometry_msgs/msg/TransformStamped",
                header=self.header(stamp),
                child_frame_id=frame,
                transform=self.make(
                    "geometry_msgs/msg/Transform",
                    translation=self.point("Vector3", *position),
                    rotation=self.point("Quaternion", 0, 0, 0, 1),
                ),
            )
            for frame, position in frames.items()
        ]
        kind = "tf2_msgs/msg/TFMessage"
        self.write(topic, kind, stamp, self.make(kind, transforms=each))
