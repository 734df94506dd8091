"""The version and the day of its release are said in several files, and are the same in all of them."""

import re
from importlib import metadata
from pathlib import Path

import unconstrain

ROOT = Path(__file__).parents[1]


def test_the_version_and_its_date_agree_everywhere():
    version = unconstrain.__version__
    assert metadata.version("unconstrain") == version  # which the build takes from the package
    citation = (ROOT / "CITATION.cff").read_text()
    (cited,) = re.findall(r"^version: (.+)$", citation, re.MULTILINE)
    (released,) = re.findall(r'^date-released: "(.+)"$', citation, re.MULTILINE)
    newest = re.search(r"^## (\S+) \((.+)\)$", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)
    assert newest is not None
    assert (cited, newest[1], newest[2]) == (version, version, released)
