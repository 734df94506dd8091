"""How hypothesis draws, and the fixtures that several files of tests share.

Hypothesis draws anew each time for a developer, the same examples each time in continuous integration.
"""

import os
import sys

import pyarrow.parquet as pq
import pytest
from hypothesis import settings

from unconstrain.cli import main

settings.register_profile("here", deadline=None)
settings.register_profile("ci", deadline=None, derandomize=True)
settings.load_profile("ci" if os.environ.get("CI") else "here")


@pytest.fixture
def run(monkeypatch, capsys, tmp_path):
    """Run the program in an empty folder: exit code, what it printed, what it complained."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "300")

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["unconstrain", *map(str, arguments)])
        try:
            main()
            code = 0
        except SystemExit as end:
            code = end.code or 0
        printed = capsys.readouterr()
        return code, printed.out, printed.err

    return run


@pytest.fixture
def columns_read(monkeypatch):
    """The columns asked of Parquet files, a list each time."""
    asked, reads = [], pq.ParquetFile.iter_batches

    def spied(self, *args, **kwargs):
        asked.append(kwargs.get("columns"))
        return reads(self, *args, **kwargs)

    monkeypatch.setattr(pq.ParquetFile, "iter_batches", spied)
    return asked
