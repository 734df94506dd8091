"""MATLAB files: version 5 and before, read by SciPy, and version 7.3, which is HDF5."""

import io
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from unconstrain.memory import check_memory
from unconstrain.recordings.files import File
from unconstrain.recordings.formats.base import damage_named
from unconstrain.recordings.formats.hdf5 import Hdf5, is_hdf5
from unconstrain.recordings.formats.matlab_checking import check_variables
from unconstrain.recordings.formats.nested import Fetch, Nested
from unconstrain.recordings.formats.trees import Leaf, Node, Odd

GROWTH = 8
"""How many times more memory than in the file numbers may take: floats that are small integers are written as bytes."""

DEEPEST = 32
"""Structs within structs."""

COMPRESSED = 15
"""The mark of a compressed variable."""

PIECE = 1 << 16
"""Bytes that are decompressed at a time, between which the memory is checked."""

OFTEN = 1 << 24
"""Bytes decompressed between two looks at the memory."""


class Matlab(Nested):
    """A MATLAB file of version 5 or 4: structs, arrays of structs and cells of them. It is read as a whole.

    Parameters
    ----------
    file : File
    """

    suffixes: ClassVar[tuple[str, ...]] = (".mat",)
    episodes_last: ClassVar[bool] = True
    at_once: ClassVar[bool] = True
    kind: ClassVar[str] = "a MATLAB file"

    @classmethod
    def matches(cls, file: File) -> bool:
        """Whether the content is of this format, as its first bytes tell."""
        return file.magic.startswith(b"MATLAB 5.0 MAT")

    def tree(self) -> dict[str, Node]:
        """Read the variables."""
        return self._variables

    @contextmanager
    def opened(self) -> Iterator[Fetch]:
        """Return what gives the arrays, which are in memory."""
        yield _array_of

    @cached_property
    def _variables(self) -> dict[str, Node]:
        import scipy.io

        shown = self.file.shown
        check_memory(2.0 * self.file.info.size, f"reading {shown}", "write a file a demonstration")
        data = self.file.read()
        with damage_named(shown, self.kind):
            remedy = "write a file a demonstration, or save it with -v7.3"
            if 0 not in data[:4]:  # version 4 compresses nothing
                data = _inflate(data, f"reading {shown}", remedy)
                check_variables(data)
            needed = (1.0 + GROWTH) * len(data)
            check_memory(needed, f"reading {shown}", remedy)
            # Cells of a shape that the file cannot hold would be allocated before they are read.
            content: Any = io.BytesIO(data)
            for _, shape, _ in scipy.io.whosmat(content):
                size = int(np.prod(shape, dtype=object))
                if 8.0 * size > max(needed, 1e6) * GROWTH:
                    raise ValueError("a variable has more values than the file")
            variables = scipy.io.loadmat(content, chars_as_strings=True, simplify_cells=False)
            return {name: _node(value) for name, value in variables.items() if not name.startswith("__")}


class Matlab73(Hdf5):
    """A MATLAB file of version 7.3, which is an HDF5 file: axes are in reverse, and cells are references.

    Parameters
    ----------
    file : File
    """

    suffixes: ClassVar[tuple[str, ...]] = ()
    episodes_last: ClassVar[bool] = True
    separator: ClassVar[str] = "."
    kind: ClassVar[str] = "a MATLAB file"

    @classmethod
    def matches(cls, file: File) -> bool:
        """Whether the content is of this format, as its first bytes tell."""
        return file.magic.startswith(b"MATLAB 7.3 MAT") or (file.suffix == ".mat" and is_hdf5(file))

    def node(self, item: Any, opened: Any, above: tuple[Any, ...]) -> Node:
        """Read what a dataset or a group stands for: an array, a struct, an array of structs, or a cell."""
        import h5py

        if not isinstance(item, h5py.Dataset):
            fields = super().node(item, opened, above)
            # The file itself is no struct: a single variable that is a cell is not the field of one.
            return _struct_array(fields) if isinstance(fields, dict) and above else fields
        about = item.attrs
        kind = about.get("MATLAB_class", b"")
        kind = kind.decode(errors="replace") if isinstance(kind, bytes) else str(kind)
        if "MATLAB_object_decode" in about:
            return Odd(f"is a MATLAB {kind or 'object'}: save it as a struct or a matrix")
        if "MATLAB_empty" in about:
            return Odd("is empty")
        if kind == "char":
            return Odd("holds text")
        if item.dtype != h5py.ref_dtype:
            return super().node(item, opened, above)
        self.check_size(item)
        return [self.node(opened[each], opened, (*above, item.id)) for each in item[()].T.ravel(order="F")]

    def leaf(self, item: Any) -> Leaf:
        """Describe an array as MATLAB shows it: axes in reverse of the file's."""
        stored = super().leaf(item)
        return Leaf(stored.shape[::-1], stored.kind, stored.where)

    def fetch(self, item: Any, index: tuple[Any, ...] | None) -> NDArray[Any]:
        """Read an array with its axes as MATLAB shows them."""
        array = super().fetch(item, None).T
        return array if index is None else array[index]


def _array_of(leaf: Leaf) -> NDArray[Any]:
    return leaf.where if leaf.index is None else leaf.where[leaf.index]


def _struct_array(fields: dict[str, Node]) -> Node:
    """Return the structs of an array, which MATLAB writes as one struct whose fields are lists."""
    lengths = {len(each) if isinstance(each, list) else -1 for each in fields.values()}
    if len(lengths) != 1 or (length := lengths.pop()) < 1:
        return fields
    lists = {name: each for name, each in fields.items() if isinstance(each, list)}
    return [{name: each[i] for name, each in lists.items()} for i in range(length)]


def _node(value: Any, depth: int = 0) -> Node:
    """Make a tree of what SciPy read."""
    if depth > DEEPEST:
        return Odd(f"lies deeper than {DEEPEST} structs")
    if not isinstance(value, np.ndarray):
        return Odd("is a sparse matrix: save full(...) of it")
    kind = type(value).__name__
    if kind in ("MatlabOpaque", "MatlabFunction", "MatlabObject"):
        return Odd("is a MATLAB object or function: save it as a struct or a matrix")
    if value.dtype.names:
        structs: list[Node] = [
            {str(name): _node(each[name], depth + 1) for name in value.dtype.names}
            for each in value.ravel(order="F")
        ]
        return structs[0] if len(structs) == 1 else structs
    if value.dtype == object:
        return [_node(each, depth + 1) for each in value.ravel(order="F")]
    if not value.size:
        return Odd("is empty")
    return Leaf(value.shape, value.dtype, value)


def _inflate(data: bytes, what: str, remedy: str) -> bytes:
    """Return a file of version 5 with none of its variables compressed: decompressing takes longer than all else.

    What is cut short stays so. Raises `DataError` as soon as it would not fit into memory.
    """
    order = "<" if data[126:128] == b"IM" else ">"
    view = memoryview(data)
    pieces: list[bytes | memoryview] = [view[:128]]
    at, count, looked = 128, 0, 0
    while at < len(data):
        if at + 8 > len(data):
            pieces.append(view[at:])
            break
        kind, size = (int(number) for number in np.frombuffer(data, f"{order}u4", 2, at))
        body = view[at + 8 : at + 8 + size]
        if kind != COMPRESSED:
            pieces.append(view[at : at + 8 + size])
            count += len(body)
        else:
            if len(body) < size:
                raise ValueError("an element that is longer than what holds it")
            unpacker = zlib.decompressobj()
            for begin in range(0, len(body), PIECE):
                piece = unpacker.decompress(body[begin : begin + PIECE])
                pieces.append(piece)
                count += len(piece)
                if count > looked + OFTEN:
                    check_memory(GROWTH * float(count), what, remedy)
                    looked = count
        at += 8 + size
    return data if len(pieces) == 1 else b"".join(pieces)
