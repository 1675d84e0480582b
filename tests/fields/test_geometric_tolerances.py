"""Geometric tolerances of the flow: results are the same over six decades of each one, where nothing is as small."""

import sys

import numpy as np
import pytest
from fluid_setup import block, body, field, make_fluid, solve_steady, turned

from solvers.fluid.flow.probes import flow_rate
from solvers.fluid.geometry.pieces import off_boundary
from solvers.fluid.geometry.thin.sheets import find_sheets
from solvers.fluid.grid.box import uniform
from solvers.fluid.surfaces.inside import INSIDE, winding
from solvers.fluid.surfaces.surface import Motion
from solvers.fluid.terms.boundary.patches import Patch

DECADES = 10.0 ** np.arange(-3, 4)


def scaled(monkeypatch, name, factor):
    """Multiply a constant in all modules that have it."""
    modules = [m for n, m in sorted(sys.modules.items()) if n.startswith("solvers.") and name in vars(m)]
    assert modules
    for module in modules:
        monkeypatch.setattr(module, name, factor * vars(module)[name])


def turned_blocks(angles, shapes):
    about = [1.13, 0.48]
    return [body(name, turned(x, angles.get(name, 0.0), about), facets) for name, (x, facets) in shapes.items()]


def bodies(thin):
    """A block on the floor with sides in planes of the grid but for rounding, and bodies that are turned.

    thin: two plates that touch each other, and two squares that overlap; else two blocks of several cells that touch.
    """
    on_floor = block([0.1 + 0.2, 0.0], [0.1 * 3 + 0.3, 0.3])
    if not thin:
        touching = {"left": block([0.83, 0.27], [1.13, 0.67]), "right": block([1.13, 0.31], [1.49, 0.61])}
        return turned_blocks({"left": 0.4, "right": 0.4}, {"block": on_floor, **touching})
    shapes = {
        "block": on_floor,
        "left": block([1.1, 0.27], [1.13, 0.71]),
        "right": block([1.13, 0.3], [1.17, 0.66]),
        "low": block([1.55, 0.25], [1.75, 0.45]),
        "high": block([1.63, 0.37], [1.83, 0.57]),
    }
    return turned_blocks({"left": 0.4, "right": 0.4, "low": 0.2, "high": -0.1}, shapes)


def results(thin):
    """Flow rate, forces and unknowns of a channel with these bodies."""
    patches = [
        Patch("in", ("x-",), "traction", field(1.0, 0.0)),
        Patch("out", ("x+",), "traction", field(0.0, 0.0)),
        Patch("walls", ("y-", "y+"), "no_slip"),
    ]
    fluid = make_fluid(uniform([0, 0], [2.2, 1], [22, 10]), patches, bodies(thin), mu=1.0, scheme="steady")
    solve_steady(fluid)
    forces = [force.sum(axis=0) for force in fluid.force().values()]
    return np.array([len(fluid.flow), flow_rate(fluid)(["out"]), *np.ravel(forces)])


@pytest.fixture(scope="module")
def nominal():
    return {thin: results(thin) for thin in (True, False)}


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    ["NOTHING", "FLUSH", "SAME_VOLUME", "ROUNDING_OF_AREA", "ROUNDING_OF_POSITION", "TOUCHING"],
)
def test_flow_does_not_depend_on_a_tolerance(monkeypatch, nominal, name):
    for factor in DECADES:
        with monkeypatch.context() as patch:
            scaled(patch, name, factor)
            for thin, expected in nominal.items():
                np.testing.assert_allclose(results(thin), expected, rtol=1e-6, err_msg=f"{name} times {factor:g}")


def test_points_in_planes_of_facets(monkeypatch):
    """Also those in the planes of facets, before edges that are prolonged; corners are outside."""
    x, facets = block([0.1, 0.2, 0.3], [0.4, 0.7, 0.9])
    x = turned(x, 0.7)
    motion, middle = Motion(x, 0.0 * x), x.mean(axis=0)
    points = [middle, *(0.5 * (middle + x)), *(x + 0.5 * (x - middle) * [0, 0, 1]), *(middle + 1.5 * (x - middle))]
    expected = np.array([winding(point, motion, facets) > INSIDE for point in points])
    assert expected.tolist() == [True] * 9 + [False] * 16
    for factor in DECADES:
        with monkeypatch.context() as patch:
            scaled(patch, "IN_PLANE", factor)
            inside = 1.0 - 1e3 * min(factor * 1e-9, 1e-4)
            np.testing.assert_array_equal([winding(point, motion, facets) > inside for point in points], expected)
            assert all(winding(corner, motion, facets) < inside for corner in x)


def test_region_beside_a_point(monkeypatch):
    """Both sides of a thin plate."""
    grid = uniform([0, 0], [1, 1], [10, 10])
    x, facets = block([0.4, 0.2], [0.41, 0.83])
    x = turned(x, 0.3, [0.4, 0.5])
    sheets = find_sheets(grid, facets, x, off_boundary(grid, x[facets]), always=True)
    places = [turned(np.array([[0.4 + way, 0.5]]), 0.3, [0.4, 0.5])[0] for way in (-0.02, -0.001, 0.011, 0.03)]
    cells = [(int(10 * p[0]) + 10 * int(10 * p[1]), 10 * p % 1.0) for p in places]

    def found():
        return [sheets.parts.region_at(cell, s) for cell, s in cells]

    regions = found()
    assert regions[0] == regions[1] != regions[2] == regions[3]
    for factor in 2.0 * 10.0 ** np.arange(-4, 3):  # from the closing length on
        with monkeypatch.context() as patch:
            scaled(patch, "BESIDE_POINT", factor)
            assert found() == regions
