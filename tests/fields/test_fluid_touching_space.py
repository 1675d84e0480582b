"""Thin bodies in 3D that touch or overlap: nothing flows between them, both carry the difference of the pressures."""

import numpy as np
import pytest
from fluid_setup import block, body, field, solve_steady, step
from thin_space import SIZE, duct, turn

from solvers.cut_cells import CellState, ClosedSurfaces, cut_cells
from solvers.fluid.geometry.regions import closing_length
from solvers.fluid.geometry.thin.sheets import find_sheets
from solvers.fluid.grid.box import uniform
from solvers.mesh.gauss import gauss
from solvers.mesh.tessellation import unit_normals

DRAWS = (range(1), pytest.param(range(1, 20), marks=pytest.mark.slow))
PRESSURES, AREA = (2.0, 0.7), (3 * SIZE) ** 2


def plates(thickness, depth, draw):
    """Two plates across a duct at a random place and angle, side by side over 1.5 cells, that overlap by a depth.

    thickness in cells, depth in thicknesses; the second plate is turned by so little that they overlap everywhere.
    """
    rng = np.random.default_rng(draw)
    t = thickness * SIZE
    matrix, middle = turn(*rng.uniform(-0.45, 0.45, 2)), np.array([0.875, 0.375, 0.375]) + rng.uniform(-0.1, 0.1, 3)
    below, facets = block([-t / 2, -1.6, -1.6], [t / 2, 1.6, 0.75 * SIZE])
    above, _ = block([t / 2 - depth * t, -1.6, -0.75 * SIZE], [1.5 * t - depth * t, 1.6, 1.6])
    slightly = turn(*rng.uniform(-0.4, 0.4, 2) * depth * t)
    return below @ matrix.T + middle, above @ slightly.T @ matrix.T + middle, facets


def errors(fluid, velocity):
    """(largest difference from a velocity, error of the force along the duct on both bodies together)."""
    nodes = fluid.unknowns.velocity.dofs
    found = fluid.flow[nodes][fluid.system.active_dofs[nodes[:, 0]]]
    force = sum(one.sum(axis=0)[0] for one in fluid.force().values())
    return np.abs(found - velocity).max(), abs(force - (PRESSURES[0] - PRESSURES[1]) * AREA)


@pytest.mark.parametrize("draws", DRAWS, ids=str)
@pytest.mark.parametrize("depth", [0.0, 0.02, 0.5])
@pytest.mark.parametrize("thickness", [0.05, 0.3, 1.0])
@pytest.mark.parametrize("element", ["q1q1", pytest.param("q2q1", marks=pytest.mark.slow)])
def test_two_plates_that_seal_a_duct(element, thickness, depth, draws):
    """At rest: both together carry (p1 - p2) A."""
    for draw in draws if element == "q1q1" else draws[:5]:
        below, above, facets = plates(thickness, depth, draw)
        bodies = [body("below", below, facets), body("above", above, facets)]
        fluid = duct(bodies, element, PRESSURES, scheme="steady")
        solve_steady(fluid)
        assert max(errors(fluid, np.zeros(3))) < 1e-8, draw
        assert len(fluid.grid.sheets.touching) > 0


@pytest.mark.parametrize("draws", DRAWS, ids=str)
@pytest.mark.parametrize("thickness", [0.05, 0.3])
@pytest.mark.parametrize("element", ["q1q1", pytest.param("q2q1", marks=pytest.mark.slow)])
def test_two_plates_that_move_along_a_duct(element, thickness, draws):
    """They overlap, and move with the fluid by 0.7 cells in each step: it stays uniform."""
    along, speed, dt = np.array([1.0, 0.0, 0.0]), 0.7, SIZE
    for draw in draws[:8]:
        below, above, facets = plates(thickness, 0.1, draw)
        moved = {"motion": lambda x, t: (x + speed * t * along, 0.0 * x + speed * along)}
        bodies = [
            body(*one, facets, **moved) for one in (("below", below - 0.2 * along), ("above", above - 0.2 * along))
        ]
        initial = field(speed, 0.0, 0.0)
        fluid = duct(bodies, element, PRESSURES, cells=(9, 3, 3), mu=0.05, dt=dt, initial_velocity=initial)
        for count in range(3):
            step(fluid, count * dt, dt)
            assert max(errors(fluid, speed * along)) < 1e-8, draw


@pytest.mark.parametrize("element", ["q1q1", pytest.param("q2q1", marks=pytest.mark.slow)])
def test_two_plates_that_close_a_duct(element):
    """One moves towards the other until it presses on it, and stays there: the flow between them ends."""
    dt, t = 0.1, 0.3 * SIZE
    below, facets = block([0.9, -1.0, -1.0], [0.9 + t, 2.0, 0.53])
    above, _ = block([0.9 + t, -1.0, 0.22], [0.9 + 2.0 * t, 2.0, 2.0])
    way = np.array([1.0, 0.0, 0.0])

    def motion(x, time):
        return x + 0.4 * SIZE * way * (0.95 - min(time, 4 * dt) / (4 * dt)), 0.0 * x - (time < 4.5 * dt) * SIZE * way

    fluid = duct([body("below", below, facets), body("above", above, facets, motion=motion)], element, PRESSURES,
                 mu=50.0, dt=dt)  # fmt: skip
    flows = []
    for count in range(10):
        step(fluid, count * dt, dt)
        flows.append(errors(fluid, np.zeros(3))[0])
    assert flows[2] > 1e-2
    assert flows[-1] < 1e-8
    assert errors(fluid, np.zeros(3))[1] < 1e-7


def divided(grid, facets, x, body):
    """(fluid in the box by cell, largest gap in a boundary, area of surface) of the table.

    Shares of the cells, which are cubes, and areas of their faces.
    """
    table = cut_cells(grid.edges, gauss(3)[0], ClosedSurfaces(facets, body), x, closing=closing_length(grid))
    fluid = np.where(table.state == CellState.FLUID, 1.0, np.bincount(table.cell, table.share, grid.size))
    gap, face = np.zeros((len(table.cell), 3)), np.diff(grid.edges[0])[0] ** 2
    np.add.at(gap, table.piece_region, table.piece_area[:, None] / face * unit_normals(x[facets])[table.piece_facet])
    for side, sign in ((0, -1.0), (1, 1.0)):
        some = table.face_regions[:, side] >= 0
        np.add.at(gap, (table.face_regions[some, side], table.face_axis[some]), sign * table.face_area[some])
    return fluid, np.abs(gap).max(), table.piece_area.sum() / face


@pytest.mark.parametrize("bend", [0.0, 1e-10, 1e-9, 1e-7, 1e-5, 1e-3])
def test_regions_between_bent_plates(bend):
    """Facets whose planes nearly coincide: regions are closed, their volumes and surfaces those without the solid."""
    rng = np.random.default_rng(3)
    count, t = 7, 0.03
    s = np.linspace(-0.3, 0.3, count)
    y, z = np.meshgrid(s, s, indexing="ij")
    off = [bend * rng.uniform(-1.0, 1.0, y.size) for _ in range(2)]
    # both sides of a plate, and both plates, are bent alike, so that volumes are known
    sheet = [np.stack([shift + off[0], y.ravel(), z.ravel()], axis=1) for shift in (0.0, t)]
    plate, facets = closed_plate(np.concatenate(sheet), count)
    grid, matrix = uniform([0, 0, 0], [1, 1, 1], [5, 5, 5]), turn(0.3, 0.2)
    for apart in (1e-3, -0.4 * t):
        x = np.concatenate([plate, plate + np.array([t + apart, 0.0, 0.0])]) @ matrix.T + 0.5
        both = np.concatenate([facets, facets + len(plate)])
        fluid, gap, area = divided(grid, both, x, np.repeat([0, 1], len(facets)))
        assert gap < 1e-10
        whole = 0.5 * np.linalg.norm(np.cross(*np.moveaxis(x[both[:, 1:]] - x[both[:, :1]], 1, 0)), axis=1).sum()
        assert apart < 0.0 or area * 0.2**2 == pytest.approx(whole, rel=1e-8)
        solid = 0.36 * (2.0 * t + min(apart, 0.0))
        assert fluid.sum() / grid.size == pytest.approx(1.0 - solid, abs=1e-9)


@pytest.mark.parametrize("bend", [1e-8, 1e-7])
@pytest.mark.parametrize("count", [21, 31])
def test_regions_at_a_plate_of_small_facets(count, bend):
    """Up to three facets along a cell, bent so little that rounding decides where planes meet: regions are closed."""
    y, z = np.meshgrid(*[np.linspace(-0.9, 0.9, count)] * 2, indexing="ij")
    grid = uniform([0, 0, 0], [1, 1, 1], [5, 5, 5])
    for draw in range(6):
        rng = np.random.default_rng(draw)
        ways = rng.uniform(-2.0, 2.0, (2, 2, 1, 1))
        off = bend * np.sin(ways[0] * y + ways[1] * z + 1.0).sum(axis=0).ravel()
        sheet = [np.stack([shift + off, y.ravel(), z.ravel()], axis=1) for shift in (0.0, 0.06)]
        plate, facets = closed_plate(np.concatenate(sheet), count)
        matrix = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        matrix *= np.sign(np.linalg.det(matrix))
        x = plate @ matrix.T + rng.uniform(0.4, 0.6, 3)
        assert divided(grid, facets, x, np.zeros(len(facets), dtype=int))[1] < 1e-10


def closed_plate(points, count):
    """(points, facets) of a plate: two sides of count^2 points each, and its rim."""
    number = np.arange(count * count).reshape(count, count)
    a, b, c, d = number[:-1, :-1].ravel(), number[1:, :-1].ravel(), number[1:, 1:].ravel(), number[:-1, 1:].ravel()
    back = np.concatenate([np.stack([a, c, b], axis=1), np.stack([a, d, c], axis=1)])
    front = back[:, ::-1] + count * count
    rim = np.concatenate([number[:-1, 0], number[-1, :-1], number[:0:-1, -1], number[0, :0:-1]])
    following, up = np.roll(rim, -1), count * count
    sides = [np.stack([rim, following, following + up], axis=1), np.stack([rim, following + up, rim + up], axis=1)]
    return points, np.concatenate([back, front, *sides])


def test_volume_of_the_fluid():
    """Two plates of 0.3 cells that lie on each other or overlap along their sides: exact in all."""
    grid = uniform([0, 0, 0], [1, 1, 1], [6, 6, 6])
    t, size = 0.05, 0.7
    plate, facets = block([-t / 2, -size / 2, -size / 2], [t / 2, size / 2, size / 2])
    rng = np.random.default_rng(1)
    for shift in (1.0, 0.5, 0.02):
        matrix = turn(*rng.uniform(-0.5, 0.5, 2))
        both = np.concatenate([plate, plate + np.array([shift * t, 0.1, 0.05])]) @ matrix.T + 0.48
        sheets = find_sheets(
            grid, np.concatenate([facets, facets + 8]), both, np.ones(24, dtype=bool), thin=3, always=True
        )
        overlap = (1.0 - shift) * t * (size - 0.1) * (size - 0.05)
        assert sheets.fluid.sum() / grid.size == pytest.approx(1.0 - 2.0 * t * size**2 + overlap, abs=1e-12)
        assert len(sheets.touching) > 0


def test_bodies_that_are_apart_do_not_touch_at_the_sides_of_the_box():
    """Two plates in one layer of cells: their sides in faces of the box have moments, but bound no fluid."""
    grid = uniform([0.0, 0.0, 0.0], [2.0, 0.3, 1.0], [20, 3, 10])
    one, facets = block([0.92, 0.0, 0.0], [0.95, 0.3, 0.64])
    other, _ = block([0.96, 0.0, 0.37], [0.99, 0.3, 1.0])
    both = np.concatenate([facets, facets + len(one)])
    for apart, count in ((0.0, 0), (0.01, 12)):  # cells, four layers of three
        x = np.concatenate([one + np.array([apart, 0.0, 0.0]), other])
        sheets = find_sheets(grid, both, x, np.ones(len(both), dtype=bool))
        assert len(sheets.touching) == count
