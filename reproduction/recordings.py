"""Recorded fingertips on two surfaces, which some experiments look at; they are not part of the project."""

from pathlib import Path

from unconstrain.errors import UnconstrainError

FLAT, CURVED = "planer_circle.csv", "curve_circle.csv"
"""Files of a flat and of a curved surface: a line of names, positions in columns 1 to 3, and `rosbagTimestamp`."""

NEEDED = f"give the folder that holds {FLAT} and {CURVED} as --recordings"


def surface_file(folder: Path, name: str) -> Path:
    """Return the path of a recording. Raises `UnconstrainError` where it is not in the folder."""
    path = folder / name
    if not path.is_file():
        raise UnconstrainError(f"there is no recording {path}: {NEEDED}")
    return path


def check_surfaces(folder: Path | None) -> None:
    """Raise `UnconstrainError` where a folder is given and the recordings are not in it."""
    if folder is not None:
        for name in (FLAT, CURVED):
            surface_file(folder, name)
