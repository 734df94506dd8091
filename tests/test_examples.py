"""Every example says for whom it is, has cells, and makes one picture; `make docs` runs them."""

import ast
import re
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).parents[1] / "examples").glob("*.py"))
HEADER = Path(__file__).parents[1] / "examples" / "GALLERY_HEADER.rst"


def calls(tree, names):
    """The calls of functions that are called so, whatever they belong to."""
    return [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in names
    ]


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_the_example_says_who_would_want_it(example):
    text = example.read_text(encoding="utf-8")
    title, rule, _, paragraph, *_ = ast.get_docstring(ast.parse(text)).splitlines()
    assert set(rule) == {"="}
    assert len(rule) == len(title)
    assert paragraph.startswith("For ")
    assert "\n# %%\n" in text


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_the_example_makes_one_picture_and_names_it_after_itself(example):
    text = example.read_text(encoding="utf-8")
    if "matplotlib" not in text:
        pytest.skip("it draws nothing")
    tree = ast.parse(text)
    pyplot = [call for call in calls(tree, {"subplots", "figure"}) if ast.unparse(call.func.value) == "plt"]
    assert len(pyplot) == 1
    for saved in calls(tree, {"savefig"}):
        assert ast.literal_eval(saved.args[0]) == f"{example.stem}.png"


def test_there_are_at_least_fifteen_and_the_header_names_none_besides():
    assert len(EXAMPLES) >= 15
    header = HEADER.read_text(encoding="utf-8")
    named = set(re.findall(r"</gallery/(\w+)>", header))
    assert named
    assert named <= {example.stem for example in EXAMPLES}
