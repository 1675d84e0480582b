"""The element of the flow that the program chooses: q2q1, but q1q1 where elastic bodies may touch; it says so."""

import json

import pytest
from programs import fsci

from fsci.case import load_case
from fsci.case.flow_element import flow_element

POST = """
time: {step: 0.1, end: 0.2}
fluid:
  density: 1
  viscosity: 0.05
  grid: {from: [0, 0], to: [2, 1], cells: [8, 4]}
  patches:
    inlet: {on: x-, velocity: ["y*t", 0]}
    outlet: {on: x+, outflow: true}
    walls: {on: [y-, y+], no_slip: true}
"""
BODY = """
structure:
  dynamics: {}
  bodies:
    post:
      mesh: {shape: rectangle, size: [0.3, 0.52], cells: [3, 5], origin: [0.8, 0]}
      material: {law: neo_hooke, E: 100, nu: 0.3, density: 1}
      SUPPORTS
coupling: {scheme: monolithic}
"""
HELD = BODY.replace("SUPPORTS", "supports: [{on: bottom, displacement: [0, 0]}]")
PLANES = BODY.replace("SUPPORTS", "supports: [{on: [bottom, left], symmetry: true}]")
ONE_PLANE = BODY.replace("SUPPORTS", "supports: [{on: bottom, symmetry: true}]")
FREE = BODY.replace("SUPPORTS\n", "gravity: [0, -1]\n")
TOUCHES = "elastic body 'post' may touch something in the flow"
TOUCHES_NOT = "no elastic body may touch something in the flow"


@pytest.mark.parametrize(
    ("body", "settings", "expected"),
    [
        ("", (), f"q2q1 ({TOUCHES_NOT})"),
        ("", (("fluid.element", "q1q1"),), "q1q1"),
        ("", (("fluid.element", "auto"), ("fluid.narrow_gaps", "true")), "q1q1 (for narrow_gaps)"),
        (HELD, (), f"q2q1 ({TOUCHES_NOT})"),
        (PLANES, (), f"q2q1 ({TOUCHES_NOT})"),
        (ONE_PLANE, (), f"q1q1 ({TOUCHES})"),
        (FREE, (), f"q1q1 ({TOUCHES})"),
        (FREE, (("contact", "none"),), f"q2q1 ({TOUCHES_NOT})"),
        (FREE, (("fluid.element", "q2q1"),), "q2q1"),
        (HELD, (("contact", "{bodies: all}"),), f"q1q1 ({TOUCHES})"),
    ],
)
def test_rule(tmp_path, body, settings, expected):
    """Free bodies may reach a wall, those held may not, and whoever has a section of contact asks for it."""
    (tmp_path / "case.yaml").write_text(POST + body)
    assert str(flow_element(load_case(tmp_path, settings))) == expected


def test_check_run_and_resume_say_it(tmp_path):
    """They name element and reason; the state has the element, and a resumed run refuses another one."""
    (tmp_path / "case.yaml").write_text(POST)
    assert f"Navier-Stokes, bdf2, q2q1 ({TOUCHES_NOT})" in fsci("check", tmp_path).stdout
    done = fsci("run", tmp_path, "-o", tmp_path / "out")
    assert f"flow: element q2q1 ({TOUCHES_NOT})" in done.stdout
    # velocities in 17 x 9 nodes, pressures in 9 x 5
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["dofs"] == {"fluid": 2 * 17 * 9 + 9 * 5}
    refused = fsci("resume", tmp_path / "out", "--set", "time.end=0.3", "--set", "fluid.narrow_gaps=true")
    assert refused.returncode != 0
    assert "fluid.element was q2q1, is q1q1: it cannot change when a run is resumed" in refused.stderr
    again = fsci("resume", tmp_path / "out", "--set", "time.end=0.3", "--set", "fluid.element=q2q1")
    assert "changed: time.end: 0.2 -> 0.3" in again.stdout
    assert "fluid.element" not in again.stdout
    named = fsci("run", tmp_path, "-o", tmp_path / "named", "--set", "fluid.element=q2q1")
    assert "flow: element" not in named.stdout
