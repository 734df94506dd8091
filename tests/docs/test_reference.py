"""The reference lists every public name, and none besides."""

import inspect
import re
from pathlib import Path

import pytest

import unconstrain as uc

PAGES = Path(__file__).parents[2] / "docs" / "api"
PACKAGES = [name for name in uc.__all__ if inspect.ismodule(getattr(uc, name))]


def listed(page):
    """The names below the page's `autosummary` directives."""
    lists = re.findall(
        r"\.\. autosummary::\n(?:   :.*\n)*\n((?:   \S.*\n)+)", page.read_text(encoding="utf-8")
    )
    return {name for each in lists for name in each.split()}


def offered(module):
    """What a module offers: `__all__`, or what it defines itself."""
    own = [
        name
        for name, thing in vars(module).items()
        if not name.startswith("_") and getattr(thing, "__module__", None) == module.__name__
    ]
    return set(getattr(module, "__all__", own))


def test_every_name_at_the_top_is_listed():
    assert listed(PAGES / "index.rst") == {name for name in uc.__all__ if name not in PACKAGES}


@pytest.mark.parametrize("package", PACKAGES)
def test_every_name_of_the_package_is_listed(package):
    # What stands in the first page already is described there.
    module = getattr(uc, package)
    names = {name for name in offered(module) if getattr(uc, name, None) is not getattr(module, name)}
    assert listed(PAGES / f"{package}.rst") == names
    assert re.search(
        rf"^   {package}$", (PAGES / "index.rst").read_text(encoding="utf-8"), flags=re.MULTILINE
    )
