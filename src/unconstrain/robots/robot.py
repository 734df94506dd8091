"""Any fixed-base robot from its MJCF or URDF file: joints, limits, poses and Jacobians, by MuJoCo."""

import copy
import os
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping
from functools import cached_property
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from unconstrain.errors import DataError, UnconstrainError

if TYPE_CHECKING:
    import mujoco

Array = NDArray[np.float64]

MESHES = (".stl", ".obj", ".msh")
"""What MuJoCo reads; URDF files often show robots in .dae, which it does not."""


class RobotError(UnconstrainError):
    """A robot file that cannot be used, or a name that is not in it."""


def simulator() -> ModuleType:
    """The package `mujoco`, imported when first needed. Raises `UnconstrainError` where it is not installed."""
    try:
        import mujoco
        import mujoco.batch
    except ImportError as error:
        raise UnconstrainError(
            f"robots are simulated by MuJoCo, which cannot be imported here ({error}): "
            "pip install 'unconstrain[sim]'"
        ) from error
    except Exception as error:  # MuJoCo looks for OpenGL while it is imported, and how that fails differs
        raise UnconstrainError(
            f"MuJoCo cannot be imported with MUJOCO_GL={os.environ.get('MUJOCO_GL')} ({error}): unset it, or "
            "install the OpenGL that it names"
        ) from error
    return mujoco


class Robot:
    """A robot whose base stands still and whose joints each have one degree of freedom.

    Parameters
    ----------
    spec : mujoco.MjSpec
        What to simulate; `Robot.load` reads one from a file. It is copied.
    lock : names, or mapping from name to position
        Joints that shall not move: held at 0, or at the given position (radians or metres). A robot on a
        floating base is fixed by locking its free joint.
    notes : sequence of str
        What was left out in reading, a sentence each.

    Attributes
    ----------
    model : mujoco.MjModel
    spec : mujoco.MjSpec
        What the model was compiled from, joints locked: copy it to add tables and balls.
    joints : tuple of str
        Names of the n joints that move, in the order of the columns of Q.
    limits : array (n, 2)
        Lower and upper, in radians or metres; infinite where the file gives none.
    notes : tuple of str

    Raises
    ------
    RobotError
        A locked joint is not there, a joint has several degrees of freedom, or nothing is left to move.

    Examples
    --------
    >>> arm = Robot.load("panda.urdf", lock=["finger_joint1", "finger_joint2"])      # doctest: +SKIP
    >>> arm.jacobian(Q, "panda_hand_tcp")                                              # doctest: +SKIP
    """

    model: "mujoco.MjModel"
    spec: "mujoco.MjSpec"

    def __init__(
        self,
        spec: "mujoco.MjSpec",
        lock: Iterable[str] | Mapping[str, float] = (),
        notes: Iterable[str] = (),
    ):
        mujoco = simulator()
        self.spec = spec.copy()
        self.notes = tuple(notes)
        locked = dict(lock) if isinstance(lock, Mapping) else dict.fromkeys(_names(lock), 0.0)
        for name, position in locked.items():
            _lock(self.spec, name, position)
        try:
            self.model = self.spec.compile()
        except ValueError as error:
            raise RobotError(f"MuJoCo cannot simulate this robot: {_one_line(error)}") from error
        scalar = [int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)]
        for joint in map(self.model.joint, range(self.model.njnt)):
            if self.model.jnt_type[joint.id] not in scalar:
                raise RobotError(
                    f"joint {joint.name!r} has several degrees of freedom, and a fixed-base robot has one per "
                    f'joint: lock it, lock=["{joint.name}"]'
                )
        if not self.model.njnt:
            raise RobotError("this robot has no joint that moves: lock fewer, or load another file")
        self.joints = tuple(self.model.joint(i).name for i in range(self.model.njnt))
        limited = self.model.jnt_limited.astype(bool)[:, None]
        self.limits = np.where(limited, self.model.jnt_range, [-np.inf, np.inf])

    @classmethod
    def load(
        cls,
        path: str | os.PathLike[str],
        lock: Iterable[str] | Mapping[str, float] = (),
        package_dirs: Iterable[str | os.PathLike[str]] = (),
    ) -> "Robot":
        """Read a robot from an MJCF (.xml) or URDF (.urdf) file.

        Frames that are fixed to one another keep their names. A mesh named ``package://name/rest`` is looked
        for in `package_dirs` (folders that hold packages, or are one), then in the folders above the file. A
        URDF's meshes that are missing or of a kind MuJoCo does not read are left out and said so in `notes`:
        they change neither kinematics nor inertias.

        Raises
        ------
        RobotError
            The file is missing or not a robot, and as for `Robot`.
        """
        mujoco = simulator()
        path = Path(path)
        if not path.is_file():
            raise RobotError(f"there is no robot file {str(path)!r}: give the path of an MJCF or URDF file")
        try:
            root = ET.parse(path).getroot()
        except (ET.ParseError, UnicodeDecodeError) as error:
            raise RobotError(
                f"{path.name} is not an XML file ({_one_line(error)}): give MJCF or URDF"
            ) from None
        if root.tag not in ("mujoco", "robot"):
            raise RobotError(
                f"{path.name} is neither an MJCF nor a URDF file: its outermost element is <{root.tag}>, "
                "not <mujoco> or <robot>"
            )
        if root.tag == "mujoco":
            try:
                return cls(mujoco.MjSpec.from_file(str(path)), lock)
            except RobotError as error:
                raise RobotError(f"{path.name}: {error}") from error
            except ValueError as error:
                raise RobotError(f"MuJoCo cannot read {path.name}: {_one_line(error)}") from error
        return _from_urdf(cls, path, root, lock, [Path(directory) for directory in package_dirs])

    @property
    def n(self) -> int:
        """The number of joints that move."""
        return len(self.joints)

    @property
    def frames(self) -> tuple[str, ...]:
        """Names that `pose` and `jacobian` understand: the robot's bodies and sites."""
        bodies = [self.model.body(i).name for i in range(self.model.nbody)]
        sites = [self.model.site(i).name for i in range(self.model.nsite)]
        return tuple(dict.fromkeys(name for name in bodies + sites if name))

    def pose(self, Q: ArrayLike, frame: str) -> tuple[Array, Array]:
        """Positions (N, 3) in metres and rotation matrices (N, 3, 3) of a frame at joint positions Q (N, n).

        Both in the world; the columns of a rotation matrix are the frame's axes.

        Raises `RobotError` for a frame that is not there, `DataError` for postures of the wrong shape.
        """
        kind, index = self._frame(frame)
        batch = self._at(Q)
        place = batch.bind("xpos" if kind == "body" else "site_xpos")
        turn = batch.bind("xmat" if kind == "body" else "site_xmat")
        batch.forward(stage=int(simulator().mjtStage.mjSTAGE_POS))
        return place[:, index].copy(), turn[:, index].reshape(-1, 3, 3).copy()

    def jacobian(self, Q: ArrayLike, frame: str) -> Array:
        """Geometric Jacobians J (N, 6, n) of a frame at joint positions Q (N, n): ``(v, ω) = J q̇``.

        Rows 1 to 3 are the velocity v of the frame's origin (m/s), rows 4 to 6 the angular velocity ω
        (rad/s), both in the world.

        Raises as `pose` does.
        """
        kind, index = self._frame(frame)
        place, _ = self.pose(Q, frame)
        body = index if kind == "body" else int(self.model.site_bodyid[index])
        return np.concatenate(self._at(Q).jac(body, place), axis=1)

    def _frame(self, frame: str) -> tuple[str, int]:
        for kind, count in (("body", self.model.nbody), ("site", self.model.nsite)):
            for i in range(count):
                if getattr(self.model, kind)(i).name == frame:
                    return kind, i
        raise RobotError(f"the robot has no frame {frame!r}: it has {', '.join(self.frames)}")

    def _at(self, Q: ArrayLike):
        Q = np.asarray(Q, dtype=np.float64)
        if Q.ndim != 2 or Q.shape[1] != self.n:
            raise DataError(
                f"the robot has {self.n} joints: give postures of shape (N, {self.n}), not {Q.shape}"
            )
        if not np.isfinite(Q).all():
            raise DataError("a posture of the robot has NaN or infinity: give finite joint positions")
        batch = simulator().batch.Batch(self._kinematic, len(Q), 1)
        batch.qpos = Q
        return batch

    @cached_property
    def _kinematic(self) -> "mujoco.MjModel":
        """The model without contacts and equalities, which would only cost time where nothing moves."""
        flags = simulator().mjtDisableBit
        model = copy.copy(self.model)
        model.opt.disableflags |= int(flags.mjDSBL_CONTACT) | int(flags.mjDSBL_CONSTRAINT)
        return model


def _names(lock: Iterable[str]) -> list[str]:
    return [lock] if isinstance(lock, str) else list(lock)


def _lock(spec: "mujoco.MjSpec", name: str, position: float) -> None:
    """Take a joint out of `spec`, its body moved to where the joint held it at `position`."""
    mujoco = simulator()
    joint = next((joint for joint in spec.joints if joint.name == name), None)
    if joint is None:
        known = ", ".join(joint.name for joint in spec.joints)
        raise RobotError(f"there is no joint {name!r} to lock: the joints are {known}")
    if not np.isfinite(position):
        raise RobotError(f"joint {name!r} can be locked at a finite position only, not {position}")
    body = joint.parent
    if position:
        turn, moved = np.array([1.0, 0, 0, 0]), np.zeros(3)
        axis = joint.axis / np.linalg.norm(joint.axis)
        if joint.type == mujoco.mjtJoint.mjJNT_HINGE:
            mujoco.mju_axisAngle2Quat(turn, axis, position)
            mujoco.mju_rotVecQuat(moved, joint.pos, turn)
            moved = joint.pos - moved
        elif joint.type == mujoco.mjtJoint.mjJNT_SLIDE:
            moved = position * axis
        else:
            raise RobotError(f"joint {name!r} has several degrees of freedom: lock it without a position")
        shift, quat = np.zeros(3), np.zeros(4)
        mujoco.mju_rotVecQuat(shift, moved, body.quat)
        mujoco.mju_mulQuat(quat, body.quat, turn)
        body.pos, body.quat = body.pos + shift, quat
    for equality in list(spec.equalities):
        if equality.type == mujoco.mjtEq.mjEQ_JOINT and name in (equality.name1, equality.name2):
            spec.delete(equality)
    for actuator in list(spec.actuators):
        if actuator.target == name:
            spec.delete(actuator)
    spec.delete(joint)


def _from_urdf(
    cls: type[Robot],
    path: Path,
    root: ET.Element,
    lock: Iterable[str] | Mapping[str, float],
    package_dirs: list[Path],
) -> Robot:
    mujoco = simulator()
    missing: set[str] = set()
    unphysical = []
    for link in root.iter("link"):
        inertial = link.find("inertial")
        if inertial is not None and not _is_physical(inertial):
            unphysical.append(link.get("name", ""))
            link.remove(inertial)
        for shape in [*link.findall("visual"), *link.findall("collision")]:
            for mesh in shape.iter("mesh"):
                found = _mesh_file(mesh.get("filename", ""), path, package_dirs)
                if found is None:
                    missing.add(Path(mesh.get("filename", "")).name)
                    link.remove(shape)
                    break
                mesh.set("filename", str(found))
    notes = [f"left out meshes MuJoCo cannot read or find: {', '.join(sorted(missing))}"] if missing else []
    if unphysical:
        notes.append(f"left out inertias that are not positive: {', '.join(unphysical)}")

    # A mesh of a readable kind may still be damaged or too large; the robot moves as well without any.
    for kept in (("visual", "collision"), ("collision",), ()):
        if dropped := {"visual", "collision"} - set(kept):
            for link in root.iter("link"):
                for shape in [child for child in link if child.tag in dropped]:
                    link.remove(shape)
        try:
            spec = mujoco.MjSpec.from_string(ET.tostring(_with_compiler(root), encoding="unicode"))
            # Frames fixed to one another stay apart, each with its name.
            spec.compiler.fusestatic = False
            # Not every URDF's inertias are physical; those that are not are brought near to what is.
            spec.compiler.balanceinertia = True
            spec.compiler.boundmass, spec.compiler.boundinertia = 1e-6, 1e-9
            spec.compile()
            break
        except ValueError as error:
            if not kept:
                raise RobotError(f"MuJoCo cannot read {path.name}: {_one_line(error)}") from error
            notes.append(f"left out {kept[0]} shapes: {_one_line(error)}")
    try:
        return cls(spec, lock, notes)
    except RobotError as error:
        raise RobotError(f"{path.name}: {error}") from error


def _is_physical(inertial: ET.Element) -> bool:
    inertia = inertial.find("inertia")
    entries = {} if inertia is None else inertia.attrib
    upper = np.zeros((3, 3))
    try:
        upper[np.triu_indices(3)] = [
            float(entries.get(key, "0")) for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
        ]
    except ValueError:
        return True  # no number at all: MuJoCo says where
    return bool(np.linalg.eigvalsh(upper, UPLO="U").min() > 0)


def _with_compiler(root: ET.Element) -> ET.Element:
    """A copy of the URDF that tells MuJoCo to keep shapes made for the eye."""
    root = copy.deepcopy(root)
    extension = root.find("mujoco")
    extension = ET.SubElement(root, "mujoco") if extension is None else extension
    compiler = extension.find("compiler")
    compiler = ET.SubElement(extension, "compiler") if compiler is None else compiler
    compiler.set("discardvisual", "false")
    compiler.set("strippath", "false")
    compiler.attrib.pop("meshdir", None)  # the paths are whole by now
    return root


def _mesh_file(name: str, robot_file: Path, package_dirs: list[Path]) -> Path | None:
    """Where a mesh of a URDF is, or None where it is not, or not of a kind that MuJoCo reads."""
    above = robot_file.resolve().parents
    if name.startswith("package://"):
        package, _, rest = name.removeprefix("package://").partition("/")
        places = [folder / package / rest for folder in [*package_dirs, *above]]
        places += [folder / rest for folder in package_dirs]
        places += [folder / rest for folder in above if folder.name == package]
    else:
        places = [above[0] / name.removeprefix("file://")]
    found = next((place.resolve() for place in places if place.is_file()), None)
    return found if found is not None and found.suffix.lower() in MESHES else None


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())
