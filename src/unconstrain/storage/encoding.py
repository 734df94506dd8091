"""Objects as a tree of plain values and named arrays, and back again.

| value                                     | in the tree                                       |
| ----------------------------------------- | ------------------------------------------------- |
| None, bool, int, str, finite float, list  | themselves                                        |
| inf, nan                                  | `{"float": "inf"}`                                |
| tuple                                     | `{"tuple": [...]}`                                |
| dict                                      | `{"dict": [[key, value], ...]}`                   |
| slice                                     | `{"slice": [start, stop, step]}`                  |
| NumPy scalar                              | `{"number": ["float32", 0.5]}`                    |
| array of numbers, booleans or text        | `{"array": "coef_"}`, the name of its file        |
| array (N,) of objects                     | `{"objects": [...]}`                              |
| NumPy type, Python's number types, dtype  | `{"type": "float64"}`, `{"dtype": "float64"}`     |
| `scipy.interpolate.BSpline`               | `{"spline": [t, c, k, extrapolate, axis]}`        |
| NumPy's `RandomState`, `Generator`        | `{"random": [kind, state]}`                       |
| object of a class                         | `{"object": ["unconstrain.NormalizedRBF", state]}`|
| a function or class of the user's own     | `{"trusted": "module:name"}`                      |
| a regressor of anyone's, by skops         | `{"skops": name of the bytes}`                    |

An object is restored from its state without its constructor. Its class comes from the closed list of
`unconstrain.storage.classes`, or from what the caller trusts; a name that is in neither is refused.
"""

import math
import re
from collections.abc import Callable, Iterable, Iterator
from types import BuiltinFunctionType, FunctionType, MethodType
from typing import Any

import numpy as np

from unconstrain.errors import UnconstrainError
from unconstrain.storage.archive import is_storable
from unconstrain.storage.classes import check_restored, class_of, name_of, without_circumstances
from unconstrain.storage.estimators import dump, is_foreign_regressor, list_types, restore

DEEPEST = 60
"""Containers and objects within each other, at most."""

_NUMBERS = {
    name: getattr(np, name)
    for name in (
        "bool", "int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64", "float16", "float32",
        "float64",
    )
}  # fmt: skip
_TYPES: dict[str, type] = _NUMBERS | {f"python.{each.__name__}": each for each in (bool, int, float, str)}
_NAMES_OF_TYPES = {each: name for name, each in _TYPES.items()}

_ATTRIBUTE = re.compile(r"(?!__)\w{1,200}")


class UntrustedError(Exception):
    """A file holds classes or functions that are neither listed nor trusted; `names` says which."""

    def __init__(self, names: list[str]) -> None:
        super().__init__(", ".join(names))
        self.names = names


def encode(value: Any) -> tuple[Any, dict[str, np.ndarray]]:
    """Take an object apart.

    Parameters
    ----------
    value : object
        Anything in the table above.

    Returns
    -------
    tree : JSON value
    arrays : dict of str to ndarray
        By the names that the tree calls them by.

    Raises
    ------
    UnconstrainError
        The object holds something that cannot be saved.
    """
    encoder = _Encoder()
    return encoder.encoded(value, ""), encoder.arrays


def foreign_parts(value: Any) -> list[Any]:
    """List the classes and functions in an object that are not unconstrain's or scikit-learn's.

    Parameters
    ----------
    value : object

    Returns
    -------
    list of class or function
        What has to be trusted to read the object back.

    Raises
    ------
    UnconstrainError
        The object holds something that cannot be saved.
    """
    encoder = _Encoder()
    encoder.encoded(value, "")
    return list(encoder.foreign.values())


def decode(tree: Any, arrays: dict[str, np.ndarray], trusted: Iterable[Any] = ()) -> Any:
    """Put an object together again.

    Parameters
    ----------
    tree : JSON value
    arrays : dict of str to ndarray
        As `encode` returned them. Arrays are not copied.
    trusted : classes and functions, or str, optional
        What the object may hold besides the listed classes; parts of regressors also by name, "package.module.Class".

    Returns
    -------
    object

    Raises
    ------
    UntrustedError
        The object holds classes or functions that are not trusted. Nothing is put together then.
    Exception
        The tree is not one that `encode` returned; there is no telling what is raised then.
    """
    given = list(trusted)
    known = {qualified_name(each): each for each in given if not isinstance(each, str)}
    named = {each for each in given if isinstance(each, str)} | {each.replace(":", ".") for each in known}
    unknown = [
        name
        for name, listable in dict.fromkeys(_names(tree))
        if not (listable and class_of(name) is not None) and _match(name, known) is None
    ]
    unknown += [
        name
        for content in dict.fromkeys(_regressors(tree))
        for name in list_types(arrays[content])
        if name not in named
    ]
    if unknown:
        raise UntrustedError(list(dict.fromkeys(unknown)))
    return _Decoder(arrays, known, named).decoded(tree)


def qualified_name(what: Any) -> str:
    """Name a class, function or method as it is trusted by: ``"module:name"``.

    Parameters
    ----------
    what : class or function

    Returns
    -------
    str

    Raises
    ------
    UnconstrainError
        It has no name.
    """
    if isinstance(what, np.ufunc):
        return f"numpy:{what.__name__}"
    name = getattr(what, "__qualname__", None)
    if not isinstance(what, type | FunctionType | BuiltinFunctionType | MethodType) or name is None:
        raise UnconstrainError(f"trusted= takes classes and functions themselves, got {what!r:.80}")
    return f"{what.__module__}:{name}"


def _match(name: str, known: dict[str, Any]) -> Any:
    """Find what is trusted under a name. What a script defines has another module where the script is imported."""
    if name in known:
        return known[name]
    module, _, own = name.partition(":")
    for each, value in known.items():
        other, _, its = each.partition(":")
        if its == own and "__main__" in (module, other):
            return value
    return None


def _names(tree: Any) -> Iterator[tuple[str, bool]]:
    """Walk over the names of classes and functions in a tree; the flag tells those of objects' classes."""
    waiting = [tree]
    while waiting:
        node = waiting.pop()
        if isinstance(node, list):
            waiting.extend(node)
        elif isinstance(node, dict):
            waiting.extend(node.values())
            named = node.get("object")
            if isinstance(node.get("trusted"), str):
                yield node["trusted"], False
            elif isinstance(named, list) and named and isinstance(named[0], str):
                yield named[0], True


def _regressors(tree: Any) -> Iterator[str]:
    """Walk over the names of arrays that hold regressors."""
    waiting = [tree]
    while waiting:
        node = waiting.pop()
        if isinstance(node, list):
            waiting.extend(node)
        elif isinstance(node, dict):
            waiting.extend(node.values())
            if isinstance(node.get("skops"), str):
                yield node["skops"]


class _Encoder:
    """Collects arrays, and classes and functions that are not listed, while a tree is built."""

    def __init__(self) -> None:
        self.arrays: dict[str, np.ndarray] = {}
        self.foreign: dict[str, Any] = {}
        self._named: dict[int, str] = {}
        self._dumped: dict[int, np.ndarray] = {}

    def encoded(self, value: Any, where: str, depth: int = 0) -> Any:
        if depth > DEEPEST:
            raise _unsavable(where, f"it holds itself, or more than {DEEPEST} objects within each other")
        encoder = _ENCODERS.get(type(value))
        if encoder is None:
            encoder = next(
                (each for kind, each in _ENCODERS_OF_KINDS if isinstance(value, kind)), _Encoder.of_object
            )
        return encoder(self, value, where, depth + 1)

    def of_plain(self, value: Any, where: str, depth: int) -> Any:
        if isinstance(value, str):
            try:
                value.encode()
            except UnicodeEncodeError:
                raise _unsavable(where, f"the text {value!r:.40} is not Unicode") from None
        if isinstance(value, int) and value.bit_length() > 1024:
            raise _unsavable(where, f"the number has {value.bit_length()} bits")
        return value

    def of_float(self, value: float, where: str, depth: int) -> Any:
        return float(value) if math.isfinite(value) else {"float": str(float(value))}

    def of_list(self, value: list[Any], where: str, depth: int) -> Any:
        return [self.encoded(each, f"{where}.{i}", depth) for i, each in enumerate(value)]

    def of_tuple(self, value: tuple[Any, ...], where: str, depth: int) -> Any:
        return {"tuple": self.of_list(list(value), where, depth)}

    def of_dict(self, value: dict[Any, Any], where: str, depth: int) -> Any:
        pairs = []
        for key, each in value.items():
            if not isinstance(key, str | int | float | None):
                raise _unsavable(where, f"a key of it is {key!r:.40}, not a number or text")
            pairs.append([self.encoded(key, where, depth), self.encoded(each, f"{where}.{key}", depth)])
        return {"dict": pairs}

    def of_slice(self, value: slice, where: str, depth: int) -> Any:
        return {"slice": self.of_list([value.start, value.stop, value.step], where, depth)}

    def of_scalar(self, value: np.generic, where: str, depth: int) -> Any:
        if isinstance(value, np.str_):
            return str(value)
        if value.dtype.name not in _NUMBERS:
            raise _unsavable_type(where, value)
        return {"number": [value.dtype.name, self.encoded(value.item(), where, depth)]}

    def of_array(self, value: np.ndarray, where: str, depth: int) -> Any:
        if value.dtype == object and value.ndim == 1:
            return {"objects": self.of_list(value.tolist(), where, depth)}
        if not is_storable(value.dtype):
            raise _unsavable(where, f"it is an array of type {value.dtype}")
        if id(value) not in self._named:
            wanted = re.sub(r"[^A-Za-z0-9_.-]", "_", where).strip(".")[:150] or "array"
            name, number = wanted, 1
            while name in self.arrays:
                number += 1
                name = f"{wanted}-{number}"
            self.arrays[name] = value
            self._named[id(value)] = name
        return {"array": self._named[id(value)]}

    def of_type(self, value: type, where: str, depth: int) -> Any:
        if value in _NAMES_OF_TYPES:
            return {"type": _NAMES_OF_TYPES[value]}
        return {"trusted": self._foreign(value)}

    def of_dtype(self, value: "np.dtype[Any]", where: str, depth: int) -> Any:
        if value.name not in _NUMBERS:
            raise _unsavable_type(where, value)
        return {"dtype": value.name}

    def of_function(self, value: Any, where: str, depth: int) -> Any:
        if "<lambda>" in getattr(value, "__qualname__", ""):
            raise _unsavable(
                where, "a lambda has no name by which it could be found again; define it with def"
            )
        return {"trusted": self._foreign(value)}

    def _foreign(self, value: Any) -> str:
        name = qualified_name(value)
        self.foreign[name] = value
        return name

    def of_random_state(self, value: np.random.RandomState, where: str, depth: int) -> Any:
        return {"random": ["RandomState", self.encoded(value.get_state(legacy=False), where, depth)]}

    def of_generator(self, value: np.random.Generator, where: str, depth: int) -> Any:
        if not isinstance(value.bit_generator, np.random.PCG64):
            raise _unsavable_type(where, value.bit_generator)
        return {"random": ["PCG64", self.encoded(value.bit_generator.state, where, depth)]}

    def of_object(self, value: Any, where: str, depth: int) -> Any:
        cls = type(value)
        if _is_spline(value):
            parts = {"t": value.t, "c": value.c, "k": int(value.k), "extrapolate": value.extrapolate}
            parts["axis"] = int(value.axis)
            return {"spline": [self.encoded(part, f"{where}.{key}", depth) for key, part in parts.items()]}
        by_state = cls.__reduce__ is object.__reduce__ and cls.__reduce_ex__ is object.__reduce_ex__
        if not (by_state and hasattr(value, "__dict__")):
            raise _unsavable_type(where, value)
        listed = name_of(cls)
        if listed is None and is_foreign_regressor(value):
            if id(value) not in self._dumped:
                self._dumped[id(value)] = dump(value)
            return {"skops": self.of_array(self._dumped[id(value)], where, depth)["array"]}
        state = value.__getstate__()
        if listed is not None:
            state = without_circumstances(listed, state)
        if isinstance(state, dict):
            encoded: Any = {key: self.encoded(each, f"{where}.{key}", depth) for key, each in state.items()}
        else:
            encoded = [self.encoded(state, where, depth)]
        return {"object": [listed or self._foreign(cls), encoded]}


_Encode = Callable[[_Encoder, Any, str, int], Any]
_ENCODERS: dict[type, _Encode] = {
    **dict.fromkeys((type(None), bool, int, str), _Encoder.of_plain),
    float: _Encoder.of_float,
    list: _Encoder.of_list,
    tuple: _Encoder.of_tuple,
    dict: _Encoder.of_dict,
    slice: _Encoder.of_slice,
    np.ndarray: _Encoder.of_array,
    np.random.RandomState: _Encoder.of_random_state,
    np.random.Generator: _Encoder.of_generator,
}
_ENCODERS_OF_KINDS: list[tuple[Any, _Encode]] = [
    (np.generic, _Encoder.of_scalar),
    (np.dtype, _Encoder.of_dtype),
    (type, _Encoder.of_type),
    (FunctionType | BuiltinFunctionType | MethodType | np.ufunc, _Encoder.of_function),
]


class _Decoder:
    def __init__(self, arrays: dict[str, np.ndarray], known: dict[str, Any], named: set[str]) -> None:
        self.arrays, self.known, self.named = arrays, known, named

    def decoded(self, node: Any) -> Any:
        if isinstance(node, list):
            return [self.decoded(each) for each in node]
        if not isinstance(node, dict):
            return node
        ((tag, content),) = node.items()
        return _DECODERS[tag](self, content)

    def of_float(self, content: str) -> float:
        return {"inf": math.inf, "-inf": -math.inf, "nan": math.nan}[content]

    def of_tuple(self, content: list[Any]) -> tuple[Any, ...]:
        return tuple(self.decoded(content))

    def of_dict(self, content: list[list[Any]]) -> dict[Any, Any]:
        return {self.decoded(key): self.decoded(value) for key, value in content}

    def of_slice(self, content: list[Any]) -> slice:
        start, stop, step = content
        return slice(start, stop, step)

    def of_scalar(self, content: list[Any]) -> np.generic:
        name, value = content
        number = self.decoded(value)
        if not isinstance(number, bool | int | float):
            raise TypeError(f"{number!r:.40} is not a number")
        return _NUMBERS[name](number)

    def of_array(self, content: str) -> np.ndarray:
        return self.arrays[content]

    def of_objects(self, content: list[Any]) -> np.ndarray:
        array = np.empty(len(content), dtype=object)
        for i, each in enumerate(content):
            array[i] = self.decoded(each)
        return array

    def of_type(self, content: str) -> type:
        return _TYPES[content]

    def of_dtype(self, content: str) -> "np.dtype[Any]":
        return np.dtype(_NUMBERS[content])

    def of_spline(self, content: list[Any]) -> Any:
        from scipy.interpolate import BSpline

        t, c, k, extrapolate, axis = (self.decoded(each) for each in content)
        return BSpline(t, c, k, extrapolate=extrapolate, axis=axis)  # which checks them

    def of_random(self, content: list[Any]) -> np.random.RandomState | np.random.Generator:
        kind, state = content[0], self.decoded(content[1])
        if kind == "PCG64":
            generator = np.random.default_rng(0)
            generator.bit_generator.state = state
            return generator
        inner = state["state"]
        # NumPy trusts both, and reads past the end of the key where the position is beyond it.
        if inner["key"].shape != (624,) or inner["key"].dtype != np.uint32 or not 0 <= inner["pos"] <= 624:
            raise ValueError("the state of a random generator is not one")
        random = np.random.RandomState(0)
        random.set_state(state)
        return random

    def of_regressor(self, content: str) -> Any:
        return restore(self.arrays[content], self.named)

    def of_trusted(self, content: str) -> Any:
        return _match(content, self.known)

    def of_object(self, content: list[Any]) -> Any:
        name, state = content
        listed = class_of(name)
        cls = listed or _match(name, self.known)
        if not isinstance(cls, type):
            raise TypeError(f"{name:.80} is not a class")
        made: Any = object.__new__(cls)
        restored: Any
        if isinstance(state, dict):
            if not all(_ATTRIBUTE.fullmatch(key) for key in state):
                raise ValueError("a state has attributes that have no name")
            restored = {key: self.decoded(value) for key, value in state.items()}
        else:
            (restored,) = self.decoded(state)
        if listed is not None:
            restored = without_circumstances(name, restored)
            shadowed = [key for key in state if callable(getattr(cls, key, None))]
            if shadowed:
                raise ValueError(f"it gives a {cls.__name__} another {shadowed[0]}")
        if hasattr(made, "__setstate__"):
            made.__setstate__(restored)
        elif restored is not None:
            made.__dict__.update(restored)
        if listed is not None:
            check_restored(made)
        return made


_DECODERS: dict[str, Callable[[_Decoder, Any], Any]] = {
    "float": _Decoder.of_float,
    "tuple": _Decoder.of_tuple,
    "dict": _Decoder.of_dict,
    "slice": _Decoder.of_slice,
    "number": _Decoder.of_scalar,
    "array": _Decoder.of_array,
    "objects": _Decoder.of_objects,
    "type": _Decoder.of_type,
    "dtype": _Decoder.of_dtype,
    "spline": _Decoder.of_spline,
    "random": _Decoder.of_random,
    "skops": _Decoder.of_regressor,
    "trusted": _Decoder.of_trusted,
    "object": _Decoder.of_object,
}


def _is_spline(value: Any) -> bool:
    if type(value).__name__ != "BSpline":
        return False
    from scipy.interpolate import BSpline

    return type(value) is BSpline


def _unsavable_type(where: str, value: Any) -> UnconstrainError:
    kind = f"{type(value).__module__}.{type(value).__qualname__}".removeprefix("builtins.")
    return _unsavable(
        where,
        f"it is a {kind}, and files hold arrays, numbers, text, containers of them, and objects made of these",
    )


def _unsavable(where: str, why: str) -> UnconstrainError:
    return UnconstrainError(f"cannot save {where.strip('.') or 'this':.100}: {why}")
