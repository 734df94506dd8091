from pathlib import Path

from matplotlib.figure import Figure

from reproduction import report
from reproduction.outcome import Outcome


def test_one_page_shows_everything_and_the_html_stands_alone(tmp_path):
    picture = tmp_path / "toy" / "field & trajectories.png"
    picture.parent.mkdir()
    Figure().savefig(picture)
    outcome = Outcome(
        title="The toy",
        table="| | published | ours |\n| --- | --- | --- |\n| nUPE | 0.0027 | 0.0004 |",
        figures={picture: "The field, <learnt>"},
        choices=("width 0.6",),
        findings=("reached",),
    )
    report.write([outcome], {"arm": "MuJoCo is not installed"}, tmp_path, "unconstrain reproduce all")
    markdown, html = (Path(tmp_path / name).read_text() for name in ("report.md", "report.html"))
    for text in ("The toy", "0.0027", "width 0.6", "reached", "MuJoCo is not installed", "numpy"):
        assert text in markdown
        assert text in html
    assert "<table>" in html
    assert "data:image/png;base64," in html
    assert 'src="toy' not in html
