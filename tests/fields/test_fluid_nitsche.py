"""Nitsche's terms: their derivative by the motion of the surface, where flow and surface agree."""

import numpy as np
import pytest
from fluid_setup import body, circle, field, loop, make_fluid, sphere, wall

from solvers.fluid.grid.box import uniform
from solvers.fluid.terms.coupling_entries import interface_entries

MU, PRESSURE = 0.7, 2.0


def linear(dim):
    """A velocity without divergence that the elements have, with all slopes."""
    slopes = np.array([[0.4, 2.0, -0.5], [1.0, -0.7, 0.8], [0.6, -1.1, 0.3]])[:dim, :dim]
    slopes[1, 1] -= np.trace(slopes)
    return slopes, lambda x: x @ slopes.T + np.array([0.2, -0.4, 0.1])[:dim]


def in_linear_flow(dim, element):
    """A body, of which each point moves as the flow around it, in an exact flow of constant stress."""
    slopes, u = linear(dim)
    points, facets = (circle((0.47, 0.52), 0.2, 24), loop(24)) if dim == 2 else sphere((0.47, 0.52, 0.5), 0.27, 1)
    moved = np.zeros_like(points)
    mover = body("mover", points, facets, motion=lambda x, t: (x + moved, u(x)))
    components = [lambda *a, i=i: sum(slopes[i, j] * a[j] for j in range(dim)) for i in range(dim)]
    grid = uniform([0] * dim, [1] * dim, [5] * dim if dim == 2 else [4] * dim)
    fluid = make_fluid(
        grid, [wall(field(*components))], [mover], element=element, scheme="steady", convection=False, mu=MU
    )
    fluid.begin_step(0.0, 1.0)
    nodes, pressures = fluid.unknowns.velocity, fluid.unknowns.pressure
    fluid.flow[nodes.dofs] = u(nodes.points[:, :dim])
    fluid.flow[pressures.dofs[:, 0]] = PRESSURE
    return fluid, moved


@pytest.mark.parametrize(("dim", "element"), [(2, "q1q1"), (2, "q2q1"), (3, "q1q1")])
def test_shape_derivatives(dim, element):
    """Rows and force by the place of the surface, its velocity held: exact where u = g and the stress is constant."""
    fluid, moved = in_linear_flow(dim, element)
    change, state = np.random.default_rng(2).normal(size=moved.shape), fluid.flow.copy()
    nothing_held = np.zeros(len(state), dtype=bool)
    at = fluid.system.assemble_interface()
    found = interface_entries(at, fluid.unknowns, state, 0.0, nothing_held, np.arange(len(moved)))
    rows, forces = [], []
    for sign in (1.0, -1.0):
        moved[:] = sign * 1e-6 * change
        fluid.move({})
        fluid.flow[:] = state
        rows.append(fluid.system.residual())
        forces.append(fluid.system.surface_force())
    for values, block in ((rows, found.into_flow.T), (forces, found.force_by_motion)):
        exact = ((values[0] - values[1]) / 2e-6).ravel()
        np.testing.assert_allclose(block @ change.ravel(), exact, atol=1e-6 * np.abs(exact).max())
