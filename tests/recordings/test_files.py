"""Files that lie elsewhere."""

import time
from types import SimpleNamespace

import pytest

import unconstrain as uc
from unconstrain.recordings import files


def test_an_object_store_that_never_answers_is_waited_for_so_long(monkeypatch):
    monkeypatch.setattr(files, "ANSWER_SECONDS", 0.05)
    monkeypatch.setattr(files.pyarrow.fs, "FileSystem", SimpleNamespace(from_uri=lambda uri: time.sleep(1)))
    with pytest.raises(uc.errors.DataError, match=r"gs://nowhere/x did not answer within 0.05 s"):
        uc.open("gs://nowhere/x", state="x", action="u")
