"""Damage in MATLAB files of version 5 on which SciPy would end the program instead of raising an error."""

import struct
import zlib
from collections.abc import Iterator

import numpy as np

MATRIX, COMPRESSED = 14, 15
"""Types of elements: an array, and one that is compressed."""

CELL, STRUCT, OBJECT, SPARSE = 1, 2, 3, 5
"""Classes of arrays that hold others, and one that is in several parts."""

TEXT, NUMBERS = 4, range(6, 16)
"""Classes of arrays of text and of numbers."""

TYPES = {
    TEXT: (1, 2, 3, 4, 16, 17, 18),
    **dict.fromkeys((SPARSE, *NUMBERS), (1, 2, 3, 4, 5, 6, 7, 9, 12, 13)),
}
"""Types of elements that their values may be of."""

INTEGERS, NAME = (5, 6), (1, 16)
"""Types of elements that hold the shape and the name of an array."""

COMPLEX = 0x0800
"""The flag of arrays with an imaginary part."""

HEADER = 128
DEEPEST = 64


def check_variables(data: bytes) -> None:
    """Check that arrays have the parts that they say.

    Parameters
    ----------
    data : bytes
        A file of version 5.

    Raises
    ------
    ValueError
        An array has no numbers, or no imaginary part where it says that it has one.
    """
    order = "<" if data[126:128] == b"IM" else ">"
    for kind, body in _elements(memoryview(data)[HEADER:], order, padded=False):
        if kind == COMPRESSED:
            inner = memoryview(zlib.decompressobj().decompress(body))
            for kind_within, body_within in _elements(inner, order):
                _check(kind_within, body_within, order, 0)
        else:
            _check(kind, body, order, 0)


def _check(kind: int, body: memoryview, order: str, depth: int) -> None:
    if kind != MATRIX or not len(body):
        return
    if depth > DEEPEST:
        raise ValueError("arrays within too many arrays")
    parts = list(_elements(body, order))
    if len(parts) < 2 or len(parts[0][1]) < 4:
        raise ValueError("an array without a description")
    flags = int(np.frombuffer(parts[0][1], f"{order}u4", 1)[0])
    held = flags & 0xFF
    if held in (CELL, STRUCT, OBJECT):
        for each in parts:
            _check(*each, order, depth + 1)
    elif held in TYPES:
        wanted = 3 + (3 if held == SPARSE else 1) + bool(flags & COMPLEX)
        if len(parts) < wanted:
            raise ValueError("an array that lacks one of its parts")
        if any(kind not in TYPES[held] for kind, _ in parts[3:wanted]):
            raise ValueError("values of an unknown type")
    is_known = held in (CELL, STRUCT, OBJECT, *TYPES)
    if is_known and len(parts) > 2 and not (parts[1][0] in INTEGERS and parts[2][0] in NAME):
        raise ValueError("an array without a shape or a name")


def _elements(data: memoryview, order: str, padded: bool = True) -> Iterator[tuple[int, memoryview]]:
    """Yield the type and the content of each element; compressed ones are not padded to eight bytes."""
    at, tag = 0, struct.Struct(f"{order}II").unpack_from
    while at + 8 <= len(data):
        kind, size = tag(data, at)
        if kind >> 16:  # a small one, whose content is beside its tag
            kind, size = kind & 0xFFFF, kind >> 16
            yield kind, data[at + 4 : at + 4 + min(size, 4)]
            at += 8
            continue
        if at + 8 + size > len(data):
            raise ValueError("an element that is longer than what holds it")
        yield kind, data[at + 8 : at + 8 + size]
        at += 8 + (-(-size // 8) * 8 if padded else size)
