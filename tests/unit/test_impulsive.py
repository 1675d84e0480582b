"""Flows that start with a jump are named where forces are measured."""

import pytest

from fsci.case import load_case
from fsci.check.meshes import check_meshes

CASE = """\
time: {step: 0.02, end: 0.1}
fluid:
  density: 1
  viscosity: 0.02
  grid: {from: [0, 0], to: [3, 1], cells: [60, 20]}
  patches:
    inlet: {on: x-, velocity: ["4*y*(1 - y)", 0]}
    outlet: {on: x+, outflow: true}
    walls: {on: [y-, y+], no_slip: true}
  bodies:
    cylinder: {mesh: {shape: disc, radius: 0.2, cells: [48, 1], translate: [1, 0.5]}}
probes: {f: {quantity: force, body: cylinder}}
"""


def notes(folder, text):
    (folder / "case.yaml").write_text(text)
    return check_meshes(load_case(folder / "case.yaml")).notes


def test_a_jump_is_named(tmp_path):
    assert notes(tmp_path, CASE) == [
        f"{tmp_path}/case.yaml:7:12: 1 m/s at the start of a flow at rest: forces on bodies in the first step are an "
        "impulse over the step; let it rise, as by ramp(t, 0, 1), or give 'initial_velocity'"
    ]


@pytest.mark.parametrize(("old", "new"), [
    ('"4*y*(1 - y)"', '"4*y*(1 - y)*ramp(t, 0, 1)"'),
    ("  viscosity", "  scheme: steady\n  viscosity"),
    ("  viscosity", "  initial_velocity: [1, 0]\n  viscosity"),
    (
        'inlet: {on: x-, velocity: ["4*y*(1 - y)", 0]}',
        "inlet: {on: x-, where: y > 0.5, velocity: ['where(y > 0.5, 0, 1)', 0]}\n"
        "    rest: {on: x-, where: y <= 0.5, no_slip: true}",
    ),
    ("{f: {quantity: force, body: cylinder}}", "{out: {quantity: flow_rate, through: outlet}}"),
])  # fmt: skip
def test_what_is_none(tmp_path, old, new):
    assert old in CASE
    assert notes(tmp_path, CASE.replace(old, new)) == []
