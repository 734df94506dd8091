"""HDF5 files: robomimic, robosuite, ALOHA, and any other whose groups repeat."""

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from types import ModuleType
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from unconstrain.errors import DataError
from unconstrain.memory import check_memory
from unconstrain.recordings.files import File
from unconstrain.recordings.formats.base import damage_named
from unconstrain.recordings.formats.layout import RATES, STEPS
from unconstrain.recordings.formats.nested import Fetch, Nested
from unconstrain.recordings.formats.trees import Leaf, Node, Odd

MAGIC = b"\x89HDF\r\n\x1a\n"
BLOCKS = (512, 1024, 2048)
"""Where in a file HDF5 may begin after a block of the user's."""

MAY_BEGIN_LATER = (".hdf5", ".h5", ".mat")
"""Suffixes of files that are looked at further than at their beginning, which for others would be a request more."""

ENVIRONMENTS = ("env_args", "env_info")
"""Where robomimic and robosuite say how often a robot was controlled."""

MASKS = "mask"
"""The group in which robomimic keeps lists of demonstrations, to train and to validate."""

DEEPEST = 32
"""Groups within groups."""


class Hdf5(Nested):
    """An HDF5 file, of which only the arrays asked for are read, a demonstration at a time.

    Links to other files, and arrays that lie in other files, are not followed.

    Parameters
    ----------
    file : File
    """

    suffixes: ClassVar[tuple[str, ...]] = (".hdf5", ".h5")
    separator: ClassVar[str] = "/"
    kind: ClassVar[str] = "an HDF5 file"

    @classmethod
    def matches(cls, file: File) -> bool:
        """Whether the content is of this format, as its first bytes tell."""
        return is_hdf5(file)

    def tree(self) -> dict[str, Node]:
        """Read which groups and arrays there are."""
        with self._open() as opened:
            node = self.node(opened, opened, ())
        return node if isinstance(node, dict) else {"root": node}

    def choose(self, tree: dict[str, Node], part: str) -> dict[str, Node]:
        """Return a part of the tree, or the demonstrations that a list in the file names, as robomimic's masks do."""
        with damage_named(self.file.shown, self.kind), self._open() as opened:
            names = self._listed(opened, (part, f"{MASKS}/{part}"))
        return super().choose(tree, part) if names is None else _keep(tree, names)

    def _listed(self, opened: Any, paths: Sequence[str]) -> frozenset[str] | None:
        """Return the names in a list of names at one of some paths."""
        h5py = _library(self.file.shown)
        for path in paths:
            item = opened.get(path)
            if isinstance(item, h5py.Dataset) and item.ndim == 1 and h5py.check_string_dtype(item.dtype):
                self.check_size(item)
                return frozenset(item.asstr()[()].tolist())
        return None

    @contextmanager
    def opened(self) -> Iterator[Fetch]:
        """Open the file, and return what reads one of its arrays."""
        with self._open() as opened:

            def fetch(leaf: Leaf) -> NDArray[Any]:
                if isinstance(leaf.where, np.ndarray):
                    return leaf.where
                if isinstance(leaf.where, tuple):
                    name, field = leaf.where
                    return opened[name][field]
                return self.fetch(opened[leaf.where], leaf.index)

            yield fetch

    def node(self, item: Any, opened: Any, above: tuple[Any, ...]) -> Node:
        """Read what a dataset or a group stands for."""
        h5py = _library(self.file.shown)
        if len(above) > DEEPEST:
            return Odd(f"lies deeper than {DEEPEST} groups")
        if isinstance(item, h5py.Dataset):
            if item.external or item.is_virtual:
                return Odd("lies in another file")
            if item.shape is None or not item.size:
                return Odd("is empty")
            if item.dtype.names:
                return self.records(item)
            if item.dtype.hasobject:
                return Odd("holds text or references")
            return self.leaf(item)
        if not isinstance(item, h5py.Group):
            return Odd("is a type of data")
        if item.id in above:
            return Odd("is a group that contains itself")
        inner: dict[str, Node] = {}
        steps = [*_steps(item)]
        for name in item:
            if name in ("#refs#", "#subsystem#"):  # where MATLAB keeps what cells refer to
                continue
            # Nearly all are no links to elsewhere, which is asked at half the price of `get`.
            kind = item.id.links.get_info(name.encode("utf-8", "surrogateescape")).type
            if kind == h5py.h5l.TYPE_HARD:
                part = item[name]
            elif isinstance(item.get(name, getlink=True), h5py.ExternalLink):
                inner[name] = Odd("lies in another file")
                continue
            elif (part := item.get(name)) is None:
                inner[name] = Odd("is a link to nothing")
                continue
            inner[name] = self.node(part, opened, (*above, item.id))
            steps += _steps(part) if isinstance(part, h5py.Dataset) else ()
        if item.attrs.get("pandas_type") is not None:
            return self.frame(item, inner)
        for name, number in steps:
            inner.setdefault(name, Leaf((), number.dtype, number))
        return inner

    def frame(self, group: Any, inner: dict[str, Node]) -> dict[str, Node]:
        """Describe the columns of a data frame that pandas wrote, whose columns of one type are a block."""
        columns: dict[str, Node] = {}
        for name, node in inner.items():
            items = group.get(name.replace("_values", "_items"))
            if not (
                name.endswith("_values")
                and isinstance(node, Leaf)
                and len(node.shape) == 2
                and items is not None
            ):
                continue
            names = [
                each.decode(errors="replace") if isinstance(each, bytes) else str(each) for each in items[()]
            ]
            fields = ((name, (slice(None), i)) for i, name in enumerate(names[: node.shape[1]]))
            columns |= {name: Leaf(node.shape[:1], node.kind, (node.where, field)) for name, field in fields}
        return columns or inner

    def leaf(self, item: Any) -> Leaf:
        """Describe an array."""
        return Leaf(tuple(item.shape), item.dtype, item.name)

    def records(self, item: Any) -> Node:
        """Describe the fields of an array of records."""
        fields = {name: item.dtype.fields[name][0] for name in item.dtype.names}
        return {
            name: Odd("holds text or references")
            if kind.hasobject or kind.names
            else Leaf((*item.shape, *kind.shape), kind.base, (item.name, name))
            for name, kind in fields.items()
        }

    def fetch(self, item: Any, index: tuple[Any, ...] | None) -> NDArray[Any]:
        """Read an array."""
        return item[()] if index is None else item[index]

    def check_size(self, item: Any) -> None:
        """Refuse an array that does not fit into memory."""
        check_memory(2.0 * item.size * max(item.dtype.itemsize, 64), f"reading {self.file.shown}", "split it")

    @contextmanager
    def _open(self) -> Iterator[Any]:
        h5py = _library(self.file.shown)
        if self.file.local:
            with h5py.File(self.file.path, "r", locking=False) as opened:
                yield opened
            return
        with self.file.open() as content, h5py.File(content, "r") as opened:
            yield opened


def _keep(tree: dict[str, Node], names: frozenset[str]) -> dict[str, Node]:
    """Return a tree in which, where some groups have one of these names, the others beside them are missing."""
    some = any(name in names and isinstance(node, dict) for name, node in tree.items())
    return {
        name: _keep(node, names) if isinstance(node, dict) and not some else node
        for name, node in tree.items()
        if not some or name in names or not isinstance(node, dict)
    }


def is_hdf5(file: File) -> bool:
    """Whether a file holds HDF5, at its beginning or after a block of the user's."""
    if file.magic.startswith(MAGIC):
        return True
    if file.suffix not in MAY_BEGIN_LATER:
        return False
    begin = file.begin(BLOCKS[-1] + len(MAGIC))
    return any(begin[at : at + len(MAGIC)] == MAGIC for at in BLOCKS)


def _steps(item: Any) -> Iterator[tuple[str, NDArray[Any]]]:
    """Yield the attributes of a group or an array that say how far samples are apart."""
    about = item.attrs
    for name in about if len(about) else ():
        if name.lower() in STEPS | RATES:
            number = np.asarray(about[name])
            if number.dtype.kind in "iuf" and number.size == 1:
                yield name, number.reshape(())
        elif name in ENVIRONMENTS:
            try:
                told = json.loads(about[name])
                rate = float(told.get("env_kwargs", told)["control_freq"])
            except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
                continue
            yield "control_freq", np.array(rate)


def _library(shown: str) -> ModuleType:
    try:
        import h5py
    except ImportError:
        raise DataError(
            f"{shown}: reading HDF5 needs the package h5py, which is not installed: "
            "pip install 'unconstrain[hdf5]'"
        ) from None
    return h5py
