"""Fluid that passes through a body shows in `fluid.leak`, and `fsci check` warns of it."""

import numpy as np
import pytest
from case_text import without

from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.run import run_case

#: cells of 0.1, and a plate that seals the channel, pressure 1 on its left side
CASE = """\
time: {{step: 0.1, end: 0.5}}
fluid:
  density: 1
  viscosity: 1e-3
  element: q1q1
  scheme: backward_euler
  grid: {{from: [0, 0], to: [3, 1], cells: [30, 10]}}
  patches:
    inlet: {{on: x-, traction: [1, 0]}}
    outlet: {{on: x+, traction: [0, 0]}}
    walls: {{on: [y-, y+], slip: true}}
  bodies:
    plate: {{mesh: {{shape: rectangle, size: [{thickness}, 1.2], cells: [1, 12], origin: [1.537, -0.1]}}{motion}}}
probes:
  force: {{quantity: force, body: plate}}
  flow: {{quantity: flow_rate, through: outlet}}
verify: [{{value: fluid.leak, statistic: max, reference: 0, absolute: 1e-12}}]
"""
#: the same with cells of 0.1 around the plate only
NESTED = CASE.replace("cells: [30, 10]", "cells: [15, 5], refine: [{{box: [[0.8, 0], [2.6, 1]], level: 1}}]")
#: a plate with both ends in the flow
SHORT = CASE.replace("1.2]", "0.8]").replace("-0.1]", "0.1]")
MOVED = ', motion: {displacement: ["0.05*t", 0]}'


def history_of(tmp_path, thickness, motion="", text=CASE):
    (tmp_path / "case.yaml").write_text(text.format(thickness=thickness, motion=motion))
    code = run_case(load_case(tmp_path), tmp_path / "out")
    return code, read_history(tmp_path / "out" / "history.csv")


@pytest.mark.parametrize(
    ("thickness", "motion", "rate"),
    [(0.25, "", 0.0), (0.02, "", 0.0), (0.02, MOVED, 0.05), (0.35, MOVED, 0.05), (0.4, MOVED, 0.05)],
)
@pytest.mark.parametrize("text", [CASE, NESTED], ids=["uniform", "nested"])
def test_a_plate_is_tight(tmp_path, thickness, motion, rate, text):
    code, history = history_of(tmp_path, thickness, motion, text)
    assert code == 0, "verify holds"
    assert np.allclose(history["flow"], rate, atol=1e-10)


def test_leak_through_a_thin_plate_is_measured(tmp_path):
    """It hardly moves, and is six cells long: its sides have nodes in common."""
    short = SHORT.replace("0.8]", "0.6]")
    code, history = history_of(tmp_path, 0.02, MOVED.replace("0.05", "1e-9"), short)
    assert code == 1, "verify is missed"
    assert np.all(history["fluid.leak"] > 0.02)
    assert np.all(history["fluid.leak"] < history["flow"])


@pytest.mark.parametrize(
    ("thickness", "motion", "text", "words"),
    [
        (0.15, "", CASE, None),
        (0.3, MOVED, CASE, None),
        (0.35, MOVED, CASE, None),
        (0.35, MOVED, NESTED, None),
        (0.02, MOVED, SHORT, "8 of them long: if all of its edges are in the fluid, some passes through a body that"),
        (0.02, MOVED, SHORT, "a body that moves with less than 12.7 cells along"),
        (0.32, MOVED, CASE.replace("element: q1q1", "element: q2q1"), None),
        (0.02, "", SHORT, "some passes through a body with less than 9.9 cells along"),
        (
            0.02,
            MOVED,
            SHORT.replace("0.8]", "0.6]"),
            "the body is 0.02 thick, 0.2 of the smallest cells: where it has fluid on both sides, fluid passes through "
            "a body that moves with less than 4 cells across",
        ),
    ],
)
def test_check_warns(tmp_path, thickness, motion, text, words):
    (tmp_path / "case.yaml").write_text(text.format(thickness=thickness, motion=motion))
    warnings = [str(warning) for warning in load_case(tmp_path).warnings]
    assert len(warnings) == (words is not None)
    assert not words or words in warnings[0]


CONTACT = "contact: {pairs: {a: {slave: {body: plate, on: top}, master: {body: plate, on: bottom}}}}"


SPACE = """\
time: {{step: 0.1, end: 0.5}}
fluid:
  density: 1
  viscosity: 1e-3
  element: q1q1
  scheme: backward_euler
  grid: {{from: [0, 0, 0], to: [3, 2, 2], cells: [30, 20, 20]}}
  patches: {{inlet: {{on: x-, traction: [1, 0, 0]}}, other: {{on: [x+, y-, y+, z-, z+], outflow: true}}}}
structure:
  dynamics: {{}}
  bodies:
    plate:
      mesh: {{shape: box, size: [0.02, 2, {width}], cells: [1, 2, 2], origin: [1.5, 0, 0]}}
      material: {{law: neo_hooke, E: 1, nu: 0, density: 1}}
coupling: {{}}
{more}
"""


@pytest.mark.parametrize(
    ("width", "more", "words"),
    [
        (2, "", None),
        (0.9, "", "9 of them long: if all of its edges are in the fluid, some passes through a body that moves with"),
        (0.7, "", "fluid passes through a body that moves with less than 4 cells across"),
        (2, CONTACT, "nothing passes through it, but where it is in contact and opens again, steps may fail"),
    ],
)
def test_check_warns_in_space(tmp_path, width, more, words):
    """Of thin bodies that are too short, or where surfaces may touch."""
    more = more.replace("on: bottom", "on: left").replace("on: top", "on: right")
    (tmp_path / "case.yaml").write_text(SPACE.format(width=width, more=more))
    found = [str(warning) for warning in load_case(tmp_path).warnings if "of the smallest cells" in str(warning)]
    assert len(found) == (words is not None)
    assert not words or words in found[0]


@pytest.mark.parametrize(
    ("thickness", "more", "words"),
    [
        (0.35, "", None),
        (0.2, "", None),
        (0.19, CONTACT, "1.9 of the smallest cells: nothing passes through it, but where it is in contact and opens"),
        (0.25, CONTACT, "fluid passes through a body that moves with less than 4 cells across"),
        (0.45, CONTACT, None),
    ],
)
def test_check_warns_of_elastic_bodies(tmp_path, thickness, more, words):
    """Of thin ones where surfaces may touch."""
    text = CASE.format(thickness=1, motion="")
    body = f"structure: {{dynamics: {{}}, bodies: {{plate: {{mesh: {{shape: rectangle, size: [{thickness}, 1], \
cells: [1, 4]}}, material: {{law: neo_hooke, E: 1, nu: 0, density: 1}}}}}}}}\ncoupling: {{}}\n{more}\n"
    text = without(text, "fluid", "bodies") + body
    (tmp_path / "case.yaml").write_text(text)
    found = [str(warning) for warning in load_case(tmp_path).warnings if "of the smallest cells:" in str(warning)]
    assert len(found) == (words is not None)
    assert not words or words in found[0]


def test_check_knows_that_a_hollow_body_has_unknowns_of_both_sides(tmp_path):
    """A ring of 2.5 cells in contact; the quarter of one is open."""
    text = without(CASE.format(thickness=1, motion=""), "fluid", "bodies")
    for angle, words in ((360, "nothing passes through it"), (90, "fluid passes through a body that moves")):
        body = f"structure: {{dynamics: {{}}, bodies: {{plate: {{mesh: {{shape: ring, inner_radius: 2, outer_radius: \
2.25, angle: {angle}, cells: [16, 1]}}, material: {{law: neo_hooke, E: 1, nu: 0, density: 1}}}}}}}}\ncoupling: {{}}\n"
        (tmp_path / "case.yaml").write_text(text + body + CONTACT.replace("top", "outer").replace("bottom", "inner"))
        found = [
            str(warning) for warning in load_case(tmp_path).warnings if "2.5 of the smallest cells:" in str(warning)
        ]
        assert len(found) == 1
        assert words in found[0]
