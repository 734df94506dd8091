"""File formats: one file each, and the table of them."""

from unconstrain.errors import DataError
from unconstrain.recordings.files import File
from unconstrain.recordings.formats.base import Format
from unconstrain.recordings.formats.c3d import C3D
from unconstrain.recordings.formats.feather import Feather
from unconstrain.recordings.formats.hdf5 import Hdf5
from unconstrain.recordings.formats.json_document import JsonDocument
from unconstrain.recordings.formats.json_lines import JsonLines
from unconstrain.recordings.formats.matlab import Matlab, Matlab73
from unconstrain.recordings.formats.npy import Npy
from unconstrain.recordings.formats.npz import Npz
from unconstrain.recordings.formats.parquet import Parquet
from unconstrain.recordings.formats.rosbag import RosBag
from unconstrain.recordings.formats.saved import Saved
from unconstrain.recordings.formats.text import Text
from unconstrain.recordings.formats.text_encoding import is_text
from unconstrain.recordings.formats.xlsx import Xlsx

FORMATS: tuple[type[Format], ...] = (
    RosBag, Npy, Matlab, Matlab73, Hdf5, Parquet, Saved, Xlsx, Npz, C3D, Feather, JsonDocument, JsonLines, Text,
)  # fmt: skip
"""In the order in which they are tried."""


def recognize(file: File) -> Format:
    """Open a file in the format that its content is in, or else the one that its suffix promises, or else as text.

    Parameters
    ----------
    file : File

    Returns
    -------
    Format

    Raises
    ------
    DataError
        The file is empty, or of none of the formats.
    """
    if file.info.size == 0:
        raise DataError(f"{file.shown} is empty: there is nothing to read")
    for kind in FORMATS:
        if kind.matches(file):
            return kind(file)
    for kind in FORMATS:
        if file.suffix in kind.suffixes:
            return kind(file)
    if is_text(file):
        return Text(file)
    known = ", ".join(suffix for kind in FORMATS[::-1] for suffix in kind.suffixes)
    raise DataError(f"{file.shown} cannot be read by its suffix {file.suffix!r}; those known are {known}")
