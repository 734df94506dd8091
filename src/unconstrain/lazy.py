"""Names of a package that are imported when they are first used (PEP 562)."""

from collections.abc import Callable, Mapping
from importlib import import_module
from sys import modules


def attach(
    package: str, homes: Mapping[str, tuple[str, ...]], namespaces: Mapping[str, str] | None = None
) -> tuple[Callable[[str], object], Callable[[], list[str]]]:
    """Make the `__getattr__` and `__dir__` of a package whose names are imported on first use.

    The package also imports the same names below ``if TYPE_CHECKING:``, where type checkers and editors read them.

    Parameters
    ----------
    package : str
        The package's `__name__`.
    homes : mapping
        The names that each module defines, by the module's full name.
    namespaces : mapping, optional
        Modules that are themselves names of the package: the module's full name by the name it has here.

    Returns
    -------
    getattr, dir : callable
        To be bound to `__getattr__` and `__dir__` at the top level of the package.
    """
    home_of = {name: home for home, names in homes.items() for name in names}
    namespaces = dict(namespaces or {})

    def __getattr__(name: str) -> object:
        if name in home_of:
            value = getattr(import_module(home_of[name]), name)
        elif name in namespaces:
            value = import_module(namespaces[name])
        else:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        setattr(modules[package], name, value)
        return value

    def __dir__() -> list[str]:
        return sorted({*vars(modules[package]).get("__all__", ()), *home_of, *namespaces})

    return __getattr__, __dir__
