"""NumPy archives: the names of the arrays are the columns, and an array (N, k) stands for its k columns."""

import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from unconstrain.errors import DataError
from unconstrain.memory import check_memory
from unconstrain.recordings.files import File
from unconstrain.recordings.formats.nested import Fetch, Nested
from unconstrain.recordings.formats.npy import fields_of, read_shape
from unconstrain.recordings.formats.trees import Leaf, Node

MAGIC = (b"PK\x03\x04", b"PK\x05\x06")


class Npz(Nested):
    """An archive of arrays, of which only those asked for are read.

    Numbered arrays of several lengths, and arrays of three axes, are demonstrations.

    Parameters
    ----------
    file : File
    """

    suffixes: ClassVar[tuple[str, ...]] = (".npz",)
    at_once: ClassVar[bool] = True
    separator: ClassVar[str] = "/"
    kind: ClassVar[str] = "an NPZ archive"

    @classmethod
    def matches(cls, file: File) -> bool:
        """Whether the content is of this format, as its first bytes tell."""
        if file.magic[:4] not in MAGIC:
            return False
        try:
            with file.open() as opened, zipfile.ZipFile(opened) as archive:
                return any(name.endswith(".npy") for name in archive.namelist())
        except Exception:  # a damaged archive; which one its suffix tells
            return False

    def tree(self) -> dict[str, Node]:
        """Read the types and shapes of the arrays."""
        shown = self.file.shown
        if self.file.magic[:4] not in MAGIC:
            raise DataError(
                f"{shown} is not an NPZ archive: write it with numpy.savez, or correct its suffix"
            )
        tree: dict[str, Node] = {}
        with self.file.open() as opened, zipfile.ZipFile(opened) as archive:
            for member in archive.infolist():
                if not member.filename.endswith(".npy"):
                    continue
                with archive.open(member) as content:
                    shape, kind = read_shape(content)
                    size = member.file_size - content.tell()
                if not kind.hasobject and size != kind.itemsize * int(np.prod(shape, dtype=object)):
                    raise DataError(
                        f"{shown} is damaged: {member.filename} does not hold what it promises; write it again"
                    )
                *groups, name = member.filename.removesuffix(".npy").split(self.separator)
                inner = tree
                for group in groups:
                    below = inner.setdefault(group, {})
                    if not isinstance(below, dict):  # an array of that name is there too
                        below = inner[f"{group}/"] = {}
                    inner = below
                inner[name] = fields_of(shape, kind, member.filename)
        if not tree:
            raise DataError(f"{shown} is empty: there are no arrays in it")
        return tree

    @contextmanager
    def opened(self) -> Iterator[Fetch]:
        """Read arrays as they are asked for, each once."""
        arrays: dict[str, NDArray[Any]] = {}
        with self.file.open() as opened, zipfile.ZipFile(opened) as archive:

            def fetch(leaf: Leaf) -> NDArray[Any]:
                name, field = leaf.where
                if name not in arrays:
                    size = archive.getinfo(name).file_size
                    check_memory(size, f"reading {self.file.shown}", "leave arrays out")
                    with archive.open(name) as content:
                        arrays[name] = np.lib.format.read_array(content, allow_pickle=False)
                array = arrays[name] if field is None else arrays[name][field]
                return array if leaf.index is None else array[leaf.index]

            yield fetch
