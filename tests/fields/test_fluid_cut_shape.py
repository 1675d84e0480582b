"""Rows and force of a flow by the motion of a body in it: against differences."""

import numpy as np
import pytest
import ufl
from fluid_setup import body, circle, field, loop, make_fluid, sphere, step, with_slip

from solvers.fluid.grid.box import uniform
from solvers.fluid.terms import forms
from solvers.fluid.terms.boundary.patches import Patch
from solvers.fluid.terms.coupling_entries import interface_entries

DT = 0.05
SPEED = {2: 1.0, 3: 0.6}  # the larger, the farther from the assumed stress: cells in space are coarser


class Moving:
    """A body in a flow by backward Euler in its second step; `by` displaces its vertices, `g` are their velocities."""

    def __init__(self, dim, patches, centre=(0.47, 0.52), slip=0.0, layer=0.0, **flow):
        points, facets = (circle(centre, 0.23, 14), loop(14)) if dim == 2 else sphere((*centre, 0.5), 0.27, 1)
        self.by, self.g = np.zeros_like(points), np.zeros_like(points)
        mover = body("mover", points, facets, motion=lambda x, t: (x + self.by, self.g + self.by / DT))
        cells, bodies = [6, 5] if dim == 2 else [4, 5, 4], [with_slip(mover, slip, layer)]
        self.fluid = make_fluid(
            uniform([0] * dim, [1] * dim, cells), patches, bodies, dt=DT, scheme="backward_euler", **flow
        )
        step(self.fluid, 0.0, DT)
        self.fluid.begin_step(DT, DT)

    def derivatives(self, *, shape=True, improved=True):
        """(found, by differences) for a random displacement: of momentum rows, of continuity rows, of the force."""
        fluid, change = self.fluid, np.random.default_rng(2).normal(size=self.by.shape)
        fluid.move({})
        fluid.residual()
        state, system, nodes = fluid.flow.copy(), fluid.system, fluid.unknowns
        derived = system.shape_derivatives(improved=improved) if shape else (None, None)
        nothing_held, at = np.zeros(len(state), dtype=bool), (nodes.velocity.dofs, nodes.pressure.dofs)
        given = system.assemble_interface(), nodes, state, 1.0 / DT, nothing_held, np.arange(len(change)), derived
        entries, rows, forces = interface_entries(*given), [], []
        for sign in (1.0, -1.0):
            self.by[:] = sign * 1e-7 * change
            fluid.move({})
            fluid.flow[:] = state
            rows.append(system.residual())
            forces.append(system.surface_force())
        exact, force = (rows[0] - rows[1]) / 2e-7, (forces[0] - forces[1]).ravel() / 2e-7
        into = entries.into_flow.T @ change.ravel()
        found_force = entries.force_by_motion @ change.ravel()
        return [(into[dofs], exact[dofs]) for dofs in at] + [(found_force, force)]


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
@pytest.mark.parametrize(("slip", "layer"), [(0.0, 0.0), (0.02, 3e-4)])
@pytest.mark.parametrize("dim", [2, 3])
def test_exact_where_the_stress_is_constant(dim, slip, layer, element):
    """A constant stress, slip u - g and slip before. Slopes of test functions jump, but not those of their sum.

    The box is open: Nitsche's penalty would jump between cells in gaps of less than a cell.
    """
    slopes = np.array([[0.4, 2.0, -0.5], [1.0, -0.7, 0.8], [0.6, -1.1, 0.3]])[:dim, :dim]
    faces = ("x-", "x+", "y-", "y+", "z-", "z+")[: 2 * dim]
    patches = [Patch("open", faces, "traction", field(*[0.3, -0.2, 0.1][:dim]))]
    moving = Moving(dim, patches, slip=slip, layer=layer, rho=1.3, mu=0.7, element=element)
    fluid, against = moving.fluid, np.array([0.5, -0.8, 0.3])[:dim]
    nodes = fluid.unknowns.velocity
    fluid.flow[nodes.dofs] = nodes.points[:, :dim] @ slopes.T
    fluid.flow[fluid.unknowns.pressure.dofs] = 2.0
    fluid.system.set_scales(np.where(fluid.unknowns.velocity_mask, 0.6, 0.0))
    fluid.system.slip_rate = np.full(fluid.cut.facets.shape, -0.4 / DT)
    moving.g[:] = fluid.bodies[0].motion(0.0).x @ slopes.T - against
    (momentum, by_differences), *others = moving.derivatives()
    for found, exact in (momentum.sum(axis=0), by_differences.sum(axis=0)), *others:
        np.testing.assert_allclose(found, exact, atol=3e-6 * np.abs(by_differences).max())


def errors(dim, *, shape=True, mu=0.05, **more):
    """Relative errors of momentum rows, continuity rows and force in a flow across a body, in cells of a fifth."""
    inflow = field(*[lambda x, y, *zt: SPEED[dim] * (2.0 + y), 0.3, 0.0][:dim])
    sides = ("y-", "y+", "z-", "z+")[: 2 * dim - 2]
    patches = [
        Patch("in", ("x-",), "velocity", inflow),
        Patch("out", ("x+",), "outflow"),
        Patch("walls", sides, "no_slip"),
    ]
    moving = Moving(dim, patches, mu=mu, body_force=field(*[1.0, -2.0, 0.5][:dim]), **more)
    pairs = moving.derivatives(shape=shape)
    return np.array([np.linalg.norm(found - exact) / np.linalg.norm(exact) for found, exact in pairs])


@pytest.mark.parametrize("dim", [2, 3])
def test_nearly_exact_in_a_flow(dim):
    """The derivatives that assume u = g are three times as wrong."""
    now, before = errors(dim), errors(dim, shape=False)
    assert (now < 0.1).all()
    assert (before > 3.0 * now).all()


@pytest.mark.parametrize("dim", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_nearer_to_differences_with_second_degree(dim):
    """Momentum lacks the penalty of poorly cut cells, also with exact integrands at surfaces (0.14 in 2D, 0.19)."""
    now, before = errors(dim, element="q2q1"), errors(dim, element="q2q1", shape=False)
    assert (now < [0.2, 0.07, 0.07]).all()
    assert before[0] > now[0]
    assert before[1] > 5.0 * now[1]


@pytest.mark.parametrize("dim", [2, 3])
def test_a_body_through_a_wall_of_the_box(dim):
    """Its surface ends at the wall. Without this end momentum rows and force are 15 to 29 % and 9 to 24 % wrong.

    The first tangent of a step does without.
    """
    inflow = field(*[lambda x, y, *zt: SPEED[dim] * (2.0 + y), 0.3, 0.0][:dim])
    sides = ("y-", "y+", "z-", "z+")[: 2 * dim - 2]
    patches = [
        Patch("in", ("x-",), "velocity", inflow),
        Patch("out", ("x+",), "outflow"),
        Patch("walls", sides, "no_slip"),
    ]
    moving, errors = Moving(dim, patches, centre=(0.47, 0.13), mu=0.05), []
    moving.derivatives()  # moves the body by 1e-7, which the next tangent takes for the size of an increment
    for improved in (True, False):
        pairs = moving.derivatives(improved=improved)
        errors.append([np.linalg.norm(found - exact) / np.linalg.norm(exact) for found, exact in pairs])
    (momentum, continuity, force), without = errors
    assert max(momentum, force) < 0.05
    assert continuity < 0.07
    assert without[0] > 3.0 * momentum
    assert without[2] > 3.0 * force


@pytest.mark.parametrize(
    ("dim", "slip", "layer", "mu", "bound"),
    [
        (2, 0.05, 0.0, 0.05, 0.09),  # the derivatives that assume u = g: 0.92
        (3, 0.5, 0.0, 0.05, 0.11),  # 0.73
        (2, 0.0, 1e-5, 0.05, 0.08),  # 0.81; without what slip and layers change 0.14
        (2, 0.05, 1e-5, 0.05, 0.18),  # 0.94; 0.63
        (3, 0.05, 1e-5, 2.0, 0.08),  # without the slip's part of the gradient 0.094
    ],
)
def test_with_slip_and_a_layer(dim, slip, layer, mu, bound):
    assert (errors(dim, slip=slip, layer=layer, mu=mu) < bound).all()


def with_more(flow, u, p, v, q, bulk=forms.bulk):
    """Integrand of the flow and of terms that multiply each of v, grad v, q and grad q."""
    u2, more = ufl.dot(u, u), p * ufl.inner(ufl.grad(u), ufl.grad(v)) - ufl.dot(ufl.grad(p), ufl.grad(q))
    return bulk(flow, u, p, v, q) + 3.0 * u2 * ufl.dot(u, v) + u2 * q + more


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
@pytest.mark.parametrize("dim", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_a_term_of_the_forms_alone(dim, element, monkeypatch):
    """Terms that `forms` alone has are differentiated: what they add is exact, row by row, in any flow."""
    added, walls = (
        [],
        [Patch("walls", ("x-", "x+", "y-", "y+", "z-", "z+")[: 2 * dim], "traction", field(*[0.0] * dim))],
    )
    for bulk in (with_more, forms.bulk):
        monkeypatch.setattr(forms, "bulk", bulk)
        moving, some = Moving(dim, walls, element=element), np.random.default_rng(3)
        system = moving.fluid.system
        system.history.x.array[:] = some.normal(size=len(system.history.x.array))
        moving.fluid.flow[:] = some.normal(size=len(moving.fluid.flow))
        system.set_scales(np.where(moving.fluid.unknowns.velocity_mask, 0.6, 0.0))
        added.append(moving.derivatives())
    for (found, exact), (found_without, exact_without) in zip(*added, strict=True):
        term = exact - exact_without
        np.testing.assert_allclose(found - found_without, term, atol=1e-6 * max(np.abs(term).max(), 1e-3))
    assert (
        min(
            np.abs(found - without).max()
            for (found, _), (without, _) in zip(*(pairs[:2] for pairs in added), strict=True)
        )
        > 0.1
    )
