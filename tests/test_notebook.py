"""What notebooks show: tables with escaped names, and progress in its place; terminals see none of it."""

import sys
from types import SimpleNamespace

import numpy as np
import pytest
from sklearn import config_context
from sklearn.pipeline import make_pipeline

import unconstrain as uc
from unconstrain.progress import reporting
from unconstrain.stopping import Movement, Stop

X = np.random.default_rng(0).normal(size=(60, 2))
DEMOS = uc.Demonstrations(X, -X, np.repeat([0, 1, 2], 20), state_names=["<b>", "y"], notes=["5 < 6"])


def test_demonstrations_are_a_small_table_with_escaped_names():
    shown = DEMOS._repr_html_()
    assert "60 samples in 3 episodes" in shown
    assert "<td>&lt;b&gt;</td>" in shown
    assert "<p>5 &lt; 6</p>" in shown
    assert "<b>" not in shown
    wide = uc.Demonstrations(np.ones((2, 300)), np.ones((2, 300)))._repr_html_()
    assert "... 288 more" in wide
    assert len(wide) < 4000
    stop = Stop(0, 1, 0.5, X[0], "it left")
    assert "stopped after 0.5 s: it left" in Movement(X[:2], X[:2], stopped=[stop])._repr_html_()


def test_a_fitted_policy_shows_what_it_found_above_scikit_learns_diagram():
    policy = uc.ParametricPolicy()
    assert policy._repr_html_().startswith("<style>")
    policy.fit(DEMOS)
    assert policy._repr_html_().startswith("<table>")
    assert "of the samples were free" in policy._repr_mimebundle_()["text/html"]
    assert "sk-container" in policy._repr_html_()
    assert make_pipeline(policy)._repr_html_().startswith("<style>")
    with config_context(display="text"):
        assert not hasattr(policy, "_repr_html_")


def test_reports_and_comparisons_are_tables():
    policy = uc.ParametricPolicy().fit(DEMOS)
    report = uc.identifiability(policy, DEMOS)._repr_html_()
    assert "100.0% of 6 directions" in report
    assert report.count("<tr>") == 4
    found = uc.select_policy({"<a>": uc.ParametricPolicy()}, DEMOS)
    assert "&lt;a&gt;" in found._repr_html_()
    assert found._repr_html_().startswith(found.table._repr_html_())
    assert uc.evaluate(policy, DEMOS)._repr_html_().startswith("<table>")


class Handle:
    """A cell's output that is updated, as IPython gives it."""

    def __init__(self):
        self.shown = []

    def update(self, html):
        self.shown.append(html)


@pytest.mark.parametrize("kernel", [None, object()])
def test_progress_in_a_notebook_is_updated_in_its_place(monkeypatch, capsys, kernel):
    handle = Handle()
    display = SimpleNamespace(HTML=str, display=lambda shown, display_id: handle)
    shell = SimpleNamespace(kernel=kernel)
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: shell, display=display))
    monkeypatch.setitem(sys.modules, "IPython.display", display)
    monkeypatch.setenv("COLUMNS", "200")
    with reporting(True, unit="files") as report:
        for done in range(0, 4001, 5):
            report(done, 4000)
    if kernel is None:  # IPython in a terminal
        assert not handle.shown
        assert "4,000 of 4,000 files" in capsys.readouterr().err
        return
    assert "learning: 4,000 of 4,000 files" in handle.shown[-1]
    assert '<progress value="4000" max="4000">' in handle.shown[-1]
    assert len(handle.shown) < 20
    assert capsys.readouterr() == ("", "")
