"""Numbers, texts and arrays that programs stumble over."""

import os
from pathlib import Path
from typing import Any

import numpy as np

NUMBERS: list[Any] = [
    0, -1, 1, 2, 1.5, 0.0, -0.0, float("nan"), float("inf"), float("-inf"), 1e308, -1e308, 1e-320, 1e-200, 1e160, 1e13,
    10**9, 2**31, 2**63, 2**64, 10**400, -(2**63), True, False, None, 1 + 2j, np.float16(3), np.float32(1e30),
    np.int8(-5), np.uint64(2**64 - 1), np.bool_(True), np.float64("nan"), np.datetime64("2024-01-01"),
]  # fmt: skip
TEXTS: list[Any] = [
    "", " ", "cv", "auto", "0", "-1", "nan", "1e400", "[/red]", "[bold]x", "\x1b[31mred\x1b[0m", "a\nb", "a\0b", "λ",
    "\ud800", "日本", "x" * 300, "-x", "--out", "'", '"', "a,b", "%s", "{0}", "../x", "~nobody/x", "\u202eabc", "x=1",
]  # fmt: skip
OBJECTS: list[Any] = [
    [], {}, (), set(), object(), b"bytes", [[]], [None], [[1], [1, 2]], {"a": 1}, np.eye(2), np.array([]),
    ["x", "x"], [0, 0], [-1], [True], np.array(None), range(3), iter([1, 2]), Path("/"), slice(None), 1j,
]  # fmt: skip
CELLS: list[str] = [
    "", " ", "nan", "NaN", "NULL", "inf", "-inf", "1e308", "-1e308", "1e-320", "1e400", "9" * 400, "1,5", "1.050,5",
    "0x10", "1_000", "True", "x", '"', '""', "'", "\0", "\x1b[2J", "[/red]", "1;2", "1\t2", "2024-01-01", "λ", "#",
    "1e", "٣", "１", "--5", "+-5", "1 2", "9223372036854775808", "1e-400", "-0", "=1+1", "\u200b1",
    "\ufeff1", "NaT", "None",
]  # fmt: skip


def pick(rng: np.random.Generator, options: Any) -> Any:
    """One of some options, as it is."""
    return options[int(rng.integers(len(options)))]


def anything(rng: np.random.Generator) -> Any:
    """A value of any kind."""
    pool = pick(rng, (NUMBERS, NUMBERS, TEXTS, OBJECTS))
    return pick(rng, pool)


def spoiled(rng: np.random.Generator, array: Any) -> Any:
    """An array in which something is wrong, or something of another kind."""
    array = np.atleast_1d(np.array(array, dtype=np.float64))
    some = tuple(int(rng.integers(max(1, n))) for n in array.shape)
    numbers = (np.nan, np.inf, -np.inf, 1e300, -1e308, 1e160, 1e-200, 1e-320, 0.0, 1e13, 1e8, -1.0)
    ways = [
        lambda: array.T, lambda: array[:0], lambda: array[:1], lambda: array[:2], lambda: array[:-1],
        lambda: array.ravel(), lambda: array[None], lambda: array[..., None], lambda: array[..., :0],
        lambda: array * 0.0, lambda: array * 1e160, lambda: array * 1e308, lambda: array * 1e-200,
        lambda: array * 1e-320, lambda: array * 1e20, lambda: array + 1e15, lambda: array * 1e-10,
        lambda: array * 0.0 + 1.0, lambda: np.repeat(array[:1], len(array), axis=0), lambda: -array,
        lambda: array.astype(np.float16), lambda: array.astype(np.float32), lambda: array.astype(int),
        lambda: array.astype(bool), lambda: array.astype(complex), lambda: array + 1j, lambda: array.astype(object),
        lambda: array.astype(str), lambda: array.astype("S"), lambda: array.tolist(), lambda: tuple(array.tolist()),
        lambda: np.ma.masked_array(array, mask=array > 0), lambda: np.asfortranarray(array),
        lambda: array[::-1], lambda: array.astype(">f8"), lambda: array.astype(np.longdouble),
        lambda: np.concatenate([array, array], axis=-1) if array.ndim else array,
        lambda: np.tile(array, (1,) * (array.ndim - 1) + (60,)),
        lambda: np.tile(array, (300,) + (1,) * (array.ndim - 1)),
        lambda: [array.tolist(), [1.0]], lambda: np.array([[None, 1], [2, 3]], dtype=object),
        lambda: np.array([{}] * len(array), dtype=object) if array.ndim else array,
        lambda: np.full(array.shape, np.nan), lambda: array[0] if array.ndim and len(array) else array,
        lambda: np.array("x"), lambda: array.astype("M8[s]"), lambda: np.broadcast_to(array[..., :1], array.shape),
        lambda: np.zeros((3, 0)), lambda: np.zeros((0, 3)), lambda: np.zeros((2, 2, 2, 2)),
    ]  # fmt: skip

    def with_one() -> Any:
        changed = array.copy()
        if changed.size:
            changed[some] = pick(rng, numbers)
        return changed

    def with_row() -> Any:
        changed = array.copy()
        if changed.size:
            changed[some[:1]] = pick(rng, numbers)
        return changed

    if rng.random() < 0.1:
        return anything(rng)
    return pick(rng, [with_one, with_row] * 8 + ways)()


def shown(value: Any) -> str:
    """A value as a person would write it, cut short."""
    if isinstance(value, np.ndarray):
        return (
            f"array{value.shape} of {value.dtype}: {np.array2string(value.ravel()[:6], threshold=6)}".replace(
                "\n", " "
            )
        )
    try:
        return f"{value!r:.200}"
    except Exception as error:  # numbers with too many digits to be written
        return f"<{type(value).__name__}: {error}>"


def strange_place(rng: np.random.Generator, path: Path) -> str:
    """Put something that is no proper file at a path, and say what."""
    kind = pick(
        rng,
        ("folder", "dangling", "loop", "pipe", "empty", "zero", "null", "unreadable", "one byte", "socket"),
    )
    if path.is_dir() and not path.is_symlink():
        return "as it was"
    path.unlink(missing_ok=True)
    if kind == "folder":
        path.mkdir()
    elif kind == "dangling":
        path.symlink_to("nothing-here")
    elif kind == "loop":
        path.symlink_to(path.name)
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind in ("zero", "null"):
        path.symlink_to(f"/dev/{kind}")
    elif kind == "socket":
        import socket

        socket.socket(socket.AF_UNIX).bind(path.name if len(str(path)) > 90 else str(path))
    else:
        path.write_bytes(b"x" if kind == "one byte" else b"")
        if kind == "unreadable":
            path.chmod(0)
    return kind


def damaged(rng: np.random.Generator, content: bytes) -> bytes:
    """Bytes of which some were changed, lost, repeated or put in."""
    data = bytearray(content)
    for _ in range(int(rng.integers(1, 4))):
        at, length = int(rng.integers(len(data) + 1)), int(2 ** rng.uniform(0, 8))
        way = int(rng.integers(7))
        if way == 0:
            del data[at:]
        elif way == 1:
            del data[at : at + length]
        elif way == 2:
            data[at:at] = rng.bytes(length)
        elif way == 3:
            data[at:at] = data[at : at + length]
        elif way == 4:
            data[at : at + 1] = bytes([int(rng.integers(256))])
        elif way == 5:
            data[at : at + 4] = pick(
                rng, (b"\xff\xff\xff\xff", b"\0\0\0\0", b"\xff\xff\xff\x7f", b"\0\0\0\x80")
            )
        else:
            data[at:at] = pick(rng, CELLS).encode("utf-8", "surrogatepass")
    return bytes(data)
