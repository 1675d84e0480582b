"""Bodies with a slip length: flows that are known exactly at any cut, derivatives, films between two such walls."""

import numpy as np
import pytest
from fluid_setup import (
    around_moving_body,
    block,
    body,
    field,
    make_fluid,
    moving_body,
    nodal_errors,
    solve_steady,
    turned,
    wall,
    with_slip,
)
from lubrication import film_force, slip_ratio

from solvers.fluid.grid.box import uniform
from solvers.fluid.terms import coupling_entries
from solvers.fluid.terms.boundary.patches import Patch

MU = 0.7


def half_space(name, dim, angle, place, side, velocity=0.0):
    """A body below (side -1) or above (1) the line at a distance from the middle of the unit box, turned about it."""
    low, high = ([-2.0, place], [3.0, 4.0]) if side > 0 else ([-2.0, -3.0], [3.0, place])
    points, facets = block([*low, -1.0][:dim], [*high, 2.0][:dim])
    points[:, 1] += 0.5
    return body(name, turned(points, angle, [0.5, 0.5, 0.0][:dim]), facets, velocity=velocity)


def along(angle, profile, dim=2):
    """A velocity in the direction of an angle that depends on the distance from the line through (0.5, 0.5)."""
    c, s = np.cos(angle), np.sin(angle)

    def speed(x, y, *_):
        return profile(c * (y - 0.5) - s * (x - 0.5))

    components = [lambda *x: c * speed(*x), lambda *x: s * speed(*x), 0.0]
    return field(*components[:dim])


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
@pytest.mark.parametrize("length", [1e-3, 0.3, 50.0])
@pytest.mark.parametrize(("angle", "place"), [(0.0, -0.13), (0.4, -0.2), (0.0, -0.25 + 1e-9), (2.3, 0.1)])
def test_shear_flow(element, length, angle, place):
    """It sticks to a wall that is a slip length farther away, wherever the grid is cut."""
    u = along(angle, lambda d: (d - place + length) / (1.0 + length))
    bodies = [with_slip(half_space("wall", 2, angle, place, -1), length)]
    fluid = make_fluid(uniform([0, 0], [1, 1], [5, 4]), [wall(u)], bodies, element=element, scheme="steady", mu=MU)
    solve_steady(fluid)
    assert nodal_errors(fluid, u, field(0)[0], 0.0, level=True)[0] < 1e-9
    c, s = np.cos(angle), np.sin(angle)
    drag = fluid.force()["wall"].sum(axis=0) @ [c, s]
    assert drag == pytest.approx(MU / (1.0 + length) * fluid.cut.pieces.mass.sum(), rel=1e-8)


@pytest.mark.parametrize(("dim", "element"), [(2, "q1q1"), (2, "q2q1"), (3, "q1q1")])
def test_couette_flow(dim, element):
    """Between two walls with slip lengths of their own, one moving: u falls by 1 over the gap and both lengths."""
    angle, (low, high), (below, above) = 0.4, (-0.21, 0.17), (0.1, 0.35)
    u = along(angle, lambda d: (d - low + below) / (high - low + below + above), dim)
    speed = np.array([np.cos(angle), np.sin(angle), 0.0])[:dim]
    bodies = [
        with_slip(half_space("low", dim, angle, low, -1), below),
        with_slip(half_space("high", dim, angle, high, 1, speed), above),
    ]
    grid = uniform([0] * dim, [1] * dim, [5, 4, 3][:dim])
    fluid = make_fluid(grid, [wall(u)], bodies, element=element, scheme="steady", mu=MU)
    solve_steady(fluid)
    assert nodal_errors(fluid, u, field(0)[0], 0.0, level=True)[0] < 1e-9


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_no_shear_stress(element):
    """An infinite slip length: a plug slides along the wall, and pulls with nothing."""
    u = along(0.4, lambda d: 1.0 + 0.0 * d)
    bodies = [with_slip(half_space("wall", 2, 0.4, -0.2, -1), np.inf)]
    fluid = make_fluid(uniform([0, 0], [1, 1], [5, 4]), [wall(u)], bodies, element=element, scheme="steady", mu=MU)
    solve_steady(fluid)
    assert nodal_errors(fluid, u, field(0)[0], 0.0, level=True)[0] < 1e-9
    assert fluid.force()["wall"].sum(axis=0) @ [np.cos(0.4), np.sin(0.4)] == pytest.approx(0.0, abs=1e-9)


def moving(dim, element, length, transmissivity=0.0):
    """A body that moves through the box, with a flow without any symmetry."""
    patches = [
        Patch("open", ("x+",), "outflow"),
        Patch("rest", ("x-", "y-", "y+", "z-", "z+")[: 2 * dim - 1], "no_slip"),
    ]
    fluid = make_fluid(
        around_moving_body(dim), patches, [with_slip(moving_body(dim), length, transmissivity)],
        rho=1.2, mu=0.03, element=element, scheme="backward_euler", dt=0.05,
    )  # fmt: skip
    fluid.begin_step(0.0, 0.05)
    fluid.flow[:] = np.random.default_rng(5).normal(size=len(fluid.flow)) * fluid.system.active_dofs
    return fluid


MOVING = [
    (2, "q2q1", 0.0),
    (3, "q1q1", 0.0),
    (2, "q1q1", 0.05),
    (2, "q2q1", 0.05),
    (3, "q1q1", 2.0),
    (2, "q1q1", np.inf),
    (2, "q2q1", 0.05, 1e-4),
    (3, "q1q1", 0.0, 1e-3),
]


@pytest.mark.parametrize("case", MOVING)
def test_tangent_is_the_derivative(case):
    fluid = moving(*case)
    system, state = fluid.system, fluid.flow.copy()
    tangent = system.tangent(np.zeros(fluid.unknowns.owned, dtype=bool), picard=False)
    change = np.random.default_rng(6).normal(size=len(state)) * system.active_dofs
    u, out = tangent.createVecs()
    u.array[:] = change[: fluid.unknowns.owned]
    tangent.mult(u, out)
    rows = []
    for sign in (1.0, -1.0):
        fluid.flow[:] = state + sign * 1e-5 * change
        rows.append(system.residual())
    np.testing.assert_allclose((rows[0] - rows[1]) / 2e-5, out.array, atol=1e-7 * np.abs(out.array).max())


@pytest.mark.parametrize("case", MOVING)
def test_coupling_blocks_are_derivatives(monkeypatch, case):
    """Rows and force by the velocity of the surface, the force by the flow; all are linear in both."""
    with_shape = coupling_entries.shape_derivatives
    monkeypatch.setattr(coupling_entries, "shape_derivatives", lambda *a: tuple(0.0 * part for part in with_shape(*a)))
    fluid, rng = moving(*case), np.random.default_rng(7)
    at, flow = fluid.system.assemble_interface(), fluid.flow.copy()
    nothing_held = np.zeros(len(flow), dtype=bool)
    found = coupling_entries.interface_entries(at, fluid.unknowns, flow, 1.0, nothing_held, np.arange(at.vertices))
    shape = (at.vertices, fluid.dim)
    g, zero = rng.normal(size=shape), np.zeros(shape)

    def agree(one, other):
        np.testing.assert_allclose(one.ravel(), other.ravel(), atol=1e-12 * np.abs(other).max())

    agree(at.velocity_terms(g), found.into_flow.T @ g.ravel())
    agree(at.force(flow, zero), found.force_by_flow @ flow)
    agree(at.force(0 * flow, g), found.force_by_motion @ g.ravel())


@pytest.mark.parametrize("case", MOVING)
def test_what_bodies_get_is_what_the_fluid_loses(case):
    fluid = moving(*case)
    fluid.solve()
    force, power, _ = fluid.balances()
    assert force == pytest.approx(fluid.force()["mover"].sum(axis=0), rel=1e-9, abs=1e-9)
    assert power > 0.0


def test_film_of_hocking():
    """The values of Hocking's formula, (1/g) (g/3b) ((1 + g/6b) ln(1 + 6b/g) - 1), and without slip 1/g."""
    found = [film_force(3, gap, slip=0.01) / (6.0 * np.pi) for gap in (0.1, 0.05, 0.01, 0.001)]
    assert found == pytest.approx([8.444767, 14.850172, 42.340950, 105.979614], rel=1e-6)
    assert film_force(3, 0.05) / (6.0 * np.pi) == pytest.approx(20.0, rel=1e-6)


@pytest.mark.parametrize(("gap", "h"), [(0.1, 0.1), (0.05, 0.1), (0.02, 0.1), (0.01, 0.05)])
def test_cylinder_with_slip_on_both_walls(gap, h):
    """Its drag within 3 %, down to a fifth of a cell; a slip length of 0.01 takes 25 to 75 % of the film's."""
    assert slip_ratio(2, gap, h, "q2q1", 0.01) == pytest.approx(1.0, abs=0.03)


@pytest.mark.slow
@pytest.mark.parametrize("gap", [0.1, 0.05])
def test_sphere_with_slip_on_both_walls(gap):
    ratio = slip_ratio(3, gap, 0.1, "q2q1", 0.01, growth=1.6, fine=0.6, size=5.0)
    assert ratio == pytest.approx(1.0, abs=0.03)
