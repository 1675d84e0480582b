"""Titles and names in pictures and pages are what they are: no formulas, no HTML."""

import html
import json

import pytest
from small_cases import PLATE

from fsci.cli import execute
from fsci.plot.curves import COLOURS, plot_curves
from fsci.plot.units import label, literal

TITLES = [r"bad $\frac{$ x", "cost $5 and $6", r"$x$ \$ \\ _a^b {", "<b>&amp;</b> \"'$", "a $ alone", "$$", "no dollar"]


@pytest.mark.parametrize("title", TITLES)
def test_matplotlib_draws_it_as_it_stands(title):
    from matplotlib.text import Text

    text = Text(text=literal(title))
    assert text._preprocess_math(text.get_text()) == (title, False)


SI = {"length": "m", "mass": "kg", "time": "s"}


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    folder = tmp_path_factory.mktemp("plate")
    probe = "probes: {p: {quantity: displacement, at: [1, 1]}}\n"
    (folder / "case.yaml").write_text("title: a title\n" + PLATE + probe)
    assert execute(["run", str(folder), "-o", str(folder / "out")]) == 0
    return folder / "out"


@pytest.mark.parametrize(
    "title", [TITLES[0], TITLES[3], *(pytest.param(title, marks=pytest.mark.slow) for title in TITLES[1:3])]
)
def test_pictures_and_pages(out, title, monkeypatch):
    drawn = []
    from matplotlib.text import Text

    original = Text.draw
    monkeypatch.setattr(Text, "draw", lambda text, *a, **k: (drawn.append(text.get_text()), original(text, *a, **k))[1])
    text = (out / "case.yaml").read_text()
    (out / "case.yaml").write_text("\n".join([f"title: {json.dumps(title)}", *text.split("\n")[1:]]))
    summary = json.loads((out / "summary.json").read_text())
    (out / "summary.json").write_text(json.dumps({**summary, "title": title}))
    assert execute(["report", str(out)]) == 0
    assert literal(f"{title}, t = 1 s") in drawn
    page = (out / "report.html").read_text()
    assert f"<h1>{html.escape(title)}</h1>" in page
    assert "<b>" not in page


def test_names_of_curves(tmp_path):
    """Also those of a history that was written by hand."""
    curves = dict.fromkeys((r"$\frac{$", "$a$", "b"), pytest.importorskip("numpy").arange(4.0))
    assert len(curves) <= len(COLOURS)
    assert plot_curves(tmp_path / "x.png", range(4), curves, "t", label(r"$\sqrt{$", "force", SI)).stat().st_size > 1000


def test_names_beside_units():
    """Powers are formulas, names are not."""
    from matplotlib.text import Text

    drawn = label(r"$\frac{$ and $x$", "pressure", {"length": "m", "mass": "g", "time": "s"})
    assert drawn == r"\$\frac{\$ and \$x\$ [g/m s$^2$]"
    assert Text(text=drawn)._preprocess_math(drawn) == (drawn, True)


def test_a_case_that_cannot_be_read(out, capsys):
    (out / "case.yaml").write_text("probes: [1, 2]\n")
    assert execute(["plot", str(out)]) == 2
    assert capsys.readouterr().err == (
        f"fsci plot: {out / 'case.yaml'} is not the case of a run: "
        f"fsci check {out / 'case.yaml'} says what is wrong with it\n"
    )
