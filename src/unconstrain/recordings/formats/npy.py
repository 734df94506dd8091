"""Single NumPy arrays: (N,), (N, k), (episodes, time, dimensions), and records."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from unconstrain.memory import check_memory
from unconstrain.recordings.files import File
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
            shape, kind = _read_shape(content)
            held = self.file.info.size - content.tell()
        if kind.hasobject:
            return {ARRAY: Odd("holds pickled Python objects, which are not opened: save numbers")}
        if held != kind.itemsize * int(np.prod(shape, dtype=object)):
            raise ValueError("the array does not hold what it promises")
        if not kind.names:
            return {ARRAY: Leaf(shape, kind, None)}
        fields = {name: kind.fields[name][0] for name in kind.names if kind.fields is not None}
        return {name: Leaf((*shape, *each.shape), each.base, name) for name, each in fields.items()}

    @contextmanager
    def opened(self) -> Iterator[Fetch]:
        """Read the array, and return what gives its parts."""
        check_memory(2.0 * self.file.info.size, f"reading {self.file.shown}", "write it as Parquet")
        with self.file.open() as content:
            array = np.lib.format.read_array(content, allow_pickle=False)

        def fetch(leaf: Leaf) -> NDArray[Any]:
            part = array if leaf.where is None else array[leaf.where]
            return part if leaf.index is None else part[leaf.index]

        yield fetch


def _read_shape(content: Any) -> tuple[tuple[int, ...], np.dtype]:
    version = np.lib.format.read_magic(content)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, kind = read(content)
    return shape, kind
