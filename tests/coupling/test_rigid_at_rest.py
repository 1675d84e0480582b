"""A free rigid disc or ball at rest on the floor of a flow: contact carries its weight less the buoyancy."""

from __future__ import annotations

import pytest

from fsci.case import CaseError, load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case

#: Eight times as dense as the fluid.
DISC = """\
time: {step: 0.02, end: 0.8}
fluid:
  density: 1
  viscosity: 0.5
  element: q1q1
  gravity: [0, -10]
  scheme: backward_euler
  grid: {from: [0, 0], to: [1, 0.8], cells: [12, 10]}
  patches: {top: {on: y+, outflow: true}, walls: {on: [x-, x+, y-], no_slip: true}}
  bodies:
    body: {mesh: {shape: disc, radius: 0.15, cells: [24, 1], translate: [0.528, 0.16], rotate: {angle: 7.5}}, free: {density: 8}}
coupling: {scheme: monolithic}
probes:
  mass: {body: body, quantity: mass}
  fluid: {field: fluid, body: body, quantity: force}
output: {fields_every: 0}
"""  # noqa: E501
BALL = (
    DISC.replace("end: 0.8", "end: 0.4")
    .replace("[0, -10]", "[0, 0, -10]")
    .replace("from: [0, 0], to: [1, 0.8], cells: [12, 10]", "from: [0, 0, 0], to: [0.6, 0.6, 0.5], cells: [6, 6, 5]")
    .replace("on: y+, outflow", "on: z+, outflow")
    .replace("on: [x-, x+, y-]", "on: [x-, x+, y-, y+, z-]")
    .replace("shape: disc, radius: 0.15, cells: [24, 1]", "shape: sphere, radius: 0.15, cells: [3, 1]")
    .replace("translate: [0.528, 0.16], rotate: {angle: 7.5}", "translate: [0.31, 0.28, 0.1501]")
    .replace("free: {density: 8}", "free: {density: 8, held: [rotation]}")
)
#: A bar that lies across another one: no vertex of one is on the other.
BARS = (
    BALL.replace("end: 0.4", "end: 0.3")
    .replace("to: [0.6, 0.6, 0.5], cells: [6, 6, 5]", "to: [0.6, 0.6, 0.6], cells: [6, 6, 6]")
    .replace("shape: sphere, radius: 0.15, cells: [3, 1], translate: [0.31, 0.28, 0.1501]",
             "shape: box, size: [0.4, 0.2, 0.2], cells: [1, 1, 1], translate: [0.11, 0.18, 0.281]")
    .replace("free: {density: 8, held: [rotation]}}", "free: {density: 8}}\n"
             "    lower: {mesh: {shape: box, size: [0.2, 0.46, 0.2], cells: [1, 1, 1], translate: [0.21, 0.07, 0.08]}}")
)  # fmt: skip


@pytest.mark.parametrize(
    ("text", "up", "flows"),  # flows: what the dying flow still changes of the buoyancy
    [
        pytest.param(DISC, "y", 1e-6, id="disc"),
        pytest.param(
            DISC.replace("[0.528,", "[0.556,"), "y", 1e-6, id="moved by a third of a cell", marks=pytest.mark.slow
        ),
        pytest.param(
            DISC.replace("scheme: monolithic", "scheme: partitioned"),
            "y",
            1e-6,
            id="partitioned",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            DISC.replace("viscosity: 0.5\n  element: q1q1", "viscosity: 0.02\n  element: q2q1"),
            "y",
            2e-3,
            id="q2q1",
            marks=pytest.mark.slow,
        ),
        pytest.param(BALL, "z", 1e-6, id="ball"),
        pytest.param(BARS, "z", 1e-6, id="bars that cross", marks=pytest.mark.slow),
    ],
)
def test_contact_carries_what_the_fluid_does_not(tmp_path, text, up, flows):
    (tmp_path / "case.yaml").write_text(text)
    assert run_case(load_case(tmp_path / "case.yaml"), tmp_path / "out") == FINISHED
    found = read_history(tmp_path / "out" / "history.csv")
    weight = 10.0 * found["mass"][-1]
    carried, buoyancy = found[f"contact.on_body.{up}"][-1], found[f"fluid.{up}"][-1]
    assert carried == pytest.approx(weight - buoyancy, rel=1e-6)
    assert buoyancy == pytest.approx(weight / 8.0, rel=flows)


def test_a_zone_of_closed_contact_is_not_for_rigid_bodies(tmp_path):
    """They keep a gap of fluid."""
    (tmp_path / "case.yaml").write_text(DISC + "contact: {film: {zone: wetted}}\n")
    with pytest.raises(CaseError, match="'film' needs the section 'structure': it is not for contact of free bodies"):
        load_case(tmp_path / "case.yaml")
