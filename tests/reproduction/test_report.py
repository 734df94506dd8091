"""One page about all experiments."""

from matplotlib.figure import Figure
from rich.console import Console

from reproduction import report
from reproduction.outcome import Outcome
from reproduction.recordings import CURVED, FLAT
from unconstrain.errors import UnconstrainError


def make_outcome(picture):
    picture.parent.mkdir()
    Figure().savefig(picture)
    return Outcome(
        title="The toy",
        table="| | published | ours |\n| --- | --- | --- |\n| nUPE | 0.0027 | 0.0004 |",
        figures={picture: "The field, <learnt>"},
        choices=("width 0.6",),
        findings=("reached",),
    )


def test_one_page_shows_everything(tmp_path):
    outcome = make_outcome(tmp_path / "toy" / "field & trajectories.png")
    page = report.write_report(
        [outcome], {"arm": "MuJoCo is not installed"}, tmp_path, "python -m reproduction all"
    )
    text = page.read_text()
    for part in (
        "The toy",
        "0.0027",
        "width 0.6",
        "reached",
        "MuJoCo is not installed",
        "numpy",
        "reproduction all",
    ):
        assert part in text
    assert "](toy/field%20%26%20trajectories.png)" in text
    assert [path.name for path in tmp_path.iterdir() if path.is_file()] == ["report.md"]


def test_what_cannot_run_is_left_out_and_recordings_go_to_those_that_look_at_them(tmp_path, monkeypatch):
    asked = {}

    def find(name):
        def reproduce(out, *, trials, jobs, console, **options):
            asked[name] = options
            if name == "arm":
                raise UnconstrainError("the arm is not here")
            return Outcome(title=name, table="| x |")

        return reproduce

    monkeypatch.setattr(report, "find_experiment", find)
    for name in (FLAT, CURVED):
        (tmp_path / name).touch()
    page = report.reproduce_all(
        tmp_path / "new", trials=2, jobs=1, console=Console(quiet=True), recordings=tmp_path
    )
    assert "## arm\n\nLeft out: the arm is not here" in page.read_text()
    assert "python -m reproduction all --recordings FOLDER --trials 2" in page.read_text()
    assert {name: [*options] for name, options in asked.items() if options} == {
        name: [option] for name, option in report.RECORDED.items()
    }
    assert asked["adaptive"] == {"data": tmp_path}
    assert asked["toy"] == {}
    asked.clear()
    page = report.reproduce_all(
        tmp_path / "few", trials=None, jobs=1, console=Console(quiet=True), only=("posture", "toy")
    )
    assert list(asked) == ["toy", "posture"]
    assert "`python -m reproduction all --only posture --only toy`" in page.read_text()
