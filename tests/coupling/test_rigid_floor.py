"""Free rigid bodies in a flow stop at the box, at fixed bodies and at each other."""

from __future__ import annotations

import numpy as np
import pytest

from fsci.builder.rigid_contact import STANDOFF
from fsci.case import CaseError, load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, resume_run, run_case

#: A heavy disc falls on the floor, a third of a cell beside the middle; two more stand beside it.
FALLING = """\
time: {step: 0.02, end: 0.5}
fluid:
  density: 1
  viscosity: 0.05
  element: q1q1
  scheme: backward_euler
  grid: {from: [0, 0], to: [1, 0.8], cells: [12, 10]}
  patches: {top: {on: y+, outflow: true}, walls: {on: [x-, x+, y-], no_slip: true}}
  bodies:
    disc: {mesh: {shape: disc, radius: 0.15, cells: [24, 1], translate: [0.528, 0.25]}, free: {density: 8, gravity: [0, -10]}}
  dynamics: {rho_inf: 0}
coupling: {}
probes:
  centre: {body: disc, quantity: centre}
  on_disc: {field: fluid, body: disc, quantity: force}
output: {fields_every: 0}
verify: [{value: contact.on_disc.y, reference: 5.59, relative: 0.05}]
"""  # noqa: E501
WEIGHT = 80.0 * 24 * 0.5 * 0.15**2 * np.sin(2.0 * np.pi / 24)


def run(text, folder):
    folder.mkdir(exist_ok=True)
    (folder / "case.yaml").write_text(text)
    assert run_case(load_case(folder / "case.yaml"), folder / "out") == FINISHED
    return read_history(folder / "out" / "history.csv")


def test_a_disc_stops_on_the_floor(tmp_path):
    """The floor carries the weight less the force of the fluid; the gap that stays is a share of the cells' height."""
    # a polygon on a corner would tip onto its side
    found = run(FALLING.replace("gravity: [0, -10]}", "gravity: [0, -10], held: [rotation]}"), tmp_path)
    assert found["centre.y"].min() > 0.15 * np.cos(np.pi / 24) - 1e-9
    assert found["centre.y"][-1] == pytest.approx(0.15 + STANDOFF * 0.08, abs=1e-9)
    assert found["contact.on_disc.y"][-1] == pytest.approx(WEIGHT - found["on_disc.y"][-1], rel=1e-6)


#: The same disc on the floor, which gravity makes a slope, in next to no fluid.
SLOPE = (
    FALLING.split("verify:")[0]
    .replace("density: 1\n  viscosity: 0.05", "density: 1.0e-5\n  viscosity: 1.0e-8")
    .replace("gravity: [0, -10]", "gravity: [2, -10]WAYS")
    .replace("[0.528, 0.25]", "[0.228, 0.15008]")
    .replace("end: 0.5", "end: 0.3")
    + "contact: {friction: {coefficient: MU}}\n"
)
#: Without fluid, on an obstacle that is higher by what a flow leaves open.
DRY = """\
time: {step: 0.02, end: 0.3}
rigid:
  dynamics: {rho_inf: 0}
  bodies:
    disc: {mesh: {shape: disc, radius: 0.15, cells: [24, 1], translate: [0.228, 0.15008]}, density: 8, gravity: [2, -10]WAYS}
contact:
  friction: {coefficient: MU}
  obstacles: {floor: {mesh: {shape: rectangle, size: [3, 0.2], cells: [1, 1], origin: [-1, -0.19992]}, on: top}}
probes: {centre: {body: disc, quantity: centre}}
output: {fields_every: 0}
"""  # noqa: E501


@pytest.mark.parametrize(
    ("friction", "held"), [(0.5, False), (0.25, True), pytest.param(0.1, True, marks=pytest.mark.slow)]
)
def test_friction_with_the_floor_in_a_flow(tmp_path, friction, held):
    """A disc rolls as without a fluid. One that does not turn rests below the angle of friction, or slides."""
    texts = [
        text.replace("WAYS", ", held: [rotation]" if held else "").replace("MU", str(friction)) for text in (SLOPE, DRY)
    ]
    wet, dry = run(texts[0], tmp_path / "wet")["centre.x"], run(texts[1], tmp_path / "dry")["centre.x"]
    way = wet[-1] - 0.228
    assert way == pytest.approx(dry[-1] - 0.228, rel=1e-3, abs=1e-9)
    if held:
        assert way == pytest.approx(0.5 * max(0.0, 2.0 - 10.0 * friction) * 0.3**2, rel=1e-3, abs=1e-9)
    else:
        assert way > 0.05


def test_without_contact_it_ends_at_the_wall(tmp_path):
    text = FALLING.split("verify:")[0] + "contact: none\n"
    (tmp_path / "case.yaml").write_text(text)
    assert run_case(load_case(tmp_path / "case.yaml"), tmp_path / "out") != FINISHED


@pytest.mark.slow
def test_a_resumed_run_is_the_same(tmp_path):
    short = FALLING.split("verify:")[0].replace("end: 0.5", "end: 0.24")
    whole = run(short, tmp_path / "whole")
    run(short.replace("end: 0.24", "end: 0.2"), tmp_path / "part")
    assert resume_run(tmp_path / "part" / "out", [("time.end", "0.24")]) == FINISHED
    part = read_history(tmp_path / "part" / "out" / "history.csv")
    assert whole["contact.active"][-1] > 0
    for column in ("centre.x", "centre.y", "contact.on_disc.y"):
        assert np.array_equal(part[column], whole[column]), column


@pytest.mark.slow
def test_two_discs_in_a_shaft(tmp_path):
    """One falls on the other, which lies on the floor: no overlap, and the floor carries both."""
    more = "    other: {mesh: {shape: disc, radius: 0.12, cells: [20, 1], translate: [0.507, 0.48]}, free: {density: 20, gravity: [0, -10]}}\n"  # noqa: E501
    text = FALLING.replace("translate: [0.528, 0.25]", "translate: [0.528, 0.15]").replace(
        "  dynamics", more + "  dynamics"
    )
    text = text.split("verify:")[0].replace("output:", "  above: {body: other, quantity: centre}\noutput:")
    found = run(text.replace("end: 0.5", "end: 0.24"), tmp_path)
    distance = np.hypot(found["centre.x"] - found["above.x"], found["centre.y"] - found["above.y"])
    assert distance.min() > (0.15 + 0.12) * np.cos(np.pi / 20) - 1e-9
    assert found["contact.on_other.y"].max() > 1.0
    assert found["centre.y"].min() > 0.15 * np.cos(np.pi / 24) - 1e-9


def test_a_column_that_is_not_there(tmp_path):
    (tmp_path / "case.yaml").write_text(FALLING.replace("contact.on_disc.y", "contact.on_disk.y"))
    with pytest.raises(CaseError) as error:
        load_case(tmp_path / "case.yaml")
    assert "case.yaml:17:18" in str(error.value)
    assert "there is no value 'contact.on_disk.y'; did you mean 'contact.on_disc.y'?" in str(error.value)
