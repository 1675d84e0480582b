"""Tied bodies in a flow: no fluid between the two sides of a tie, whatever their meshes, and all of the rest is wet."""

from __future__ import annotations

import numpy as np
import pytest

from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case

#: Two halves of a flap in a channel.
FLAP = """\
title: A flap of two tied halves
time: {{step: 0.05, end: 0.65}}
fluid:
  density: 1
  viscosity: 0.1
  element: q1q1
  scheme: backward_euler
  grid: {{from: [0, 0], to: [2, 1], cells: [40, 20]}}
  patches:
    in: {{on: x-, velocity: ["1.5*4*y*(1-y)*ramp(t,0,1)", 0]}}
    out: {{on: x+, outflow: true}}
    walls: {{on: [y-, y+], no_slip: true}}
structure:
  dynamics: {{rho_inf: 0.5}}
  bodies:
    low:
      mesh: {{shape: rectangle, size: [0.22, 0.25], cells: [6, 7], origin: [{x}, 0]}}
      material: {{law: neo_hooke, E: 300, nu: 0.3, density: 1}}
      supports: [{{on: bottom, displacement: [0, 0]}}]
    high:
      mesh: {{shape: rectangle, size: [0.22, 0.25], cells: [{cells}, 6], origin: [{x}, 0.25]}}
      material: {{law: neo_hooke, E: 300, nu: 0.3, density: 1}}
contact:
  pairs:
    glue: {{{pair}, tied: true}}
coupling: {{scheme: {scheme}}}
probes:
  tip: {{body: high, field: structure, quantity: displacement, at: [{x}, 0.5]}}
  low: {{field: fluid, body: low, quantity: force}}
  high: {{field: fluid, body: high, quantity: force}}
output: {{fields_every: 0}}
"""
HIGH, LOW = "{body: high, on: bottom}", "{body: low, on: top}"

#: A narrow block on a wide one, under the pressure of a fluid at rest.
BLOCKS = """\
title: A block on a wider one
time: {{step: 1, end: 1}}
fluid:
  density: 1
  viscosity: 0.1
  element: q1q1
  scheme: steady
  grid: {{from: {low}, to: {high}, cells: {grid}}}
  patches:
    sides: {{on: {sides}, slip: true}}
    top: {{on: {top}, traction: {traction}}}
structure:
  bodies:
    wide:
      mesh: {{shape: {shape}, size: {wide}, cells: {wide_cells}, origin: {wide_origin}}}
      material: {{law: neo_hooke, E: 1e6, nu: 0.3}}
      supports: [{{on: bottom, displacement: {zero}}}]
    narrow:
      mesh: {{shape: {shape}, size: {narrow}, cells: {narrow_cells}, origin: {narrow_origin}}}
      material: {{law: neo_hooke, E: 1e6, nu: 0.3}}
contact:
  pairs:
    glue: {{slave: {{body: narrow, on: bottom}}, master: {{body: wide, on: top}}, tied: true}}
coupling: {{scheme: monolithic}}
probes:
  wide: {{field: fluid, body: wide, quantity: force}}
  narrow: {{field: fluid, body: narrow, quantity: force}}
output: {{fields_every: 0}}
"""
PLANE = {
    "low": [0, 0],
    "high": [2, 1],
    "grid": [20, 10],
    "sides": "[x-, x+, y-]",
    "top": "y+",
    "traction": [0, -7],
    "shape": "rectangle",
    "wide": [0.9, 0.25],
    "wide_cells": [6, 3],
    "wide_origin": [0.51, 0.2],
    "zero": [0, 0],
    "narrow": [0.31, 0.25],
    "narrow_cells": [5, 4],
    "narrow_origin": [0.823, 0.45],
}
SPACE = {
    "low": [0, 0, 0],
    "high": [1.5, 1, 1],
    "grid": [9, 6, 6],
    "sides": "[x-, x+, y-, y+, z-]",
    "top": "z+",
    "traction": [0, 0, -7],
    "shape": "box",
    "wide": [0.9, 0.6, 0.25],
    "wide_cells": [4, 3, 2],
    "wide_origin": [0.31, 0.2, 0.2],
    "zero": [0, 0, 0],
    "narrow": [0.31, 0.33, 0.25],
    "narrow_cells": [3, 4, 2],
    "narrow_origin": [0.523, 0.315, 0.45],
}


def run(folder, text):
    folder.mkdir(exist_ok=True)
    (folder / "case.yaml").write_text(text)
    assert run_case(load_case(folder / "case.yaml"), folder / "run") == FINISHED
    return read_history(folder / "run" / "history.csv")


@pytest.mark.parametrize(
    ("pair", "cells", "scheme", "x"),
    [
        pytest.param(f"slave: {HIGH}, master: {LOW}", 5, "monolithic", 0.81, marks=pytest.mark.slow),
        pytest.param(f"slave: {LOW}, master: {HIGH}", 5, "monolithic", 0.81 + 0.05 / 3, marks=pytest.mark.slow),
        pytest.param(f"slave: {HIGH}, master: {LOW}", 4, "partitioned", 0.81, marks=pytest.mark.slow),
    ],
)
def test_halves_with_other_cells_move_as_those_with_the_same(tmp_path, pair, cells, scheme, x):
    """Tied facets lay on each other by rounding, counted as wet, and the run failed in its second step."""
    found = run(tmp_path / "other", FLAP.format(pair=pair, cells=cells, scheme=scheme, x=x))
    same = run(tmp_path / "same", FLAP.format(pair=pair, cells=6, scheme=scheme, x=x))
    assert found["tip.x"][-1] > 0.2
    for column in ("tip.x", "low.x", "high.x"):
        assert found[column][-1] == pytest.approx(same[column][-1], rel=0.01, abs=0.01)
    assert np.abs(found["fluid.mass"]).max() < 1e-10


@pytest.mark.parametrize(
    ("scene", "axis", "area"), [(PLANE, "y", 0.31), pytest.param(SPACE, "z", 0.31 * 0.33, marks=pytest.mark.slow)]
)
def test_a_block_on_a_wider_one_hides_its_own_area(tmp_path, scene, axis, area):
    """Both have the pressure 7 Pa on all of their surface but the tie: the same force, up and down."""
    found = run(tmp_path / "tee", BLOCKS.format(**scene))
    assert found[f"narrow.{axis}"][-1] == pytest.approx(-7 * area, rel=2e-3)
    assert found[f"wide.{axis}"][-1] == pytest.approx(7 * area, rel=2e-3)


PLATE = """\
time: {step: 0.05, end: 0.2}
fluid:
  density: 1
  viscosity: 0.01
  element: q1q1
  scheme: backward_euler
  grid: {from: [0, 0, 0], to: [1.2, 0.6, 0.6], cells: [10, 5, 5]}
  patches:
    inlet: {on: x-, traction: [1, 0, 0]}
    outlet: {on: x+, traction: [0, 0, 0]}
    walls: {on: [y-, y+, z-, z+], slip: true}
structure:
  dynamics: {rho_inf: 0.5}
  bodies:
    low:
      mesh: {shape: box, size: [0.04, 0.6, 0.31], cells: [1, 3, 2], order: 1, origin: [0.57, 0, 0]}
      material: {law: neo_hooke, E: 1e6, nu: 0.3, density: 1}
      supports: [{on: bottom, displacement: [0, 0, 0]}]
    high:
      mesh: {shape: box, size: [0.04, 0.6, 0.29], cells: [1, 4, 3], order: 1, origin: [0.57, 0, 0.31]}
      material: {law: neo_hooke, E: 1e6, nu: 0.3, density: 1}
      supports: [{on: top, displacement: [0, 0, 0]}]
contact:
  pairs:
    glue: {slave: {body: high, on: bottom}, master: {body: low, on: top}, tied: true}
coupling: {scheme: monolithic}
probes:
  flow: {quantity: flow_rate, through: outlet}
  low: {field: fluid, body: low, quantity: force}
  high: {field: fluid, body: high, quantity: force}
output: {fields_every: 0}
"""


def test_a_thin_plate_of_two_tied_halves_seals_a_duct(tmp_path):
    """Their cells do not match. Each half carries 1 Pa on its area; facets with gaps between them had no sheets."""
    found = run(tmp_path / "plate", PLATE)
    assert len(found["time"]) == 4  # no step is repeated
    assert found["low.x"][-1] == pytest.approx(0.6 * 0.31, rel=1e-4)
    assert found["high.x"][-1] == pytest.approx(0.6 * 0.29, rel=1e-4)
    assert abs(found["flow"][-1]) < 1e-7
    assert np.abs(found["fluid.mass"]).max() < 1e-8


@pytest.mark.slow
def test_a_plate_of_second_order_seals_a_duct(tmp_path):
    """Held at the sides of the duct, too: there a plate that bends would open gaps of 1e-5 cells to the walls, which no
    cell resolves. It was taken for a leak of the tie; one plate without a tie has it, and first order, if it bends."""
    text = PLATE.replace("order: 1", "order: 2")
    for end in ("bottom", "top"):
        held = f"supports: [{{on: {end}, displacement: [0, 0, 0]}}"
        assert text.count(held) == 1
        text = text.replace(held, f"{held}, {{on: [front, back], symmetry: true}}")
    found = run(tmp_path / "plate", text)
    assert len(found["time"]) == 4
    assert found["low.x"][-1] == pytest.approx(0.6 * 0.31, rel=1e-3)
    assert found["high.x"][-1] == pytest.approx(0.6 * 0.29, rel=1e-3)
    assert abs(found["flow"][-1]) < 1e-5
    assert np.abs(found["fluid.mass"]).max() < 1e-8
