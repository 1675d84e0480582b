"""The cases of the tutorials: the first two as a whole, of the others the first steps; their pages show them."""

from pathlib import Path

import pytest
from programs import fsci

from fsci.case import load_case
from fsci.case.probe_checks import known_columns
from fsci.running.history import read_history

DOCS = Path(__file__).parents[2] / "docs"
COUNTS = {"step", "time", "dt", "wall", "fluid.linear", "coupling.linear"}
STAGES = ("solid", "contact", "flow", "coupled", "together")


def test_each_case_has_its_page():
    assert {path.parent.name for path in DOCS.glob("tutorials/*/case.yaml")} == set(STAGES)
    for number, stage in enumerate(STAGES, start=1):
        page = (DOCS / f"tutorial_{number}_{stage}.md").read_text()
        assert f"literalinclude}} tutorials/{stage}/case.yaml" in page
        assert f"fsci run docs/tutorials/{stage} " in page


@pytest.mark.parametrize(
    "stage",
    [*STAGES[:2], *(pytest.param(stage, marks=pytest.mark.slow) for stage in STAGES[2:])],
)
def test_it_reaches_what_the_page_says(stage, tmp_path):
    done = fsci("run", DOCS / "tutorials" / stage, "-o", tmp_path, timeout=600)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "repeated" not in done.stdout


@pytest.mark.parametrize("stage", STAGES[2:])
def test_first_steps(stage, tmp_path):
    short = ("--set", "time.end=0.06", "--set", "verify=[]")
    done = fsci("run", DOCS / "tutorials" / stage, "-o", tmp_path, *short)
    assert done.returncode == 0, done.stdout + done.stderr
    history = read_history(tmp_path / "history.csv")
    assert len(history["step"]) == 3
    assert max(abs(history["fluid.mass"])) < 1e-9
    known = known_columns(load_case(tmp_path))
    later = {name for name in known if name.startswith("contact.")}  # of walls, once a body is near
    assert set(known) - later <= set(history)
    assert set(history) - COUNTS <= set(known)


def test_forces_balance_in_contact(tmp_path):
    """Pressure p on the left side from a to b pushes with p (b_y - a_y): clamp + contact + pressure = 0."""
    probe = "probes.corner={quantity: displacement, at: [1, 0.6]}"
    done = fsci("run", DOCS / "tutorials" / "contact", "-o", tmp_path, "--set", probe)
    assert done.returncode == 0, done.stdout + done.stderr
    history = {name: values[-1] for name, values in read_history(tmp_path / "history.csv").items()}
    along = history["clamp.x"] + history["contact.stop.x"] + 8 * (0.6 + history["corner.y"])
    across = history["clamp.y"] + history["contact.stop.y"] - 8 * history["corner.x"]
    assert abs(along) < 1e-6
    assert abs(across) < 1e-6
