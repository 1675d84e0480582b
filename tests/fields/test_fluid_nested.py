"""Nested cells: flows of the discrete space are exact across levels, and nothing hangs from what hangs."""

from itertools import product

import numpy as np
import pytest
import sympy
from fluid_setup import body, circle, errors, field, loop, make_fluid, nodal_errors, solve_steady, symbolic, wall

from solvers.fluid.flow.probes import at_point
from solvers.fluid.grid.box import uniform
from solvers.fluid.grid.nested import RefinedBox, refined

EXACT = 1e-11  #: of velocities up to 8 and pressures up to 11: 1e-12 of them


def nested(dim, levels=2, cells=4):
    """Cells of all levels around a corner and beside it."""
    grid = uniform([0] * dim, [1.2, 1, 0.8][:dim], [cells + 1, cells, cells - 1][:dim])
    boxes = [([0.3] * dim, [0.6] * dim, 1), ([0.45] * dim, [0.7] * dim, levels), ([0.95] * dim, [2] * dim, 1)]
    return refined(grid, [RefinedBox(*box) for box in boxes])


@pytest.mark.parametrize("dim", [2, 3])
def test_cells_that_share_a_corner_differ_by_one_level_at_most(dim):
    grid = refined(uniform([0] * dim, [1] * dim, [4] * dim), [RefinedBox([0.51] * dim, [0.52] * dim, 4)])
    width = grid.as_box(grid.width[grid.cell_of])
    assert set(np.unique(width)) == {1, 2, 4, 8, 16}
    for shift in product((0, 1), repeat=dim):
        there = width[tuple(slice(s, None) for s in shift)]
        here = width[tuple(slice(None, n - s) for n, s in zip(width.shape, shift, strict=True))]
        assert (np.maximum(there, here) <= 2 * np.minimum(there, here)).all()
    low, high = grid.bounds(np.arange(len(grid.first)))
    assert (high - low).prod(axis=1).sum() == pytest.approx(1.0, abs=1e-14)
    assert (np.bincount(grid.cell_of) == grid.width**dim).all()


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("dim", [2, 3])
def test_nothing_hangs_from_what_hangs(dim, degree):
    grid = nested(dim, 3)
    nodes = grid.all_nodes(degree)
    hangs, masters, weights = grid.hanging(degree, nodes)
    hanging = nodes[hangs]
    assert len(hanging) > 10
    assert not np.isin(masters[weights != 0.0], hanging).any()
    assert np.isin(masters, nodes).all()
    assert np.abs(weights.sum(axis=1) - 1.0).max() < 1e-15


def linear_flow(dim):
    if dim == 2:
        velocity = field(lambda x, y, t: 1 + 2 * x + 3 * y, lambda x, y, t: 2 - x - 2 * y)
        gradient = np.array([[2, 3], [-1, -2.0]])
    else:
        velocity = field(
            lambda x, y, z, t: 1 + 2 * x + 3 * y - z,
            lambda x, y, z, t: 2 - x - 3 * y + z,
            lambda x, y, z, t: x - 2 * y + z,
        )
        gradient = np.array([[2, 3, -1], [-1, -3, 1], [1, -2, 1.0]])
    return velocity, gradient


def quadratic_flow(dim):
    """With a force for its viscosity 0.1, without convection, and p = 10 x - 1."""
    if dim == 2:
        velocity = field(lambda x, y, t: x * x + 3 * y * y, lambda x, y, t: -2 * x * y + x * x)
        return velocity, field(10 - 0.1 * 8, -0.1 * 2)
    velocity = field(
        lambda x, y, z, t: x * x + 3 * y * z + z * z,
        lambda x, y, z, t: -2 * x * y + x * z - y * y,
        lambda x, y, z, t: 2 * y * z + x * x,
    )
    return velocity, field(10 - 0.1 * 4, 0.1 * 2, -0.1 * 2)


def pressure(x, t):
    return 10.0 * x[0] - 1.0


@pytest.mark.parametrize(
    ("dim", "element"), [(2, "q1q1"), (2, "q2q1"), (3, "q1q1"), pytest.param(3, "q2q1", marks=pytest.mark.slow)]
)
def test_linear_flow_is_exact_across_levels(dim, element):
    velocity, gradient = linear_flow(dim)

    def force(axis):
        return lambda *x: (
            10.0 * (axis == 0)
            + sum(
                gradient[axis, j] * velocity[j](np.array([np.ravel(c) for c in x[:-1]]), 0.0).reshape(np.shape(x[0]))
                for j in range(dim)
            )
        )

    fluid = make_fluid(
        nested(dim),
        [wall(velocity)],
        mu=0.1,
        element=element,
        scheme="steady",
        body_force=field(*map(force, range(dim))),
    )
    solve_steady(fluid)
    assert fluid.unknowns.hanging.dofs.sum() > 20
    assert max(nodal_errors(fluid, velocity, pressure, 0.0, level=True)) < EXACT
    for x in ([0.1] * dim, [0.46, 0.52, 0.61][:dim], [1.2, 1, 0.8][:dim]):
        found = at_point(fluid, "velocity", x, 0.0)()
        assert list(found.values()) == pytest.approx(
            [float(u(np.array(x)[:, None], 0.0)[0]) for u in velocity], abs=EXACT
        )


@pytest.mark.parametrize("dim", [2, 3])
def test_quadratic_flow_is_exact_across_levels(dim):
    velocity, force = quadratic_flow(dim)
    fluid = make_fluid(
        nested(dim), [wall(velocity)], mu=0.1, element="q2q1", scheme="steady", body_force=force, convection=False
    )
    solve_steady(fluid)
    assert max(nodal_errors(fluid, velocity, pressure, 0.0, level=True)) < EXACT


@pytest.mark.parametrize(("element", "orders"), [("q1q1", (1.9, 0.95, 1.4)), ("q2q1", (2.8, 1.9, 1.9))])
def test_errors_fall_as_on_equal_cells_and_levels_add_none(element, orders):
    """Around a disc that is cut; the pressure shows no trace of hanging nodes."""
    x, y, t = sympy.symbols("x y t")
    u = [sympy.sin(2 * x) * sympy.cos(3 * y), -2 * sympy.cos(2 * x) * sympy.sin(3 * y) / 3]
    p = sympy.cos(2 * x + y)
    velocity, gradient, exact, force = symbolic(u, p, (x, y, t), rho=1.0, mu=0.1)
    points, facets = circle((0.52, 0.47), 0.13, 600), loop(600)
    slip = np.stack([c(*points.T, 0.0) for c in velocity], axis=1)
    found = []
    for cells, level in ((8, 0), (8, 1), (16, 1)):
        grid = refined(uniform([0, 0], [1, 1], [cells, cells]), [RefinedBox([0.125, 0.125], [0.875, 0.875], level)])
        fluid = make_fluid(
            grid, [wall(field(*velocity))], [body("disc", points, facets, velocity=slip)],
            mu=0.1, element=element, scheme="steady", body_force=field(*force),
        )  # fmt: skip
        solve_steady(fluid)
        found.append(errors(fluid, velocity, gradient, exact))
    equal, nested_once, halved = found
    assert (nested_once < equal).all()
    assert (np.log2(nested_once / halved) > orders).all()
