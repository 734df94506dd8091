"""The package's own names: all there, all lazy, and the same for people, editors and type checkers."""

import ast
import importlib
import inspect
import subprocess
import sys

import pytest

LAZY = ["unconstrain", "unconstrain.datasets", "unconstrain.recordings", "unconstrain.robots"]


def _python(code):
    return subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.strip()


@pytest.mark.parametrize("name", LAZY)
def test_every_public_name_is_there(name):
    package = importlib.import_module(name)
    assert set(package.__all__) <= set(dir(package))
    for public in package.__all__:
        assert getattr(package, public) is not None
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = package.nothing


@pytest.mark.parametrize("name", LAZY)
def test_type_checkers_are_told_of_the_same_names(name):
    package = importlib.import_module(name)
    tree = ast.parse(inspect.getsource(package))
    (told,) = (
        node for node in tree.body if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
    )
    places = {}
    for node in told.body:
        if isinstance(node, ast.ImportFrom):
            places |= {alias.asname or alias.name: (node.module, alias.name) for alias in node.names}
    assert set(places) == set(package.__all__)
    for public, (home, own) in places.items():
        parent = importlib.import_module(home)
        taught = getattr(parent, own) if hasattr(parent, own) else importlib.import_module(f"{home}.{own}")
        assert getattr(package, public) is taught


def test_star_import_gives_the_public_names():
    code = "from unconstrain import *; import unconstrain as uc; print(all(name in globals() for name in uc.__all__))"
    assert _python(code) == "True"


def test_importing_the_package_imports_nothing_heavy():
    code = (
        "import sys, unconstrain; unconstrain.errors; "
        "print(*{'numpy', 'scipy', 'sklearn', 'pyarrow', 'matplotlib', 'rich'} & {*sys.modules})"
    )
    assert _python(code) == ""
