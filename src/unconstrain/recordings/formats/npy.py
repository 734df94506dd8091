"""NumPy arrays in files of their own: (N,), (N, k), (episodes, time, dimensions), records, and folders of them."""

import os
import re
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import PurePosixPath
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from unconstrain.memory import check_memory
from unconstrain.recordings.files import File
from unconstrain.recordings.formats.base import damage_named
from unconstrain.recordings.formats.nested import Fetch, Nested
from unconstrain.recordings.formats.trees import Leaf, Node, Odd

MAGIC = b"\x93NUMPY"

ARRAY = "array"
"""What the array is called."""


class Npy(Nested):
    """A NumPy array, whose columns are `array[0]`, `array[1]`, ...; those of an array of records have its names.

    Parameters
    ----------
    file : File
    """

    suffixes: ClassVar[tuple[str, ...]] = (".npy",)
    at_once: ClassVar[bool] = True
    kind: ClassVar[str] = "a NumPy array"

    @classmethod
    def matches(cls, file: File) -> bool:
        """Whether the content is of this format, as its first bytes tell."""
        return file.magic.startswith(MAGIC)

    def tree(self) -> dict[str, Node]:
        """Read the type and shape of the array."""
        with self.file.open() as content:
            shape, kind = read_shape(content)
            held = self.file.info.size - content.tell()
        if not kind.hasobject and held != kind.itemsize * int(np.prod(shape, dtype=object)):
            raise ValueError("the array does not hold what it promises")
        node = fields_of(shape, kind, None)
        return node if isinstance(node, dict) else {ARRAY: node}

    @contextmanager
    def opened(self) -> Iterator[Fetch]:
        """Read the array, and return what gives its parts."""
        check_memory(2.0 * self.file.info.size, f"reading {self.file.shown}", "write it as Parquet")
        with self.file.open() as content:
            array = np.lib.format.read_array(content, allow_pickle=False)

        def fetch(leaf: Leaf) -> NDArray[Any]:
            _, field = leaf.where
            part = array if field is None else array[field]
            return part if leaf.index is None else part[leaf.index]

        yield fetch


class NpyFolder(Nested):
    """A folder of arrays that belong together, each called by its path in the folder, as in `states[0]`.

    Folders in it whose names differ by a number only are demonstrations.

    Parameters
    ----------
    shown : str
        The folder, as the user calls it.
    files : sequence of Npy
        The arrays in it.
    """

    at_once: ClassVar[bool] = True
    separator: ClassVar[str] = "/"
    kind: ClassVar[str] = "a folder of NumPy arrays"

    def __init__(self, shown: str, files: Sequence[Npy]) -> None:
        super().__init__(replace(files[0].file, shown=shown))
        self._files = tuple(files)

    def __getstate__(self) -> dict[str, Any]:
        """Return the files alone."""
        files = tuple(Npy(replace(each.file)) for each in self._files)
        return {**super().__getstate__(), "_files": files}

    def identity(self) -> str:
        """Say what tells the files from others."""
        return repr((self.part, [each.identity() for each in self._files]))

    def tree(self) -> dict[str, Node]:
        """Read the types and shapes of the arrays."""
        tree: dict[str, Node] = {}
        paths = _relative([each.file for each in self._files])
        for number, (each, path) in enumerate(zip(self._files, paths, strict=True)):
            inner = tree
            *folders, name = path
            for folder in folders:
                below = inner.setdefault(folder, {})
                assert isinstance(below, dict)
                inner = below
            with damage_named(each.file.shown, each.kind):
                arrays = each.tree()
            fields = {
                field: replace(node, where=(number, node.where)) if isinstance(node, Leaf) else node
                for field, node in arrays.items()
            }
            inner[name] = fields.get(ARRAY, fields)
        return tree

    @contextmanager
    def opened(self) -> Iterator[Fetch]:
        """Read arrays as they are asked for."""
        with ExitStack() as stack:
            opened: dict[int, Fetch] = {}

            def fetch(leaf: Leaf) -> NDArray[Any]:
                number, where = leaf.where
                if number not in opened:
                    opened[number] = stack.enter_context(self._files[number].opened())
                return opened[number](replace(leaf, where=where))

            yield fetch


def belong_together(files: Sequence[File]) -> bool:
    """Whether arrays of a folder are parts of one recording, and not an episode each, whose names are numbered."""
    return len({re.sub(r"\d+", "#", "/".join(path)) for path in _relative(files)}) > 1


def _relative(files: Sequence[File]) -> list[tuple[str, ...]]:
    """Return the folders and the name without suffix by which each file lies in the folder of them all."""
    paths = [PurePosixPath(file.path) for file in files]
    root = os.path.commonpath([path.parent for path in paths])
    return [path.relative_to(root).with_suffix("").parts for path in paths]


def read_shape(content: Any) -> tuple[tuple[int, ...], np.dtype]:
    """Read the shape and the type of an array from its beginning.

    Parameters
    ----------
    content : binary file
        At the beginning of what `numpy.save` wrote.

    Returns
    -------
    shape : tuple of int
    kind : numpy.dtype
    """
    version = np.lib.format.read_magic(content)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, kind = read(content)
    return shape, kind


def fields_of(shape: tuple[int, ...], kind: np.dtype, where: object) -> Node:
    """Describe an array, or the fields of an array of records.

    Parameters
    ----------
    shape : tuple of int
    kind : numpy.dtype
    where : object
        What finds the array; leaves have it, and the name of their field.

    Returns
    -------
    Leaf, Odd, or dict of str to Leaf
    """
    if kind.hasobject:
        return Odd("holds pickled Python objects, which are not opened: save numbers")
    if kind.names is None or kind.fields is None:
        return Leaf(shape, kind, (where, None))
    fields = {name: kind.fields[name][0] for name in kind.names}
    return {name: Leaf((*shape, *each.shape), each.base, (where, name)) for name, each in fields.items()}
