"""Fluid on one side of a surface, nothing on the other: exact answers at rest, and mistakes with their messages."""

from __future__ import annotations

import numpy as np
import pytest
from case_mistakes import first_lines, refused
from scipy.optimize import brentq
from test_coupled_run import run

from fsci.builder.dry_side import DrySideError, close, find_ends
from fsci.case import CaseError, load_case
from fsci.running.run import run_case

#: a block across the box, half way up, with fluid above it and none below
COLUMN = """\
title: a column of fluid on an elastic block
time: {step: 1, end: 1}
fluid:
  density: 1000
  viscosity: 1
  element: q1q1
  scheme: steady
  flow: stokes
  gravity: [0, -10]
  grid: {from: [0, 0], to: [1, 1], cells: [5, 11]}
  patches:
    sides: {on: [x-, x+, y-], slip: true}
    top: {on: y+, traction: [0, 0]}
structure:
  bodies:
    block:
      mesh: {shape: rectangle, size: [1, 0.1], cells: [4, 1], origin: [0, 0.4]}
      material: {law: st_venant_kirchhoff, E: 1e5, nu: 0}
      supports: [{on: bottom, displacement: [0, 0]}, {on: [left, right], symmetry: true}]
coupling:
  wetted: {block: top}
  dry_side: {block: [[0, 0], [1, 0]]}
probes:
  top: {quantity: displacement, at: [0.5, 0.5]}
  force: {quantity: force}
  volume: {field: fluid, quantity: volume}
  pressure: {quantity: pressure, at: [0.4, 0.7]}
solver: {newton: {residual: 1.0e-11}}
"""

#: the membrane of cases/cavity_flexible_bottom under uniform pressure; it starts deflected, because flat it is slack
MEMBRANE = """\
title: a membrane under a fluid at rest
time: {step: 1, end: 1}
fluid:
  density: 1
  viscosity: 0.01
  element: q1q1
  scheme: steady
  flow: stokes
  grid: {from: [0, -0.3], to: [1, 0.3], cells: [20, 12]}
  patches:
    sides: {on: [x-, x+, y-], no_slip: true}
    top: {on: y+, traction: [0, -0.1]}
structure:
  bodies:
    membrane:
      mesh: {shape: rectangle, size: [1, 0.002], cells: [32, 1], order: 2, origin: [0, -0.002]}
      material: {law: st_venant_kirchhoff, E: 250, nu: 0}
      supports: [{on: [left, right], displacement: [0, 0]}]
      initial_displacement: [0, "-0.6*x*(1 - x)"]
coupling:
  wetted: {membrane: top}
  dry_side: {membrane: [[0, -0.3], [1, -0.3]]}
probes:
  middle: {quantity: displacement, at: [0.5, 0]}
  force: {quantity: force}
  volume: {field: fluid, quantity: volume}
"""


@pytest.mark.parametrize(
    ("corners", "order"),
    [("[[0, 0], [1, 0]]", 1), ("[[0, 0], [1, 0]]", 2), ("[[1, 0], [0, 0]]", 2), ("[[1.3, -0.2], [-0.1, -5]]", 1)],
)
def test_column_on_a_block(corners, order, tmp_path):
    """One dimension: E/2 (s^2 - 1) s = -rho g H with the stretch s and the height H = 0.6 - 0.1 s, to rounding.

    The ends of the wetted surface slide down with it; corners on the boundary of the box or outside are the same.
    """
    case = COLUMN.replace("[[0, 0], [1, 0]]", corners).replace("[4, 1]", f"[4, 1], order: {order}")
    history = run(case, tmp_path)
    stretch = brentq(lambda s: 0.5e5 * (s**2 - 1) * s + 1e4 * (0.6 - 0.1 * s), 0.9, 1.0, xtol=1e-15)
    height = 0.6 - 0.1 * stretch
    expected = {"top.y": 0.1 * (stretch - 1), "force.y": -1e4 * height, "volume": height, "pressure": 3000.0}
    for name, value in expected.items():
        assert history[name][-1] == pytest.approx(value, rel=1e-10), name
    assert abs(history["force.x"][-1]) < 1e-9
    assert abs(history["fluid.mass"][-1]) < 1e-12


def test_membrane_under_pressure(tmp_path):
    """A circular arc of half angle a: tension p R = E h/2 (s^2 - 1) s with s = a / sin a and R = 1/2 / sin a.

    The clamped ends, which cannot turn within one cell, cost as much as they are long: first order in the mesh.
    """
    E, thickness, p = 250.0, 0.002, 0.1

    def excess(a: float) -> float:
        s = a / np.sin(a)
        return E * thickness / 2 * (s**2 - 1) * s - p * 0.5 / np.sin(a)

    a = brentq(excess, 0.1, 1.5)
    radius = 0.5 / np.sin(a)
    exact = np.array([radius * (1 - np.cos(a)), radius**2 * (a - np.sin(a) * np.cos(a))])
    errors = []
    for cells in (32, 64):
        history = run(MEMBRANE.replace("cells: [32, 1]", f"cells: [{cells}, 1]"), tmp_path)
        found = np.array([-history["middle.y"][-1], history["volume"][-1] - 0.3])
        errors.append(np.abs(found / exact - 1))
    assert (errors[1] < [0.006, 0.015]).all()
    assert (errors[1] < 0.6 * errors[0]).all()
    # pressure on any line between two points is that on the chord
    assert history["force.y"][-1] == pytest.approx(-p, rel=1e-9)
    assert abs(history["force.x"][-1]) < 1e-9


MISTAKES = [
    ("dry_side: {block:", "dry_side: {blok:", "22:20: unknown body 'blok'; did you mean 'block'?"),
    ("  wetted: {block: top}\n", "", "21:21: say which surface is wet: 'wetted: {block: [..]}'"),
    ("[[0, 0], [1, 0]]", "[]", "22:21: 'block' must have 1 or more entries, not 0"),
    ("[1, 0]]", "[1, 0, 0]]", "22:30: a corner has 2 entries in 2D, not 3"),
    ("wetted: {block: top}", "wetted: {block: [top, bottom]}", "22:21: the wetted surface must be one line with two"),
    (
        "[[0, 0], [1, 0]]",
        "[[0, 0.1], [1, 0.1]]",
        "22:21: the line from (0, 0.1) to (1, 0.1) crosses the box: add corners that lead around it",
    ),
    (
        "[[0, 0], [1, 0]]",
        "[[0, 2], [1, 2]]",
        "22:21: the body must lie between its wetted surface and these points",
    ),
]


@pytest.mark.parametrize(("old", "new", "message"), MISTAKES, ids=[m[2] for m in MISTAKES])
def test_message(old, new, message, in_new_folder, tmp_path):
    assert COLUMN.count(old) == 1
    error = refused(COLUMN.replace(old, new), lambda case: run_case(case, tmp_path / "out"))
    assert any(line.startswith(f"case.yaml:{message}") for line in first_lines(error)), first_lines(error)


#: a closed wall of 0.2 cells with fluid inside only, which swings slowly
BALLOON = """\
title: a balloon
time: {step: 0.02, end: 0.06}
fluid:
  density: 1
  viscosity: 0.01
  element: q1q1
  grid: GRID
  patches: {outside: {on: [SIDES], no_slip: true}}
structure:
  dynamics: {rho_inf: 0.8}
  bodies:
    wall:
      mesh: MESH
      material: {law: neo_hooke, E: 1e4, nu: 0.3, density: 10}
      initial_velocity: VELOCITY
coupling:
  wetted: {wall: inner}
  dry_side: {wall: outside}
probes:
  volume: {field: fluid, quantity: volume}
"""
FLAT = {
    "GRID": "{from: [-0.5, -0.5], to: [0.5, 0.5], cells: [10, 10]}",
    "SIDES": "x-, x+, y-, y+",
    "MESH": "{shape: ring, inner_radius: 0.37, outer_radius: 0.39, cells: [32, 1]}",
    "VELOCITY": "[1e-3*x, -1e-3*y]",
}
SOLID = {
    "GRID": "{from: [-0.5, -0.5, -0.5], to: [0.5, 0.5, 0.5], cells: [8, 8, 8]}",
    "SIDES": "x-, x+, y-, y+, z-, z+",
    "MESH": "{shape: hollow_sphere, inner_radius: 0.37, outer_radius: 0.39, cells: [4, 1]}",
    "VELOCITY": "[1e-3*x, 1e-3*y, -2e-3*z]",
}


def balloon(parts: dict[str, str]) -> str:
    text = BALLOON
    for name, value in parts.items():
        text = text.replace(name, value)
    return text


def test_thrown_wall(tmp_path):
    """The start after the impulse of the first step keeps the volume, too, up to second order in a fast motion."""
    history = run(balloon(FLAT | {"VELOCITY": "[0.1*x, -0.1*y]"}), tmp_path)
    assert history["volume"] == pytest.approx(history["volume"][0], rel=1e-6)


@pytest.mark.parametrize(
    ("parts", "ball"), [(FLAT, np.pi * 0.37**2), pytest.param(SOLID, 4 / 3 * np.pi * 0.37**3, marks=pytest.mark.slow)]
)
def test_closed_wall(parts, ball, tmp_path):
    """The fluid is what is inside, and it keeps its volume up to second order in the motion."""
    history = run(balloon(parts), tmp_path)
    assert 0.85 * ball < history["volume"][0] < ball
    assert history["volume"] == pytest.approx(history["volume"][0], rel=1e-8)
    assert np.abs(history["fluid.mass"]).max() < 1e-12
    assert np.abs(history["interface.momentum"]).max() < 1e-8


@pytest.mark.slow
def test_closed_wall_in_space_for_200_steps(tmp_path):
    """A wall of 0.3 cells that swings: the fluid inside keeps its volume."""
    parts = {
        "GRID": "{from: [-0.5, -0.5, -0.5], to: [0.5, 0.5, 0.5], cells: [5, 5, 5]}",
        "MESH": "{shape: hollow_sphere, inner_radius: 0.36, outer_radius: 0.42, cells: [3, 1]}",
    }
    text = balloon(SOLID | parts).replace("step: 0.02, end: 0.06", "step: 0.01, end: 2")
    history = run(text, tmp_path)
    assert len(history["volume"]) == 200
    assert history["volume"] == pytest.approx(history["volume"][0], rel=1e-8)
    assert np.abs(history["fluid.mass"]).max() < 1e-11


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("wall: inner", "wall: [inner, outer]", "'outside' needs a wetted surface with the body around it"),
        ("wall: inner", "wall: outer", "'outside' needs a wetted surface with the body around it"),
        ("cells: [32, 1]}", "cells: [32, 1], angle: 90}", "'outside' needs a wetted surface that is closed"),
        ("from: [-0.5, -0.5]", "from: [-0.3, -0.5]", "'outside' needs a wetted surface within the box"),
    ],
)
def test_what_is_not_closed(old, new, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = balloon(FLAT)
    assert old in text
    error = refused(text.replace(old, new), lambda case: run_case(case, tmp_path / "out"))
    assert any(line == f"case.yaml:18:20: {message}" for line in first_lines(error)), first_lines(error)


def test_3d_has_no_dry_side(tmp_path):
    text = COLUMN.replace("[0, -10]", "[0, -10, 0]").replace("[5, 11]", "[5, 11, 5]")
    text = text.replace("from: [0, 0], to: [1, 1]", "from: [0, 0, 0], to: [1, 1, 1]")
    (tmp_path / "case.yaml").write_text(text)
    with pytest.raises(
        CaseError, match="'dry_side' with corners is for 2D only; in 3D 'outside' is for closed surfaces and tubes"
    ):
        load_case(tmp_path / "case.yaml")


def test_a_line_and_a_loop_have_no_two_ends():
    line, loop = [[0, 1], [1, 2]], [[3, 4], [4, 5], [5, 3]]
    assert find_ends(np.array(line)) == (2, 0)
    for facets in (loop, line + loop):
        with pytest.raises(DrySideError):
            find_ends(np.array(facets))


def test_a_way_that_only_touches_the_box_is_good():
    points, inside = np.array([[1.0, 0.5], [0.0, 0.5]]), np.array([[0.5, 0.4]])
    box = np.zeros(2), np.ones(2)
    for corners in ([[0.0, 0.0], [1.0, 0.0]], [[0.0, -1.0], [1.0, -1.0]], [[-1.0, 0.5], [0.5, -7.0], [2.0, 0.5]]):
        way = close(points, np.array([[0, 1]]), inside, np.array(corners), box)
        assert np.array_equal(way.corners, corners)
        assert way.facets.tolist()[0] == [0, 2]
        assert way.facets.tolist()[-1] == [len(corners) + 1, 1]
    with pytest.raises(DrySideError, match="crosses the box"):
        close(points, np.array([[0, 1]]), inside, np.array([[0.5, 0.0], [1.0, 0.0]]), box)
