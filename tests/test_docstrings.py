"""Docstrings are numpydoc, say what is true of the signature, and their examples run."""

import doctest
import importlib
import inspect
import pkgutil
from collections.abc import Iterator
from pydoc import locate

import pytest
from numpydoc.validate import validate

import unconstrain

MODULES = [
    name
    for _, name, _ in pkgutil.walk_packages(unconstrain.__path__, "unconstrain.")
    if "__main__" not in name
]

# Left to the writer: an extended summary, a list of related functions, an example.
OPTIONAL = {"ES01", "SA01", "EX01"}
# Held for every docstring: parameters that do not exist or stand in another order, sections unknown or misplaced.
UNTRUE = {"PR02", "PR03", "PR10", "GL06", "GL07"}


def described(module: str) -> Iterator[str]:
    """The functions and classes that a module offers, and the methods of its classes, each where it is defined."""
    offered = importlib.import_module(module)
    names = getattr(offered, "__all__", None) or [
        name
        for name, thing in vars(offered).items()
        if not name.startswith("_") and getattr(thing, "__module__", None) == module
    ]
    for thing in (getattr(offered, name) for name in names):
        members = [value for name, value in inspect.getmembers(thing) if not name.startswith("_")]
        for each in [thing, *members] if inspect.isclass(thing) else [thing]:
            each = getattr(each, "fget", each)
            if points_to_base(thing, each):
                continue
            ours = str(getattr(each, "__module__", "")).startswith("unconstrain")
            if ours and (inspect.isclass(each) or inspect.isroutine(each)):
                yield f"{each.__module__}.{each.__qualname__}"


def points_to_base(cls: object, method: object) -> bool:
    """Whether a method says what it does, and for the rest names that of a base class, which is checked."""
    name, text = getattr(method, "__name__", ""), getattr(method, "__doc__", None) or ""
    bases = inspect.getmro(cls)[1:] if inspect.isclass(cls) else ()
    return any(text.endswith(f"ee `{base.__name__}.{name}`.") and name in vars(base) for base in bases)


def public() -> list[str]:
    """All that `import unconstrain` offers, modules looked into."""
    modules = [getattr(unconstrain, name) for name in unconstrain.__all__]
    opened = ["unconstrain", *(module.__name__ for module in modules if inspect.ismodule(module))]
    return sorted({name for module in opened for name in described(module)})


def faults(name: str, codes: set[str] | None = None) -> list[str]:
    """What numpydoc finds wrong with a docstring."""
    # The signature of a protocol, (*args, **kwargs), is not what implements it.
    optional = OPTIONAL | ({"PR01"} if getattr(locate(name), "_is_protocol", False) else set())
    found = validate(name)["errors"]
    return [f"{code} {text}" for code, text in found if code not in optional and code in (codes or {code})]


@pytest.mark.parametrize("name", MODULES)
def test_examples_in_docstrings_do_what_they_say(name):
    assert doctest.testmod(importlib.import_module(name)).failed == 0


@pytest.mark.parametrize("name", public())
def test_public_names_are_documented_in_full(name):
    assert faults(name) == []


@pytest.mark.parametrize("module", MODULES)
def test_no_docstring_speaks_of_parameters_that_are_not_there(module):
    assert {name: wrong for name in described(module) if (wrong := faults(name, UNTRUE))} == {}
