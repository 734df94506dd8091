"""Which column of a recording is what."""

from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Integral

from unconstrain.errors import DataError, show

Key = str | int
"""A column's name, or its position counted from 0; a number that is a column's name means that column."""

Keys = Key | Sequence[Key]

DIFFERENTIATE = "differentiate"
"""What `action` is where the actions are the derivative of the states."""

NO_ANGLE = "none"
"""What `angle` is where no column is to be taken for an angle, and `rotation` where none is for a rotation."""


START, GOAL = "start", "goal"
"""What `relative_to` may be besides columns: the first and the last sample of each episode."""


@dataclass(frozen=True)
class Columns:
    """The roles that columns of a recording play, by name or by position.

    A column of lists, or an array of several columns, stands for all its components, of which `name[3]` is one. The
    beginning of names up to a point stands for all of them: `hand` for `hand.X`, `hand.Y` and `hand.Z`.

    Parameters
    ----------
    state : column, or list of columns
        The states x. Files written by this package, and LeRobot datasets, know theirs.
    action : column, or list of columns
        The actions u, or "differentiate". Without it the states are differentiated, which needs `time`.
    time : column
        The time of each sample: seconds, or another unit (see `time_unit`), or timestamps. It increases strictly within
        an episode.
    episode : column
        Its values, of any type, tell episodes apart. Without it every file is an episode.
    force : column, or list of columns
        The contact force, one column for each action, in any unit; see `force_threshold`.
    free : column
        1 where nothing constrained the motion, else 0.
    projections : column, or list of columns
        The nullspace projection of each sample: one column of lists of d² numbers, row by row, or d² columns. Empty or
        NaN where it is not known.
    relative_to : "start", "goal", or list of columns
        What states are relative to: where each episode starts, or ends; or as many columns as there are states, such as
        an object's position. Given actions are made relative to columns that move as well, which needs `time`. Poses
        are expressed in the frame of others; positions x, y, z too, where the position and the quaternion of a frame
        are given.
    angle : column, or list of columns
        The states that are angles, in radians or degrees, the same after a turn. Turns are counted on where they wrap.
        By default angles are recognised by their jumps; "none" takes all as they are.
    rotation : list of columns
        The states that are rotations: four columns of a quaternion, three of a rotation vector or of roll, pitch and
        yaw, or nine of a matrix, row by row; several rotations one after the other. Names tell which part of a
        quaternion is which; where they do not, list them in the order x, y, z, w. Actions are angular velocities then,
        in radians a second. With x, y and z before it, a rotation is a pose.
    topic : str, or list of str
        For ROS bags: the topic whose messages are the samples, and whose fields are the columns. With several, columns
        are called `/topic/field`, and the others are aligned to the stamps of the first. By default the only topic with
        numbers.
    part : str, optional
        Which sheet, section or set of a file is read, where it holds several: the name of a sheet, the title of a
        section, or the path of a group in an HDF5, MATLAB or NPZ file, or its end. By default the largest set of
        demonstrations.

    Raises
    ------
    DataError
        `projections` is given together with `force` or `free`, other columns without `state`, or something in place of
        columns that is none.
    """

    state: Keys | None = None
    action: Keys | None = None
    time: Key | None = None
    episode: Key | None = None
    force: Keys | None = None
    free: Key | None = None
    projections: Keys | None = None
    relative_to: Keys | None = None
    angle: Keys | None = None
    rotation: Keys | None = None
    topic: str | Sequence[str] | None = None
    part: str | None = None

    def __post_init__(self) -> None:
        for name in ("state", "action", "force", "projections", "relative_to", "angle", "rotation"):
            keys = getattr(self, name)
            if isinstance(keys, str | int | list | tuple | None):
                continue
            try:  # NumPy's numbers and arrays, whose comparison with other columns is no truth value
                plain = int(keys) if isinstance(keys, Integral) else list(keys)
            except TypeError:
                raise DataError(
                    f"{name} takes column names or positions counted from 0, got {show(keys)}"
                ) from None
            object.__setattr__(self, name, plain)
        if self.relative_to in ([START], [GOAL]):  # as the command line gives them
            object.__setattr__(self, "relative_to", self.relative_to[0])
        for name in ("time", "episode", "free"):
            key = getattr(self, name)
            if not isinstance(key, str | Integral | None):
                raise DataError(f"{name} takes a column's name or position counted from 0, got {show(key)}")
        topics = [] if self.topic is None else list(self.topics)
        if self.topic is not None and not (topics and all(isinstance(each, str) and each for each in topics)):
            raise DataError(f"topic takes the name of a topic or a list of them, got {show(self.topic)}")
        if self.part is not None and not (isinstance(self.part, str) and self.part.strip()):
            raise DataError(
                f"part takes the name of a sheet, section or set of a file, got {self.part!r:.60}"
            )
        if self.projections is not None and not (self.force is self.free is None):
            other = "force" if self.force is not None else "free"
            raise DataError(
                f"projections= and {other}= both say what the constraints are: leave out one of them"
            )

    @property
    def topics(self) -> tuple[str, ...]:
        """The topics, none where they are not given."""
        if self.topic is None:
            return ()
        return (self.topic,) if isinstance(self.topic, str) else tuple(self.topic)

    @property
    def read(self) -> dict[str, Keys]:
        """What is read of files, by role; nothing without states. Angles and rotations are states."""
        every: dict[str, Keys | None] = {
            "state": self.state,
            "action": None if self.differentiated else self.action,
            "time": self.time,
            "episode": self.episode,
            "force": self.force,
            "free": self.free,
            "projections": self.projections,
            "relative_to": None if self.relative_to in (START, GOAL) else self.relative_to,
        }
        return {} if self.state is None else {role: keys for role, keys in every.items() if keys is not None}

    @property
    def differentiated(self) -> bool:
        """Whether the actions are the derivative of the states."""
        return self.action is None or self.action == DIFFERENTIATE
