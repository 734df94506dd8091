import doctest
import importlib
import pkgutil

import pytest

import unconstrain

MODULES = [
    name
    for _, name, _ in pkgutil.walk_packages(unconstrain.__path__, "unconstrain.")
    if "__main__" not in name
]


@pytest.mark.parametrize("name", MODULES)
def test_examples_in_docstrings_do_what_they_say(name):
    assert doctest.testmod(importlib.import_module(name)).failed == 0
