import io

import pytest

from unconstrain.progress import reporting, working


def test_a_function_is_called_and_nothing_is_shown_unless_asked(capsys):
    calls = []
    with reporting(lambda done, total: calls.append((done, total))) as report:
        report(1, None)
        report(2, 4)
    assert calls == [(1, None), (2, 4)]
    for nothing in (None, False):
        with reporting(nothing) as report:
            report(1, 2)
    assert capsys.readouterr() == ("", "")


def test_a_bar_tells_what_is_done_on_standard_error(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    with reporting(True, unit="files") as report:
        report(1000, 4000)  # done by an earlier run
        report(4000, 4000)
    out, err = capsys.readouterr()
    assert out == ""
    assert "4,000 of 4,000 files" in err


@pytest.mark.parametrize("terminal", [False, True])
def test_what_goes_on_is_shown_on_terminals_only(monkeypatch, terminal):
    stream = io.StringIO()
    stream.isatty = lambda: terminal
    monkeypatch.setattr("sys.stderr", stream)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr("unconstrain.waiting.DELAY", 0.0)
    with working("reading [bold]x") as tell:
        tell("fitting [/b]y")
    assert ("fitting [/b]y" in stream.getvalue()) == terminal
