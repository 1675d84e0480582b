"""Twins of cases: their settings are cases, and change what they say and nothing else."""

import json
from pathlib import Path

import numpy as np
import pytest

from fsci.builder.automatic_pairs import with_pairs
from fsci.case import load_case
from fsci.case.grid import GridSection
from fsci.twin.changes import COSTS, QUICK_COST, Twin, quick, twins
from fsci.twin.grids import low_discrepancy

CASES = sorted(path.parent for path in (Path(__file__).parents[2] / "cases").glob("*/case.yaml"))
FLOW = """
time: {step: 0.1, end: 1}
fluid:
  density: 1
  viscosity: 1
  narrow_gaps: true
  grid:
    from: [0, -1]
    to: [4, 1]
    cells: [10, null]
    y: [{to: 0, cells: 5, ratio: 2}, {to: 1, cells: 4}]
    refine: [{around: disc, layers: 12}, {around: box, layers: 4}]
  patches: {all: {on: [x-, x+, y-, y+], no_slip: true}}
  bodies:
    disc: {mesh: {shape: disc, radius: 0.3, cells: [24, 2]}}
    box: {mesh: {shape: rectangle, origin: [2, 0], size: [0.3, 0.3], cells: [2, 2]}}
"""


#: cases with the settings of another one
ALIKE = (
    "cylinder_2d2",
    "csm2",
    "csm3",
    "fsi3",
    "falling_rigid_sphere",
    "torus_rough",
    "torus_wall_fine",
    "valve_thin",
    "leaflet_pulsating",
    "sealed_plate",
)


@pytest.mark.parametrize(
    "folder",
    [pytest.param(folder, id=folder.name, marks=pytest.mark.slow if folder.name in ALIKE else ()) for folder in CASES],
)
def test_twins_are_cases(folder):
    case = load_case(folder)
    found = twins(case)
    assert len({twin.name for twin in found}) == len(found)
    for twin in found:
        other = load_case(folder, twin.settings)
        assert (json.dumps(other.settings) != json.dumps(case.settings)) == bool(twin.settings), twin.name


@pytest.mark.parametrize("folder", CASES, ids=lambda folder: folder.name)
def test_quick_twins_of_cases(folder):
    """Each case has one or two, and they cost at most 2.5 times the case."""
    names = [twin.name for twin in quick(twins(load_case(folder)))]
    assert len(names) in (1, 2)
    assert sum(COSTS[name] for name in names) <= QUICK_COST


@pytest.mark.parametrize(
    ("there", "chosen"),
    [
        (["coarse", "element", "scheme", "step", "shift_1"], ["coarse", "scheme"]),
        (["coarse", "element", "processes"], ["coarse"]),  # a steady flow: the same element in small cells costs more
        (["element", "scheme", "step"], ["scheme", "element"]),  # q1q1 in place of q2q1
        (["scheme", "step", "order"], ["scheme", "order"]),
        (["step", "order", "c_n"], ["order"]),
        (["step", "processes"], ["step"]),
    ],
)
def test_quick_twins(there, chosen):
    assert [twin.name for twin in quick([Twin(name, name, "space") for name in there])] == chosen


@pytest.fixture
def flow(tmp_path):
    path = tmp_path / "case.yaml"
    path.write_text(FLOW)

    def other(name):
        case = load_case(path)
        return case, load_case(path, next(twin.settings for twin in twins(case) if twin.name == name))

    return other


def test_cells_twice_as_large(flow):
    _, other = flow("coarse")
    assert other.fluid.element == "q2q1"
    assert not other.fluid.narrow_gaps
    assert other.fluid.grid.shape == (5, 5)
    assert [part.layers for part in other.fluid.grid.refine] == [6, 4]  # three are needed


@pytest.mark.parametrize("number", range(1, 9))
def test_planes_are_moved_by_less_than_half_a_cell(flow, number):
    case, other = flow(f"shift_{number}")
    for before, after in zip(case.fluid.grid.planes, other.fluid.grid.planes, strict=True):
        assert len(before) == len(after)
        assert (before[[0, -1]] == after[[0, -1]]).all()
        share = (after - before)[1:-1] / ((before[2:] - before[:-2]) / 2.0)
        assert share == pytest.approx(share[0])
        assert 0.0 < abs(share[0]) <= 0.5


def test_equal_cells_have_three_stretches(flow):
    _, other = flow("shift_1")
    assert [stretch.cells for stretch in other.fluid.grid.x] == [1, 8, 1]


def test_facets_of_round_bodies(flow):
    case, other = flow("facets")
    assert other.fluid.bodies["disc"].mesh.cells == (48, 4)
    assert other.fluid.bodies["box"] == case.fluid.bodies["box"]


@pytest.mark.parametrize("dimension", [1, 2, 3])
def test_points_fill_the_cube(dimension):
    """The first one is the golden ratio's; the mean of the points goes to the middle as 1/N, at random as N^-1/2."""
    points = low_discrepancy(dimension, 64)
    assert np.abs(points).max() <= 0.5
    assert np.abs(points.mean(axis=0)).max() < 0.03
    if dimension == 1:
        assert points[:, 0] == pytest.approx((0.5 + np.arange(1, 65) * 2.0 / (1.0 + 5.0**0.5)) % 1.0 - 0.5)


def test_direction_with_one_cell_stays(tmp_path):
    grid = GridSection(**{"from": [0, 0], "to": [1, 1], "cells": [1, 2]})
    from fsci.twin.grids import shifted

    changed = dict(shifted(grid, (0.4, 0.4)))
    assert changed["fluid.grid.x"] == '[{"to": 1.0, "cells": 1}]'


CONTACT = """
time: {step: 1, end: 1}
structure:
  bodies:
    low: {mesh: {shape: rectangle, size: [1, 1], cells: [2, 2], order: 1}, material: {law: neo_hooke, E: 1, nu: 0.3}}
    high:
      mesh: {shape: rectangle, size: [1, 1], origin: [0, 1], cells: [3, 3], order: 2}
      material: {law: neo_hooke, E: 1, nu: 0.3}
contact:
  obstacles: {floor: {mesh: {shape: rectangle, size: [9, 1], origin: [-4, -1], cells: [1, 1]}, on: top}}
  pairs:
    blocks: {slave: {body: high, on: bottom}, master: {body: low, on: top}, friction: {coefficient: 0.3}}
    support: {slave: {body: low, on: bottom}, master: {obstacle: floor}}
"""


def test_roles(tmp_path):
    path = tmp_path / "case.yaml"
    path.write_text(CONTACT)
    found = {twin.name: twin for twin in twins(load_case(path))}
    assert set(found) == {"step", "order", "exchange", "reversed", "c_n", "mirrored", "turned", "processes"}
    pair = load_case(path, found["exchange"].settings).contact.pairs
    assert (pair["blocks"].slave.body, pair["blocks"].master.body) == ("low", "high")
    assert pair["blocks"].friction.coefficient == 0.3
    assert pair["support"].slave.body == "low"
    assert found["exchange"].opposite == ("contact.blocks.x", "contact.blocks.y", "contact.blocks.z")
    bodies = load_case(path, found["order"].settings).structure.bodies
    assert [body.mesh.order for body in bodies.values()] == [2, 2]
    assert list(load_case(path, found["reversed"].settings).contact.pairs) == ["support", "blocks"]


def test_roles_that_the_program_chooses(tmp_path):
    """Of two equal blocks the first one is the slave. In the opposite order it still is; roles are exchanged alone."""
    path = tmp_path / "case.yaml"
    text = CONTACT.replace("cells: [3, 3], order: 2", "cells: [2, 2], order: 1")
    path.write_text(text[: text.index("contact:")] + "contact: {bodies: all}\n")
    found = {twin.name: twin for twin in twins(load_case(path))}
    name = "low_top_high_bottom"

    def slave(twin):
        case = load_case(path, twin.settings)
        pairs = with_pairs(case).contact.pairs
        assert list(pairs) == [name]
        return list(case.elastic_bodies), pairs[name].slave.body, pairs[name].slave.on

    assert slave(Twin("case", "", "space")) == (["low", "high"], "low", ("top",))
    assert slave(found["reversed"]) == (["high", "low"], "low", ("top",))
    assert slave(found["exchange"]) == (["low", "high"], "high", ("bottom",))
    assert found["exchange"].opposite == (f"contact.{name}.x", f"contact.{name}.y", f"contact.{name}.z")
