"""From an MJCF or URDF file to what MuJoCo simulates."""

import copy
import os
import xml.etree.ElementTree as ET
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from unconstrain.errors import RobotError
from unconstrain.robots.simulator import import_mujoco, one_line

if TYPE_CHECKING:
    import mujoco

MESHES = (".stl", ".obj", ".msh")
"""What MuJoCo reads; URDF files often show robots in .dae, which it does not."""

SHAPES = ("visual", "collision")
"""Elements of a URDF's links that may hold meshes."""


def read_spec(
    path: str | os.PathLike[str], package_dirs: Iterable[str | os.PathLike[str]] = ()
) -> tuple["mujoco.MjSpec", list[str]]:
    """Read a robot from an MJCF (.xml) or URDF (.urdf) file, whichever its outermost element says it is.

    Parameters
    ----------
    path : str or path
        Of the file.
    package_dirs : iterable of str or path
        Folders where ``package://`` meshes of a URDF are looked for.

    Returns
    -------
    spec : mujoco.MjSpec
        Of the robot, all its joints free to move.
    notes : list of str
        What was left out in reading, a sentence each.

    Raises
    ------
    RobotError
        If the file is missing, or not a robot.
    """
    mujoco = import_mujoco()
    path = Path(path)
    if not path.is_file():
        raise RobotError(f"there is no robot file {str(path)!r}: give the path of an MJCF or URDF file")
    try:
        root = ET.parse(path).getroot()
    except (ET.ParseError, UnicodeDecodeError, LookupError) as error:
        raise RobotError(f"{path.name} is not an XML file ({one_line(error)}): give MJCF or URDF") from None
    if root.tag == "robot":
        return _read_urdf(path, root, [Path(directory) for directory in package_dirs])
    if root.tag != "mujoco":
        raise RobotError(
            f"{path.name} is neither an MJCF nor a URDF file: its outermost element is <{root.tag}>, "
            "not <mujoco> or <robot>"
        )
    try:
        return mujoco.MjSpec.from_file(str(path)), []
    except ValueError as error:
        raise RobotError(f"MuJoCo cannot read {path.name}: {one_line(error)}") from error


def _read_urdf(path: Path, root: ET.Element, package_dirs: list[Path]) -> tuple["mujoco.MjSpec", list[str]]:
    mujoco = import_mujoco()
    notes = _find_meshes(root, path, package_dirs) + _drop_unphysical_inertias(root)
    # A mesh of a readable kind may still be damaged or too large; the robot moves as well without any.
    for kept in (SHAPES, SHAPES[1:], ()):
        _drop_shapes(root, set(SHAPES) - set(kept))
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
                raise RobotError(f"MuJoCo cannot read {path.name}: {one_line(error)}") from error
            notes.append(f"left out {kept[0]} shapes: {one_line(error)}")
    return spec, notes


def _find_meshes(root: ET.Element, path: Path, package_dirs: list[Path]) -> list[str]:
    """Give every mesh the path of its file, drop shapes whose mesh is missing or unreadable, and note these."""
    missing: set[str] = set()
    for link in root.iter("link"):
        for shape in [child for child in link if child.tag in SHAPES]:
            for mesh in shape.iter("mesh"):
                name = mesh.get("filename", "")
                found = _find_mesh(name, path, package_dirs)
                if found is None:
                    missing.add(Path(name).name)
                    link.remove(shape)
                    break
                mesh.set("filename", str(found))
    return [f"left out meshes MuJoCo cannot read or find: {', '.join(sorted(missing))}"] if missing else []


def _drop_unphysical_inertias(root: ET.Element) -> list[str]:
    unphysical = []
    for link in root.iter("link"):
        inertial = link.find("inertial")
        if inertial is not None and not _is_physical(inertial):
            unphysical.append(link.get("name", ""))
            link.remove(inertial)
    return [f"left out inertias that are not positive: {', '.join(unphysical)}"] if unphysical else []


def _drop_shapes(root: ET.Element, tags: set[str]) -> None:
    for link in root.iter("link"):
        for shape in [child for child in link if child.tag in tags]:
            link.remove(shape)


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
    """Copy the URDF, and tell MuJoCo in it to keep shapes made for the eye."""
    root = copy.deepcopy(root)
    extension = root.find("mujoco")
    extension = ET.SubElement(root, "mujoco") if extension is None else extension
    compiler = extension.find("compiler")
    compiler = ET.SubElement(extension, "compiler") if compiler is None else compiler
    compiler.set("discardvisual", "false")
    compiler.set("strippath", "false")
    compiler.attrib.pop("meshdir", None)  # the paths are whole by now
    return root


def _find_mesh(name: str, robot_file: Path, package_dirs: list[Path]) -> Path | None:
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
