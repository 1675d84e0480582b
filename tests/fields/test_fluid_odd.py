"""Bodies that a grid does not resolve: correct where that is possible, harmless otherwise."""

import numpy as np
import pytest
from advised import require_advice
from fluid_setup import (
    BOX,
    block,
    body,
    circle,
    field,
    fluid_rule,
    loop,
    make_fluid,
    nodal_errors,
    solve_steady,
    step,
    turned,
    values,
    wall,
)

from solvers.api import FailureKind, StepFailed
from solvers.fluid.grid.box import uniform
from solvers.fluid.surfaces.immersed import ImmersedBody
from solvers.fluid.surfaces.surface import ImmersedSurface, Motion
from solvers.fluid.terms.boundary.patches import Patch

STILL = field(0, 0)


def plate(thickness, angle=0.3):
    points, facets = block([0.31, 0.5 - thickness / 2], [0.74, 0.5 + thickness / 2])
    return turned(points, angle, (0.5, 0.5)), facets


@pytest.mark.parametrize("thickness", [0.5, 0.1, 1e-2, 1e-4, 1e-6])
@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_linear_flow_through_a_body_thinner_than_a_cell(element, thickness):
    """Thickness in cells; what both sides of the surface say agrees with the flow, so that nothing is wrong with it."""
    velocity = field(lambda x, y, t: 1 + 2 * y, lambda x, y, t: -3 * x)
    points, facets = plate(thickness / 10)
    carried = np.stack([c(points.T, 0.0) for c in velocity], axis=1)
    fluid = make_fluid(
        uniform([0, 0], [1, 1], [10, 10]), [wall(velocity)], [body("plate", points, facets, velocity=carried)],
        element=element, scheme="steady", convection=False, body_force=field(10, 0),
    )  # fmt: skip
    solve_steady(fluid)
    u, p = nodal_errors(fluid, velocity, lambda x, t: 10 * x[0], 0.0, level=True)
    assert u < 1e-10
    assert p < 1e-7


def pull(thickness, cells):
    """Drag of a plate across a channel whose middle it blocks; the flow rate is given."""
    points, facets = block([0.5 - thickness / 2, 0.3 + 1e-3], [0.5 + thickness / 2, 0.7 + 1e-3])
    points = points + np.array([0.013, 0.0])
    inflow = field(lambda x, y, t: 6 * y * (1 - y), 0)
    patches = [
        Patch("in", ("x-",), "velocity", inflow), Patch("out", ("x+",), "outflow"), Patch("w", ("y-", "y+"), "no_slip"),
    ]  # fmt: skip
    fluid = make_fluid(
        uniform([0, 0], [1, 1], [cells] * 2), patches, [body("plate", points, facets)], scheme="steady",
        convection=False,
    )  # fmt: skip
    solve_steady(fluid)
    return fluid.force()["plate"].sum(axis=0)[0]


@pytest.mark.slow
def test_drag_of_a_plate_thinner_than_a_cell():
    """Both faces cut the same cells: one velocity and one pressure serve both sides, so that the pressure leaks.

    The force is finite, has the right sign, and does not depend on the thickness; it is what a finer grid would see
    only roughly. The documentation says so.
    """
    fine = pull(0.002, 201)
    forces = np.array([pull(thickness, 40) for thickness in (1e-2, 1e-3, 1e-5)])
    assert np.ptp(forces) < 0.1 * forces.max()
    assert np.all(forces > 0.3 * fine)


def test_cell_between_two_bodies():
    """Two discs 0.2 cells apart, moving together with the flow: exact, though cells are cut by both."""
    velocity = field(0.5, 0.2)
    gap, v = 0.02, np.array([0.5, 0.2])

    def motion(x, t):
        return x + t * v, 0 * x + v

    discs = [
        body("left", circle((0.3, 0.4), 0.15, 60, 0.1), loop(60), motion=motion),
        body("right", circle((0.6 + gap, 0.4), 0.15, 60, 0.3), loop(60), motion=motion),
    ]
    fluid = make_fluid(uniform([0, 0], [1, 1], [10, 10]), [wall(velocity)], discs, dt=0.02, initial_velocity=velocity)
    for number in range(8):
        step(fluid, 0.02 * number, 0.02)
        assert max(nodal_errors(fluid, velocity, lambda x, t: 0 * x[0], 0.0, level=True)) < 1e-9


def two_blocks(overlap, left, right):
    """Buoyancy of blocks in still water, one upon the other, and the largest velocity."""
    rho_g = 10.0
    lower = body("lower", *block([0.22, 0.2], [0.71, 0.43]))
    upper = body("upper", *block([left, 0.43 - overlap], [right, 0.77]))
    fluid = make_fluid(
        uniform([0, 0], [1, 1], [10, 10]), [wall(STILL)], [lower, upper], scheme="steady", body_force=field(0, -rho_g)
    )
    solve_steady(fluid)
    u, _ = nodal_errors(fluid, STILL, lambda x, t: -rho_g * x[1], 0.0, level=True)
    union = 0.49 * 0.23 + (right - left) * (0.34 + min(overlap, 0.0))
    return u, sum(f.sum(axis=0) for f in fluid.force().values())[1] / (rho_g * union) - 1.0


@pytest.mark.parametrize("overlap", [-1e-3, -1e-9, 0.0, 1e-9, 1e-3])
@pytest.mark.parametrize(("left", "right", "per_overlap"), [(0.312, 0.615, 0.5), (0.3, 0.6, 1.0)])
def test_bodies_that_touch_or_overlap(overlap, left, right, per_overlap):
    """The fluid stays at rest, and buoyancy is that of the union but for the sliver where both are.

    The second block's sides lie in planes of the grid, or beside them by rounding.
    """
    u, excess = two_blocks(overlap, left, right)
    assert u < max(1e-10, per_overlap * overlap)
    assert abs(excess) < max(1e-10, 2 * abs(overlap))


def test_sealed_pocket_has_no_pressure_level():
    """Fluid that a body encloses has no connection with the rest: flow and pressure are right but for its level.

    That is held at one node.
    """
    outer, inner = circle((0.5, 0.5), 0.35, 60), circle((0.5, 0.5), 0.2, 60)[::-1]
    shell = body("shell", np.concatenate([outer, inner]), np.concatenate([loop(60), 60 + loop(60)]))
    fluid = make_fluid(
        uniform([0, 0], [1, 1], [20, 20]), [wall(STILL)], [shell], scheme="steady", body_force=field(0, -1)
    )
    solve_steady(fluid)
    rule = fluid_rule(fluid)
    u, _, p = values(fluid, rule)
    off, r = p + rule.x[..., 1], np.linalg.norm(rule.x - 0.5, axis=-1)
    assert np.abs(u[rule.weights > 0]).max() < 1e-9
    for part in (r < 0.19, r > 0.36):
        assert np.ptp(off[part]) < 1e-9 * max(1.0, np.abs(off).max())


def test_body_that_outruns_the_flow_behind_it_is_named():
    """It moves by a jump that its velocity does not contain."""
    points = circle((0.3, 0.5), 0.22, 40)
    jump = body("jumper", points, loop(40), motion=lambda x, t: (x + np.array([0.3 * (t > 0.015), 0.0]), 0 * x))
    fluid = make_fluid(uniform([0, 0], [1, 1], [20, 20]), [wall(STILL)], [jump], dt=0.01)
    step(fluid, 0.0, 0.01)
    with pytest.raises(StepFailed, match="cells in one step") as failed:
        step(fluid, 0.01, 0.01)
    require_advice(failed.value, FailureKind.MOTION)


@pytest.mark.parametrize(("thin", "velocity"), [(False, 0.0), (True, 0.0), (True, 30.0)])
def test_an_iterate_far_from_its_velocity_has_diverged(thin, velocity):
    """Another field moves a body by six cells, which a velocity of six cells per step explains.

    With it, strips of cells behind a thick body would be as wide.
    """
    points, facets = block([0.3, -0.1], [0.31, 1.1]) if thin else (circle((0.3, 0.5), 0.22, 40), loop(40))
    fluid = make_fluid(
        uniform([0, 0], [1, 1], [20, 20]), [Patch("box", BOX[2], "outflow")],
        [ImmersedBody(ImmersedSurface("body", facets, len(points)), None, start=points)], dt=0.01,
    )  # fmt: skip
    still, moving = np.zeros_like(points), np.tile([velocity, 0.0], (len(points), 1))
    fluid.move({"body": Motion(points, still)})
    fluid.begin_step(0.0, 0.01)
    fluid.move({"body": Motion(points, moving)})
    fluid.solve()
    fluid.end_step()
    fluid.begin_step(0.01, 0.01)
    words = (
        "body 'body' moved by 6 cells in one step; velocities are extrapolated to"
        if velocity
        else "an iterate had body 'body' 6 cells from where the step began, of which its velocity explains 0: "
        "the iteration diverged, or the load of the step is too sudden; velocities are extrapolated to"
    )
    with pytest.raises(StepFailed, match=words) as failed:
        fluid.move({"body": Motion(points + np.array([0.3, 0.0]), still)})
    require_advice(failed.value, FailureKind.MOTION if velocity else FailureKind.DIVERGED)
