"""Formulas that are infinite or not a number where a run needs them, and motions that jump, are named."""

import numpy as np
import pytest
from case_mistakes import assert_located, first_lines, load, refused

from fsci.case import load_case
from fsci.case.expressions import expressions
from fsci.case.jumps import find_jump
from fsci.case.rigid_motion import differentiated
from fsci.check.meshes import check_meshes
from fsci.expression import Expression
from fsci.running.run import FAILED, FINISHED, run_case

pytestmark = pytest.mark.usefixtures("in_new_folder")

FLOW = """\
time: {step: 0.02, end: 0.2}
fluid:
  density: 1
  viscosity: 0.05
  grid: {from: [0, 0], to: [1, 1], cells: [8, 8]}
  body_force: [0, 0]
  patches:
    top: {on: y+, pressure: 0}
    inlet: {on: y-, velocity: [0, 1]}
    sides: {on: [x-, x+], no_slip: true}
  bodies:
    a: {mesh: {shape: disc, radius: 0.15, cells: [24, 1], translate: [0.5, 0.5]}, motion: {displacement: [0, 0]}}
"""
SOLID = """\
time: {step: 0.1, end: 1}
structure:
  dynamics: {}
  bodies:
    a:
      mesh: {shape: rectangle, size: [1, 1], cells: [4, 4]}
      material: {law: neo_hooke, E: 1000, nu: 0.3, density: 1}
      supports: [{on: left, displacement: [0, 0]}]
      tractions: [{on: right, value: [0, 0]}]
"""

STATIC = SOLID.replace("  dynamics: {}\n", "")

#: case, what is replaced, by what, the message after the name of the file
NOT_FINITE = [
    (
        FLOW,
        "displacement: [0, 0]",
        "displacement: [0, sqrt(0.05-t)]",
        "12:110: entry 2 of 'displacement': 'sqrt(0.05-t)' is not a number at t = 0.06",
    ),
    (
        FLOW,
        "displacement: [0, 0]",
        "velocity: [1/(t-0.1), 0]",
        "12:103: entry 1 of 'velocity': '1/(t-0.1)' is infinite at t = 0.1",
    ),
    (
        FLOW,
        "displacement: [0, 0]",
        "rotation: {centre: [0, 0], angle: log(-t)}",
        "12:126: 'angle': 'log(-t)' is infinite at t = 0",
    ),
    (FLOW, "pressure: 0", "pressure: log(0.1-t)", "8:29: 'pressure': 'log(0.1-t)' is infinite at t = 0.1"),
    (FLOW, "pressure: 0", "pressure: sqrt(0.5-x)", "8:29: 'pressure': 'sqrt(0.5-x)' is not a number at (0.5625, 1)"),
    (
        FLOW,
        "[0, 1]}",
        "[0, sqrt(x-t-0.2)]}",
        "9:35: entry 2 of 'velocity': 'sqrt(x-t-0.2)' is not a number at (0.125, 0) at t = 0.02",
    ),
    (
        SOLID,
        "[0, 0]}]\n      tr",
        "[0, sqrt(0.5-t)]}]\n      tr",
        "8:47: entry 2 of 'displacement': 'sqrt(0.5-t)' is not a number at t = 0.6",
    ),
    (
        SOLID,
        "value: [0, 0]",
        "value: [0, exp(1000*t)]",
        "9:42: entry 2 of 'value': 'exp(1000*t)' is infinite at t = 0.8",
    ),
    (
        SOLID,
        "value: [0, 0]",
        "value: [0, sqrt(y-0.5)]",
        "9:42: entry 2 of 'value': 'sqrt(y-0.5)' is not a number at (1, 0.125)",
    ),
    (SOLID, "E: 1000", "E: 1000/(x-0.125)", "7:37: 'E': '1000/(x-0.125)' is infinite at (0.125, 0.125)"),
    (SOLID, "density: 1", "density: 1+log(x-0.2)", "7:61: 'density': '1+log(x-0.2)' is not a number at (0.125, 0.125)"),
    (
        SOLID,
        "      supp",
        "      gravity: [0, log(t-x)]\n      supp",
        "8:20: entry 2 of 'gravity': 'log(t-x)' is not a number at (0.125, 0.125) at t = 0",
    ),
    (
        SOLID,
        "      supp",
        "      initial_velocity: [1/x, 0]\n      supp",
        "8:26: entry 1 of 'initial_velocity': '1/x' is infinite at (0, 0)",
    ),
]


@pytest.mark.parametrize(("case", "old", "new", "message"), NOT_FINITE, ids=[m[3] for m in NOT_FINITE])
def test_settings_that_are_not_finite(case, old, new, message):
    """By check and run alike."""
    text = case.replace(old, new, 1)
    assert text != case
    error = refused(text, lambda loaded: run_case(loaded, loaded.folder / "out"))
    assert first_lines(error) == [f"case.yaml:{message}"]


SHORT = (("time.end", "0.1"),)

#: formulas that are finite where a run needs them
FINITE = [
    (STATIC, "value: [0, 0]", "value: [0, sin(t)/t]"),  # no load acts at the start
    (FLOW, "pressure: 0", "pressure: sin(t)/t"),
    (SOLID, "[0, 0]}]\n      tr", '[0, "sqrt(0.1-x)-sqrt(0.1)"]}]\n      tr'),  # on the left side
    (SOLID, "value: [0, 0]", "value: [0, 1/(1-y)]"),  # not at nodes, where it is infinite
    (FLOW, "[0, 1]}", "[0, log(1+0*x)/x]}"),  # at x = 0 the sides decide, which are named later
    (FLOW, "displacement: [0, 0]", "displacement: [0, 't**1.5']"),
]


@pytest.mark.parametrize(("case", "old", "new"), FINITE, ids=[m[2] for m in FINITE])
def test_formulas_without_a_value_where_none_is_needed(case, old, new):
    text = case.replace(old, new, 1)
    assert text != case
    assert check_meshes(load(text)).problems == []
    assert run_case(load(text, SHORT), load(text).folder / "out") == FINISHED


def test_a_motion_that_begins_with_the_run():
    """Its rate at the start needs no times before, and at the end none after."""
    value, rate = differentiated(Expression.parse("t**1.5"), 0.1)(0.0)
    assert (value, rate) == (0.0, pytest.approx(0.0, abs=0.02))
    assert differentiated(Expression.parse("sqrt(1 - t) + 0*sqrt(t)"), 0.1)(0.0)[1] == pytest.approx(-0.5, rel=1e-9)
    assert differentiated(Expression.parse("t**2 + 0*sqrt(1 - t)"), 0.1)(1.0) == (1.0, pytest.approx(2.0, rel=1e-9))


def test_a_step_names_the_setting(capfd):
    """What only the run meets: a formula that has no value between the ends of steps, and in a flow with bodies."""
    text = FLOW.replace("body_force: [0, 0]", "body_force: [0, 'sqrt(0.1-t-0*x)']")
    assert run_case(load(text), load(text).folder / "out") == FAILED
    said = capfd.readouterr()
    words = "the residual is not a number (fluid.body_force[1]: 'sqrt(0.1-t-0*x)' is not a number at ("
    assert words in said.out + said.err


def test_a_motion_without_value_within_a_step():
    text = FLOW.replace("displacement: [0, 0]", "displacement: [0, 'where((t-0.0501)^2 < 1e-8, log(-1), 0)']")
    text = text.replace("step: 0.02", "step: 0.0501").replace("end: 0.2", "end: 0.1002")
    assert "is not a number at t = 0.0501" in str(refused(text))


def test_all_expressions_are_found():
    found = {keys: formula.text for keys, formula in expressions(load(SOLID))}
    assert found[("structure", "bodies", "a", "supports", 0, "displacement", 1)] == "0"
    assert found[("structure", "bodies", "a", "material", "E")] == "1000"
    assert found[("structure", "bodies", "a", "tractions", 0, "value", 0)] == "0"


# --- jumps

JUMPS = {
    "where(t < 0.103, 0, 0.05)": (0.103, 0.05),
    "t > 0.5": (0.5, 1.0),
    "1e6 + 0.001*(t > 0.2)": (0.2, 0.001),
    "-1e-7*floor(3*t)": (1 / 3, -1e-7),
    "t - floor(t)": (1.0, -1.0),
    "sign(t - 0.3)*sin(t)": (0.3, 2 * np.sin(0.3)),
}
NO_JUMPS = [
    "5",
    "tanh(1e6*(t - 0.3))",
    "sqrt(t)",
    "abs(t - 0.37)**0.2",
    "ramp(t, 0.3, 0.3000001)",
    "sin(1000*t)",
    "1e9 + sin(t)",
]


@pytest.mark.parametrize("count", [11, 101, 1001])
def test_jumps_are_told_from_fast_motions(count):
    times = np.linspace(0.0, 1.0, count)
    for text, (t, size) in JUMPS.items():
        found = find_jump(Expression.parse(text).at_times, times)
        assert found == (pytest.approx(t), pytest.approx(size, rel=1e-6)), text
    for text in NO_JUMPS:
        assert find_jump(Expression.parse(text).at_times, times) is None, text


WARNED = [
    (
        FLOW,
        "displacement: [0, 0]",
        "displacement: ['where(t<0.103,0,0.05)', 0]",
        "12:107: entry 1 of 'displacement': jumps by 0.05 m at t = 0.103: its",
    ),
    (
        FLOW,
        "displacement: [0, 0]",
        "rotation: {centre: [0, 0], angle: 90*(t>0.1)}",
        "12:126: 'angle': jumps by 90 degrees at t = 0.1: its velocity",
    ),
    (
        SOLID,
        "[0, 0]}]\n      tr",
        "[0, 0.1*(t>0.33)]}]\n      tr",
        "8:47: entry 2 of 'displacement': jumps by 0.1 m at t = 0.33: its velocity is infinite",
    ),
    (
        SOLID,
        "[0, 0]}]\n      tr",
        "[0, 0.1]}]\n      tr",
        "8:47: entry 2 of 'displacement': jumps by 0.1 m at the start, t = 0: the body is not displaced there",
    ),
]


@pytest.mark.parametrize(("case", "old", "new", "message"), WARNED, ids=[m[3] for m in WARNED])
def test_motions_that_jump(case, old, new, message):
    text = case.replace(old, new, 1)
    [warning] = [line for line in load(text).warnings if "jumps" in line]
    assert warning.startswith(f"case.yaml:{message}")
    still = text.replace("  dynamics: {}\n", "").replace("  viscosity", "  scheme: steady\n  viscosity")
    assert "jumps" not in str(
        load(still).warnings
    )  # steps of statics and of steady flow do not follow each other in time


def test_a_support_that_begins_with_the_body():
    text = SOLID.replace("[0, 0]}]\n      tr", "[0, 0.1]}]\n      initial_displacement: [0, 0.1]\n      tr")
    assert load(text).warnings == ()


# --- contradictions

HELD = """\
time: {step: 0.02, end: 0.1}
fluid:
  density: 1
  viscosity: 0.05
  grid: {from: [0, 0], to: [2, 2], cells: [8, 8]}
  patches: {out: {on: [x+, x-], outflow: true}, walls: {on: [y-, y+], slip: true}}
  bodies:
    c:
      mesh: {shape: disc, radius: 0.3, cells: [24, 1], translate: [0.8, 1]}
      free: {density: 2, held: [rotation, x], initial_angular_velocity: [3], initial_velocity: [1, 0]}
coupling: {}
"""
IN_SPACE = (
    HELD.replace("[0, 0]", "[0, 0, 0]")
    .replace("[2, 2]", "[2, 2, 2]")
    .replace("[8, 8]", "[8, 8, 8]")
    .replace(
        "disc, radius: 0.3, cells: [24, 1], translate: [0.8, 1]",
        "sphere, radius: 0.3, cells: [4, 1], translate: [1, 1, 1]",
    )
    .replace("y+], slip", "y+, z-, z+], slip")
)


def test_a_free_body_that_begins_to_move_where_it_is_held():
    words = "the body begins to move in a way that is held: remove '{}' from 'held', or give 0 here"
    error = refused(HELD)
    assert_located(HELD, error, f"10:74: {words.format('rotation')}", "3]")
    assert_located(HELD, error, f"10:97: {words.format('x')}", "1, 0]")
    load(
        HELD.replace(
            "initial_angular_velocity: [3], initial_velocity: [1, 0]",
            "initial_angular_velocity: [0], initial_velocity: [0, 1]",
        )
    )
    for held, spin, word in (("rotation_y", "[0, 1, 0]", "rotation_y"), ("rotation", "[0, 0, 1]", "rotation")):
        text = (
            IN_SPACE.replace("held: [rotation, x]", f"held: [{held}]")
            .replace("[3]", spin)
            .replace("[1, 0]", "[1, 0, 0]")
        )
        assert words.format(word) in str(refused(text))
    load_case(
        write(
            IN_SPACE.replace("held: [rotation, x]", "held: [rotation_y]")
            .replace("[3]", "[1, 0, 1]")
            .replace("[1, 0]", "[1, 0, 0]")
        )
    )


def write(text):
    with open("free.yaml", "w", encoding="utf-8") as file:
        file.write(text)
    return "free.yaml"
