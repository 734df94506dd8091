"""JSON documents: records, lists and objects in any arrangement, read as a tree of arrays."""

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from unconstrain.errors import DataError
from unconstrain.memory import check_memory
from unconstrain.recordings.files import File
from unconstrain.recordings.formats.base import damage_named
from unconstrain.recordings.formats.json_lines import JsonLines
from unconstrain.recordings.formats.nested import Fetch, Nested
from unconstrain.recordings.formats.text_encoding import begin_text, read_text
from unconstrain.recordings.formats.trees import Leaf, Node, Odd

WHOLE = "array"
"""What an array is called that is the whole document."""

GROWTH = 30.0
"""How many times more memory than in the file values take as Python objects."""

DEEPEST = 32
"""Objects within objects."""


class JsonDocument(Nested):
    """A document of JSON: a list of records, an object of lists, or demonstrations of either.

    Records become columns by the names of their members; what some of them lack is missing.

    Parameters
    ----------
    file : File
    """

    suffixes: ClassVar[tuple[str, ...]] = (".json",)
    at_once: ClassVar[bool] = True
    kind: ClassVar[str] = "a JSON document"

    @classmethod
    def matches(cls, file: File) -> bool:
        """Whether the text begins as a document does, and not with an object a line."""
        try:
            text, is_all, _ = begin_text(file)
        except DataError:
            return False
        text = text.removeprefix(b"\xef\xbb\xbf").strip()
        if text[:1] not in (b"{", b"[") or file.suffix in JsonLines.suffixes:
            return False
        lines = [line for line in text.split(b"\n") if line.strip()]
        if not is_all and len(lines) < 2:
            return True  # one long line
        try:
            held = json.loads(text if len(lines) < 2 else lines[0])
        except (ValueError, RecursionError):
            return text[1:].lstrip()[:1] in (b'"', b"{", b"[") and (not is_all or _parses(text))
        return isinstance(held, dict | list) and len(lines) < 2 and _has_lists(held)

    def tree(self) -> dict[str, Node]:
        """Read the values."""
        text, _ = read_text(self.file)
        check_memory(GROWTH * len(text), f"reading {self.file.shown}", "write it as Parquet")
        with damage_named(self.file.shown, self.kind):
            held = json.loads(text.decode("utf-8-sig"))
        node = _node(_records_of_pandas(held), 0)
        return node if isinstance(node, dict) else {WHOLE: node}

    @contextmanager
    def opened(self) -> Iterator[Fetch]:
        """Return what gives the arrays, which are in memory."""
        yield _array_of


def _array_of(leaf: Leaf) -> NDArray[Any]:
    array: NDArray[Any] = leaf.where
    return array if leaf.index is None else array[leaf.index]


def _parses(text: bytes) -> bool:
    try:
        json.loads(text)
    except (ValueError, RecursionError):
        return False
    return True


def _has_lists(held: Any) -> bool:
    """Whether a document of one line is more than one record."""
    return isinstance(held, list) or any(isinstance(value, dict | list) for value in held.values())


def _records_of_pandas(held: Any) -> Any:
    """Return what pandas writes by columns, or split into names and rows, as an object of lists."""
    if not isinstance(held, dict):
        return held
    if {"columns", "data"} <= held.keys() <= {"columns", "data", "index", "schema"}:
        columns, rows = held["columns"], held["data"]
        if isinstance(rows, list) and all(isinstance(row, list) and len(row) == len(columns) for row in rows):
            return {str(name): [row[i] for row in rows] for i, name in enumerate(columns)}
    values = list(held.values())
    if len(values) > 1 and all(isinstance(value, dict) and value for value in values):
        keys = list(values[0])
        numbered = all(key.isdecimal() for key in keys)
        if numbered and all(list(value) == keys for value in values):
            return {name: list(value.values()) for name, value in held.items()}
    return held


def _node(value: Any, depth: int) -> Node:
    """Return a value as a tree of arrays."""
    if depth > DEEPEST:
        return Odd("is nested too deeply")
    if isinstance(value, dict):
        return {str(name): _node(inner, depth + 1) for name, inner in value.items()}
    if not isinstance(value, list):
        return _leaf([value], ()) if value is not None else Odd("is null")
    if value and all(isinstance(each, dict) for each in value):
        if _are_demonstrations(value):
            return [_node(each, depth + 1) for each in value]
        return _columns(value, depth)
    if value and all(isinstance(each, list) for each in value):
        lengths = {len(each) for each in value}
        if len(lengths) > 1 or (value[0] and isinstance(value[0][0], dict)):
            return [_node(each, depth + 1) for each in value]
    return _leaf(value, (len(value),))


def _are_demonstrations(records: Sequence[dict[str, Any]]) -> bool:
    """Whether objects are a demonstration each: they hold lists that are longer than they are many, or uneven."""
    lists: dict[str, list[int]] = {}
    for record in records:
        for name, value in record.items():
            if isinstance(value, list):
                lists.setdefault(name, []).append(len(value))
                if value and isinstance(value[0], list | dict):
                    return True
    return any(max(own) > max(len(records), 4) or len(set(own)) > 1 for own in lists.values())


def _columns(records: Sequence[dict[str, Any]], depth: int) -> Node:
    """Return records as columns."""
    names = dict.fromkeys(str(name) for record in records for name in record)
    columns: dict[str, Node] = {}
    for name in names:
        values = [record.get(name) for record in records]
        there = [value for value in values if value is not None]
        if there and all(isinstance(value, dict) for value in there):
            columns[name] = (
                _columns([value or {} for value in values], depth + 1) if depth < DEEPEST else Odd("")
            )
        elif there and all(isinstance(value, list) for value in there) and len(there) < len(values):
            lacking = [None] * len(there[0])
            columns[name] = _leaf([lacking if value is None else value for value in values], (len(values),))
        else:
            columns[name] = _leaf(values, (len(values),))
    return columns


def _leaf(values: list[Any], shape: tuple[int, ...]) -> Node:
    """Return a list of values, or of lists of them, as an array; what is missing is not a number."""
    try:
        array = np.array(values)
        if array.dtype == object:
            flat = np.array(values, dtype=object).ravel()
            if any(isinstance(value, str) for value in flat):
                array = np.array(["" if value is None else str(value) for value in values])
            else:
                array = np.array(values, dtype=np.float64)
    except (ValueError, TypeError, OverflowError):
        return Odd("holds values of several kinds")
    if array.dtype.kind not in "biufU":
        return Odd("holds values of several kinds")
    return Leaf(array.shape if shape else (), array.dtype, array if shape else array[0])
