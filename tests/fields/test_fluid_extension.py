"""Nodes of q2q1 that fluid hardly reaches: they continue polynomials exactly, lose nothing, and no constant matters."""

from functools import partial, reduce
from itertools import product

import numpy as np
import pytest
from fluid_setup import block, body, circle, field, loop, make_fluid, step, turned, wall
from scipy.optimize import brentq

from fsci.bench import fluid as bench
from solvers.fluid.cut.extension import FREE_SHARE, Extension, lagrange
from solvers.fluid.grid.box import Grid, uniform
from solvers.fluid.settings.flow_settings import FlowSettings
from solvers.fluid.settings.penalties import Penalties


def around_a_disc(scheme="steady", **settings):
    """A flow on cells of different sizes, cut by a disc that moves and by a turned block; after its first cut."""
    x = np.concatenate([np.linspace(0, 0.3, 7), [0.34, 0.4, 0.47, 0.55], np.linspace(0.6, 1, 6)])
    v = np.array([0.5, 0.2])
    disc = body("disc", circle((0.31, 0.42), 0.17, 40), loop(40), motion=lambda x, t: (x + t * v, 0 * x + v))
    points, facets = block([0.66, 0.6], [0.81, 0.83])
    fluid = make_fluid(
        Grid((x, np.linspace(0, 1, 15))), [wall(field(0, 0))], [disc, body("block", turned(points, 0.3), facets)],
        element="q2q1", scheme=scheme, dt=0.02, **settings,
    )  # fmt: skip
    fluid.begin_step(0.0, 0.02)
    fluid.residual()
    return fluid


def at_nodes(fluid, polynomial):
    """A polynomial of (x, y) at all nodes of velocity and pressure, as owned dofs."""
    values = np.zeros(fluid.unknowns.owned)
    for nodes in (fluid.unknowns.velocity, fluid.unknowns.pressure):
        values[nodes.dofs] = polynomial(*nodes.points.T)[:, None]
    return values


def penalty(fluid, values):
    """The penalty's matrix times owned values."""
    matrix = fluid.system.matrix.penalty.matrix
    x, y = matrix.createVecs()
    x.array[:] = values
    matrix.mult(x, y)
    return y.array.copy()


@pytest.mark.parametrize("scheme", ["steady", "bdf2"])
def test_polynomials_have_no_distance_to_their_extension(scheme):
    """On cells of different sizes, too: those of second degree of the velocity, of first degree of the pressure."""
    fluid = around_a_disc(scheme)
    velocity, pressure = fluid.unknowns.velocity.dofs, fluid.unknowns.pressure.dofs
    assert fluid.system.cut_penalty.dependent.sum() > 20
    rough = np.abs(penalty(fluid, at_nodes(fluid, lambda x, y: np.sin(40 * x * y))))
    linear = penalty(fluid, at_nodes(fluid, lambda x, y: 1 + 2 * x - 3 * y + x * y))
    quadratic = penalty(fluid, at_nodes(fluid, lambda x, y: x * x - 2 * y * y + x * x * y))
    assert np.abs(linear[velocity]).max() < 1e-11 * rough[velocity].max()
    assert np.abs(linear[pressure]).max() < 1e-11 * rough[pressure].max()
    assert np.abs(quadratic[velocity]).max() < 1e-11 * rough[velocity].max()
    assert np.abs(quadratic[pressure]).max() > 1e-4 * rough[pressure].max()


def amplification(dim, degree, points, weights, at):
    """Largest value at a place of a polynomial of mean square 1 in the region of a quadrature rule."""

    def functions(x):
        factors = [lagrange(x[:, axis], degree) for axis in range(dim)]
        return reduce(lambda a, b: (a[:, :, None] * b[:, None, :]).reshape(len(a), -1), factors)

    N, value = functions(points), functions(np.array([at], dtype=float))[0]
    return np.sqrt(weights.sum() * value @ np.linalg.solve((N.T * weights) @ N, value))


def below_a_corner(dim, level):
    """Quadrature rule of sum(x) < level in the unit cell: simplices at its corners, with alternating signs."""
    places, w = np.polynomial.legendre.leggauss(8)
    grids = (np.stack(np.meshgrid(*[some] * dim), axis=-1).reshape(-1, dim) for some in (0.5 + places / 2, w / 2))
    simplex, weights = next(grids), next(grids).prod(axis=1)
    left = np.cumprod(np.column_stack([np.ones(len(simplex)), 1.0 - simplex[:, :-1]]), axis=1)
    simplex, weights = simplex * left, weights * left.prod(axis=1)
    corners = [np.array(corner) for corner in product((0, 1), repeat=dim) if sum(corner) < level]
    sizes = [level - corner.sum() for corner in corners]
    points = [corner + size * simplex for corner, size in zip(corners, sizes, strict=True)]
    signed = [(-1) ** corner.sum() * size**dim * weights for corner, size in zip(corners, sizes, strict=True)]
    return np.concatenate(points), np.concatenate(signed)


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("dim", [2, 3])
def test_free_nodes_are_determined_as_well_as_the_neighbours_of_a_whole_cell(dim, degree):
    """Where a plane cuts off a corner; planes along the cell amplify less."""
    neighbour = amplification(dim, degree, *below_a_corner(dim, dim), [2.0] + [1.0] * (dim - 1))
    assert neighbour == pytest.approx(np.sqrt({1: 28, 2: 873}[degree]) * (degree + 1) ** (dim - 1), rel=1e-9)

    def excess(level):
        return amplification(dim, degree, *below_a_corner(dim, level), [1.0] * dim) - neighbour

    share = below_a_corner(dim, brentq(excess, 0.5 * dim, dim))[1].sum()
    assert share == pytest.approx({2: 0.7, 3: FREE_SHARE[3]}[dim], abs=0.005 if degree == 2 else 0.025)
    points, weights = below_a_corner(dim, dim)
    along = amplification(dim, degree, points * ([1.0] * (dim - 1) + [share]), weights, [1.0] * dim)
    assert along < neighbour


def test_rounding_is_not_amplified_far_from_the_fluid():
    """Behind a corner of the fluid in space a parabola would be 117,649 times as large: a line goes on, 729 times."""
    grid, share = uniform([0, 0, 0], [1, 1, 1], [8, 8, 8]), np.zeros((8, 8, 8))
    share[:4, :4, :4] = 1.0
    found = Extension(grid, 2, (17,) * 3, np.arange(17**3))(share.ravel(), np.ones(8**3, dtype=bool), 4)
    assert np.abs(found.rows).sum(axis=1).max() < 730.0
    x, y, z = np.unravel_index(np.arange(17**3), (17,) * 3, order="F")
    line = 1.0 + x - 2.0 * y + 3.0 * z
    np.testing.assert_allclose(found.rows @ line, line[found.nodes], rtol=1e-11)


def test_a_root_that_a_body_covers_within_the_step_is_replaced():
    """Columns of cells: fluid up to the third, then only up to the second, which the iterate before had as roots."""
    grid, every = uniform([0, 0], [1, 1], [6, 4]), np.ones(24, dtype=bool)
    extension = Extension(grid, 2, (13, 9), np.arange(13 * 9))
    x, y = np.unravel_index(np.arange(13 * 9), (13, 9), order="F")
    polynomial = x**2 - x * y + 3.0 * y
    for columns in (3, 2):
        share = np.zeros((6, 4))
        share[:columns] = 1.0
        found = extension(share.ravel(order="F"), every, 6)
        assert x[found.rows.indices].max() == 2 * columns
        assert len(found.undetermined) == 0
        near = x[found.nodes] <= 2 * (columns + 2)  # farther away lines are continued
        extended = found.rows @ polynomial
        assert extended[near] == pytest.approx(polynomial[found.nodes[near]], abs=1e-9)


def test_penalty_loses_no_force_and_no_volume():
    """A constant has no distance: the sum of all equations is that without the penalty."""
    fluid = around_a_disc("bdf2")
    rows = penalty(fluid, np.random.default_rng(2).normal(size=fluid.unknowns.owned))
    for dofs in (*fluid.unknowns.velocity.dofs.T, fluid.unknowns.pressure.dofs[:, 0]):
        assert abs(rows[dofs].sum()) < 1e-12 * np.abs(rows[dofs]).sum()
        assert np.abs(rows[dofs]).max() > 0.0


def test_nodes_of_well_cut_cells_are_free():
    """And those of no other cell are; where no fluid is, the velocity is what the extension says."""
    fluid = around_a_disc("bdf2")
    cut, unknowns, ghost = fluid.cut, fluid.unknowns, fluid.system.cut_penalty
    share = cut.share[fluid.grid.numbers]
    largest = np.zeros(unknowns.local)
    for cells in (cut.uncut, cut.cut, cut.strip):
        np.maximum.at(largest, unknowns.cell_velocity[cells], share[cells, None, None])
    dofs = unknowns.velocity.dofs
    asked = fluid.system.active_dofs[dofs] & ~np.isin(dofs, fluid.parts.boundary.dofs)
    assert np.array_equal((ghost.dependent | ghost.outside)[dofs][asked], (largest[dofs] < FREE_SHARE[2])[asked])
    assert np.array_equal(ghost.outside[dofs][asked], (largest[dofs] == 0.0)[asked])
    assert ghost.outside.sum() > 20


def test_velocity_behind_the_surface_goes_on_as_a_polynomial():
    """After a step the strip has the velocity that the next ones ask for: here one of first degree."""
    velocity = field(lambda x, y, t: 1 + 2 * y, lambda x, y, t: 0.5 * x)
    shape = circle((0.31, 0.42), 0.17, 40)

    def motion(points, t):
        now = points + t * np.array([0.5, 0.2])
        return now, np.stack([c(now.T, t) for c in velocity], axis=1)

    fluid = make_fluid(
        uniform([0, 0], [1, 1], [12, 14]), [wall(velocity)], [body("disc", shape, loop(40), motion=motion)],
        element="q2q1", dt=0.02, convection=False, initial_velocity=velocity,
    )  # fmt: skip
    step(fluid, 0.0, 0.02)
    outside, nodes = fluid.system.cut_penalty.outside, fluid.unknowns.velocity
    exact = np.stack([c(nodes.points.T, 0.0) for c in velocity], axis=1)
    assert outside[nodes.dofs].sum() > 20
    assert np.abs(fluid.flow[nodes.dofs] - exact)[outside[nodes.dofs]].max() < 1e-10


def test_no_constant_matters(monkeypatch):
    """The drag of 2D-1 moves by less than 0.05 % while the penalty grows by five orders of magnitude."""
    drags = []
    for factor in (0.1, 1.0, 1e4):
        settings = partial(FlowSettings, penalties=Penalties(extension=factor))
        monkeypatch.setattr(bench, "FlowSettings", settings)
        drags.append(bench.steady("q2q1", 10)["c_D error [%]"])
    assert np.ptp(drags) < 0.05
