"""What would not fit into memory is refused before it is allocated."""

import subprocess
import sys

import pytest

from unconstrain import memory
from unconstrain.errors import DataError

LINUX = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="which says how much memory is left")


def test_what_fits_passes_and_what_does_not_is_told(monkeypatch):
    monkeypatch.setattr(memory, "available_memory", lambda: 2e9)
    memory.check_memory(1.9e9, "the table", "read less of it")
    with pytest.raises(
        DataError, match=r"the table would take 3\.0 GB of memory, and 2\.0 GB are left: read less of it"
    ):
        memory.check_memory(3e9, "the table", "read less of it")
    monkeypatch.setattr(memory, "available_memory", lambda: None)
    memory.check_memory(1e30, "the table", "read less of it")


@LINUX
def test_the_memory_of_a_container_counts(monkeypatch, tmp_path):
    monkeypatch.setattr(memory, "CONTAINER", tmp_path)
    before = memory.available_memory()
    (tmp_path / "memory.max").write_text("max\n")
    (tmp_path / "memory.current").write_text("500\n")
    assert memory.available_memory() == pytest.approx(before, rel=0.5)
    (tmp_path / "memory.max").write_text("1500\n")
    assert memory.available_memory() == 1000.0


@LINUX
def test_the_limit_of_the_process_counts():
    code = (
        "import resource, unconstrain.memory as memory;"
        "resource.setrlimit(resource.RLIMIT_AS, (2**31, 2**31));"
        "print(memory.available_memory() < 2**31)"
    )
    assert subprocess.check_output([sys.executable, "-c", code], text=True).strip() == "True"
