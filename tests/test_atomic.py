"""Writing whole or not at all: nothing half, nothing left behind, and one sentence where it cannot be."""

import os
import resource
import signal
import subprocess
import sys

import numpy as np
import pytest

from unconstrain import atomic
from unconstrain.errors import UnconstrainError


def test_a_file_is_moved_into_place_when_it_is_whole(tmp_path):
    target = tmp_path / "out.txt"
    with atomic.replacing(target) as temporary:
        assert temporary.suffix == ".txt"
        assert temporary.parent == tmp_path
        temporary.write_text("new")
        assert not target.exists()
    assert target.read_text() == "new"
    assert list(tmp_path.iterdir()) == [target]


def test_names_may_be_as_long_as_the_file_system_takes_them(tmp_path):
    target = tmp_path / ("é" * 125 + ".txt")
    with atomic.replacing(target) as temporary:
        temporary.write_text("new")
    assert target.read_text() == "new"


@pytest.mark.parametrize("trouble", [RuntimeError, KeyboardInterrupt])
def test_any_exception_leaves_the_old_file(tmp_path, trouble):
    target = tmp_path / "out.txt"
    target.write_text("old")

    def interrupted():
        with atomic.replacing(target) as temporary:
            temporary.write_text("half")
            raise trouble

    with pytest.raises(trouble):
        interrupted()
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


def test_links_are_followed_and_the_mode_is_kept(tmp_path):
    real, link = tmp_path / "real.txt", tmp_path / "link.txt"
    real.write_text("old")
    real.chmod(0o640)
    link.symlink_to(real)
    with atomic.replacing(link) as temporary:
        temporary.write_text("new")
    assert link.is_symlink()
    assert real.read_text() == "new"
    assert real.stat().st_mode & 0o777 == 0o640


KILLED = """
import os, signal, sys
from unconstrain import atomic
with atomic.replacing(sys.argv[1]) as temporary:
    temporary.write_text("half")
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_what_a_killed_process_left_is_removed_with_the_next_writing(tmp_path):
    target, other = tmp_path / "a*[b].txt", tmp_path / "a-b.txt"
    for each in (target, other):
        killed = subprocess.run([sys.executable, "-c", KILLED, str(each)], check=False)
        assert killed.returncode == -signal.SIGKILL
    left = {path.name for path in tmp_path.iterdir()}
    assert len(left) == 2
    assert all(".unconstrain-" in name for name in left)
    with atomic.replacing(target) as temporary, atomic.replacing(target) as at_once:
        assert temporary.exists()
        assert at_once.exists()
    assert {path.name for path in tmp_path.iterdir()} == {target.name} | {
        name for name in left if name.startswith(".a-b.")
    }


@pytest.mark.parametrize(
    ("path", "sentence"),
    [
        ("a/b.txt", "there is no folder .*, so make it first"),
        (".", "is not a file, so choose another name"),
        ("pipe", "is not a file"),
        ("/dev/full", "is not a file"),
        ("/dev/null", "is not a file"),
        ("a\0b", "null"),
        ("x" * 300, "file name too long"),
        ("~nobody-of-that-name/a", "cannot write"),
    ],
)
def test_what_cannot_be_written_is_told_before_the_work(tmp_path, monkeypatch, path, sentence):
    monkeypatch.chdir(tmp_path)
    os.mkfifo("pipe")
    for ask in (atomic.check_writable, lambda path: atomic.replacing(path).__enter__()):
        with pytest.raises(UnconstrainError, match=sentence) as caught:
            ask(path)
        assert "\n" not in str(caught.value)
    assert os.listdir(tmp_path) == ["pipe"]


def test_a_folder_that_may_not_be_written_to_is_told(tmp_path, monkeypatch):
    def refuse(*_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(os, "open", refuse)
    with pytest.raises(UnconstrainError, match="permission denied"), atomic.replacing(tmp_path / "b.txt"):
        pass


def test_a_full_disk_is_told_and_the_old_file_stays(tmp_path):
    target = tmp_path / "out.npz"
    target.write_text("old")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    ignored = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, before[1]))
    try:
        with (
            pytest.raises(UnconstrainError, match=r"cannot write .*out.npz: file too large"),
            atomic.replacing(target) as temporary,
        ):
            np.savez(temporary, a=np.zeros(10_000))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, ignored)
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]
