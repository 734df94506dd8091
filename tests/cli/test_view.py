"""`unconstrain view`: the address, the line for SSH, the end by Ctrl-C; a mistake is one sentence."""

import os
import signal
import socket
import subprocess
import sys
import urllib.request

import pytest

from unconstrain.limit_cycle import demonstrate
from unconstrain.recordings.text import write_csv


@pytest.fixture
def files(policy, tmp_path):
    recording = tmp_path / "recorded.csv"
    write_csv(demonstrate(3, random_state=0), recording)
    return policy, recording, "--state", "x1,x2", "--action", "u1,u2", "--time", "t", "--episode", "episode"


@pytest.mark.skipif(os.name == "nt", reason="Ctrl-C is another thing there")
def test_it_says_where_the_page_is_and_ctrl_c_ends_it_well(files):
    pytest.importorskip("viser")
    program = subprocess.Popen(
        [sys.executable, "-m", "unconstrain", "view", *map(str, files), "--port", "0"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # A shell that runs tests in the background would have them ignore Ctrl-C.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    try:
        lines = []
        while not lines or not lines[-1].startswith("Ctrl-C"):
            lines.append(program.stdout.readline())
            assert lines[-1], program.stderr.read()
        port = next(line.rstrip() for line in lines if line.startswith("page: ")).rpartition(":")[2]
        with urllib.request.urlopen(f"http://127.0.0.1:{port}", timeout=5) as answer:
            assert b"<html" in answer.read()
        assert any(f"ssh -L {port}:localhost:{port}" in line for line in lines)
        program.send_signal(signal.SIGINT)
        out, error = program.communicate(timeout=20)
    finally:
        program.kill()
    assert (program.returncode, out, error) == (0, "", "")


def test_mistakes_are_sentences(files, run):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        code, _, error = run("view", *files, "--port", port)
    assert code == 2
    assert "choose another with --port, or --port 0" in error
    assert len(error.splitlines()) == 1
    code, _, error = run("view", *files, "--port", 0, "--shown", "x1,height")
    assert code == 2
    assert "there is no state height for --shown: there are x1, x2" in error
