"""Multigrid around thin bodies: coarse nodes have copies for each side, and iterations are those of thick bodies."""

import sys

import numpy as np
import pytest
from fluid_setup import block, body, field, make_fluid, step
from mpi4py import MPI
from programs import on_processes
from scipy import sparse
from scipy.sparse.linalg import splu
from thin_space import duct, plate, turn

from solvers.fluid.grid.box import uniform
from solvers.fluid.grid.nested import RefinedBox, refined
from solvers.fluid.solve.linear_systems.level_grid import LevelGrid
from solvers.fluid.terms.boundary.patches import Patch
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings

SLOW = pytest.mark.slow
SEALS, OPEN = 1.6, 0.13  #: where a plate ends


def channel_with_plate(
    grid, cell, thickness, end=SEALS, *, element="q1q1", method="iterative", dt=None, comm=MPI.COMM_SELF
):
    """Stokes flow by given pressures through a channel across which a slanted plate stands; cell: [m]."""
    points, facets = block([-thickness * cell / 2, -1.6, -1.6], [thickness * cell / 2, end, 1.6])
    patches = [
        Patch("in", ("x-",), "traction", field(2.0, 0.0, 0.0)),
        Patch("out", ("x+",), "traction", field(-0.7, 0.0, 0.0)),
        Patch("walls", ("y-", "y+", "z-", "z+"), "slip"),
    ]
    fluid = make_fluid(
        grid, patches, [body("plate", points @ turn(0.1, 0.07).T + [0.93, 0.5, 0.5], facets)],
        solver=SolverSettings(Tolerance(1e-6), linear=method, linear_tolerance=1e-9), element=element,
        scheme="bdf2" if dt else "steady", dt=dt or 1.0, convection=False, comm=comm,
    )  # fmt: skip
    fluid.begin_step(0.0, dt or 1.0)
    fluid.residual()
    return fluid


def equal_cells(count):
    return uniform([0, 0, 0], [2, 1, 1], [2 * count, count, count])


def nested_cells(count):
    """Of two levels; the finest ones are as wide as those of `equal_cells`."""
    coarse = uniform([-1, 0, 0], [3, 1, 1], [2 * count, count // 2, count // 2])
    return refined(coarse, [RefinedBox([0.1, 0.0, 0.0], [1.7, 1.0, 1.0], 1)])


def first_system(fluid):
    """Solution of the first linear system, and the iterations for it."""
    fluid.advance()
    return fluid.flow.copy(), fluid.iterate.linear_iterations


@pytest.mark.parametrize("cells", [equal_cells, nested_cells])
@pytest.mark.parametrize(("element", "count"), [("q1q1", 8), ("q2q1", 6)])
def test_no_coarse_node_has_both_sides(element, count, cells):
    """Pressures are 2 and 0.7 on the sides of a plate that seals: those that depend on a coarse one are equal.

    The columns of interpolations are independent: coarse matrices are regular.
    """
    fluid = channel_with_plate(cells(count), 1 / count, 0.2, element=element, method="direct")
    fluid.advance()
    free, flow = ~fluid.iterate.held, fluid.flow[: fluid.unknowns.owned]
    levels = fluid.iterate.solver.create_multigrid()
    of_coarse = sparse.identity(fluid.unknowns.owned, format="csr")
    levels_below = list(zip(levels.levels[1:], levels._interpolations, strict=True))
    assert len(levels_below) >= 2 if element == "q2q1" else levels_below
    for number, (level, P) in enumerate(levels_below):
        start, column, weight = P.getValuesCSR()
        one = sparse.csr_matrix((weight, column, start), shape=P.size)
        assert abs(one[one.getnnz(axis=1) > 0].sum(axis=1) - 1.0).max() < 1e-12
        assert np.abs(splu((one.T @ one).tocsc()).U.diagonal()).min() > 1e-3
        of_coarse = of_coarse @ one
        pressure = level.components[-1]
        if element == "q2q1" and number == 0:
            continue
        kids = of_coarse[:, pressure.dofs - level.start].tocoo()
        some = free[kids.row] & (kids.data > 0.0)
        row, column = kids.row[some], kids.col[some]
        least, most = np.full(len(pressure.dofs), np.inf), np.full(len(pressure.dofs), -np.inf)
        np.minimum.at(least, column, flow[row])
        np.maximum.at(most, column, flow[row])
        has = np.isfinite(least)
        assert np.abs(most[has] - least[has]).max() < 1e-7
        assert {round(p, 6) for p in most[has]} == {0.7, 2.0}


def test_levels_of_nested_cells_look_at_nodes_of_the_mesh_alone(monkeypatch):
    """Not at those of the finest lattice, of which many do not exist, and at these once for all components."""
    asked, found = [], LevelGrid.interpolation
    monkeypatch.setattr(LevelGrid, "interpolation", lambda self, x: asked.append(len(x)) or found(self, x))
    fluid = channel_with_plate(nested_cells(12), 1 / 12, 0.2, OPEN)
    levels = fluid.iterate.solver.create_multigrid().levels
    assert max(asked) == fluid.unknowns.pressure.owned < np.prod(levels[0].components[0].lattice.shape)
    assert len(asked) == 2 * (len(levels) - 1)  # for copies, and for values


#: element, cells, time step, grid, where the plate ends: each pair of them is in one quick test; the others are slow
QUICK_PLATES = (
    ("q1q1", 10, None, equal_cells, SEALS), ("q1q1", 10, None, nested_cells, OPEN),
    ("q1q1", 10, 0.01, equal_cells, OPEN), ("q1q1", 10, 0.01, nested_cells, SEALS),
    ("q2q1", 6, None, equal_cells, OPEN),
)  # fmt: skip
ALL_PLATES = [
    (element, count, dt, cells, end)
    for element, count in (("q1q1", 10), ("q2q1", 6))
    for dt in (None, 0.01)
    for cells in (equal_cells, nested_cells)
    for end in (SEALS, OPEN)
]


@pytest.mark.parametrize(
    ("element", "count", "dt", "cells", "end"),
    [pytest.param(*plate, marks=() if plate in QUICK_PLATES else SLOW) for plate in ALL_PLATES],
)
def test_as_many_iterations_as_around_a_thick_plate(element, count, end, cells, dt):
    """And the solution of the direct solver."""
    found = {}
    for thickness in (0.2, 2.0):
        fluid = channel_with_plate(cells(count), 1 / count, thickness, end, element=element, dt=dt)
        found[thickness] = first_system(fluid)
        assert fluid.iterate.solver.sequence.current == "multigrid"
    exact = channel_with_plate(cells(count), 1 / count, 0.2, end, element=element, method="direct", dt=dt)
    assert end == OPEN or exact.grid.sheets is not None
    flow, _ = first_system(exact)
    assert np.abs(found[0.2][0] - flow).max() < 1e-6 * np.abs(flow).max()
    assert found[0.2][1] <= 1.5 * found[2.0][1]


@SLOW
@pytest.mark.parametrize(("element", "count"), [("q1q1", 24), ("q1q1", 32), ("q2q1", 16)])
def test_iterations_around_thin_plates_in_many_cells(element, count):
    """Up to 280,000 unknowns, one step in time."""
    counts = [
        first_system(channel_with_plate(equal_cells(count), 1 / count, thickness, element=element, dt=0.01))[1]
        for thickness in (0.2, 2.0)
    ]
    assert counts[0] <= 1.5 * counts[1]


@pytest.mark.parametrize("element", ["q1q1", pytest.param("q2q1", marks=SLOW)])
def test_plate_that_is_pushed_through_a_duct_with_multigrid(element):
    """Cells and copies follow it; the fluid moves with it, and it carries the difference of the pressures."""
    grid, speed = uniform([0, 0, 0], [4.0, 1.0, 1.0], [16, 4, 4]), np.array([0.5, 0.0, 0.0])
    points, facets, normal = plate(0.1, np.random.default_rng(3))
    points = points + np.array([0.2, 0.1, 0.1])
    moved = body("plate", points, facets, motion=lambda x, t: (x + t * speed, 0.0 * x + speed))
    solver = SolverSettings(Tolerance(1e-10), linear="iterative", linear_tolerance=1e-11)
    fluid = duct(
        [moved], element, (1.0, 0.7), grid=grid, mu=0.05, dt=0.2, initial_velocity=field(0.5, 0.0, 0.0), solver=solver
    )
    force = 0.3 / normal[0] * normal
    for number in range(3):
        step(fluid, 0.2 * number, 0.2)
        nodes = fluid.unknowns.velocity.dofs
        velocity = fluid.flow[nodes][fluid.system.active_dofs[nodes[:, 0]]]
        assert np.abs(velocity - speed).max() < 1e-8
        assert np.abs(fluid.force()["plate"].sum(axis=0) - force).max() < 1e-8
        assert fluid.iterate.solver.sequence.multigrid


@pytest.mark.parametrize(
    ("processes", "element", "count"),
    [(2, "q1q1", 8), pytest.param(3, "q1q1", 8, marks=SLOW), pytest.param(2, "q2q1", 8, marks=SLOW)],
)
def test_multigrid_around_thin_plates_on_processes(processes, element, count):
    """The same forces as on one, in equal and nested cells; all unknowns belong to nodes; equal ones are in blocks."""
    on_processes(processes, __file__, element, count)


def require_a_block(grid):
    """Owned cells of the box are a block, and those of thin bodies with fluid are in it; some process has some."""
    size, sheets, own = grid.grid.size, grid.sheets, grid.in_sheets[: grid.owned]
    in_box, others = own[own < size], own[(own >= size) & (own < size + sheets.singles)]
    index = np.stack(np.unravel_index(in_box, grid.grid.shape, order="F"))
    assert np.prod(index.max(axis=1) - index.min(axis=1) + 1) == len(in_box)
    assert MPI.COMM_WORLD.allreduce(len(others)) > 0
    assert np.isin(sheets.box_cells(others), in_box).all()


def main(element, count):
    for cells in (equal_cells, nested_cells):
        forces = []
        for comm in (MPI.COMM_WORLD, MPI.COMM_SELF):
            fluid = channel_with_plate(cells(count), 1 / count, 0.2, OPEN, element=element, comm=comm)
            _, iterations = first_system(fluid)
            fluid.residual()
            forces.append((fluid.force()["plate"].sum(axis=0), iterations))
            assert fluid.iterate.solver.sequence.current == "multigrid"
            assert fluid.grid.sheets is not None
            unknowns = fluid.unknowns
            assert unknowns.owned == unknowns.velocity.owned * unknowns.dim + unknowns.pressure.owned
            if comm.size > 1 and cells is equal_cells:
                require_a_block(fluid.grid)
        (force, many), (alone, few) = forces
        assert np.abs(force - alone).max() < 1e-7 * np.abs(alone).max(), (force, alone)
        assert many <= few + 6, (many, few)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
