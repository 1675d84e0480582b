"""The slip of earlier steps: a steady slip has no force, whatever the step."""

from __future__ import annotations

import numpy as np
import pytest
from fluid_setup import body, circle, field, loop, make_fluid, sphere, step, wall

from solvers.fluid.grid.box import uniform
from solvers.fluid.settings.time_scheme import SCHEMES
from solvers.fluid.terms.slip_history import SlipHistory


def in_linear_flow(dim):
    """A body at rest in a linear velocity (of which the slip is linear on facets), partly out of the box."""
    points, facets = (circle((0.1, 0.52), 0.3, 10), loop(10)) if dim == 2 else sphere((0.2, 0.5, 0.45), 0.33, 1)
    slopes = np.array([[0.4, 2.0, -0.5], [1.0, -0.7, 0.8], [0.6, -1.1, 0.3]])[:dim, :dim]
    components = [lambda *a, i=i: sum(slopes[i, j] * a[j] for j in range(dim)) for i in range(dim)]
    grid, bodies = uniform([0] * dim, [1] * dim, [5] * dim), [body("b", points, facets)]
    fluid = make_fluid(grid, [wall(field(*components))], bodies)
    nodes = fluid.unknowns.velocity
    fluid.flow[nodes.dofs] = nodes.points[:, :dim] @ slopes.T
    return fluid, points[facets], slopes


@pytest.mark.parametrize("dim", [2, 3])
def test_linear_slip_is_found(dim):
    """On whole facets up to the weight of its slope; beyond the box it is continued from the wet part."""
    fluid, corners, slopes = in_linear_flow(dim)
    slip, inside = fluid.system.slip(), (corners[..., 0] > 0.0).all(axis=1)
    a, b = corners[:, 1] - corners[:, 0], corners[:, -1] - corners[:, 0]
    normal = np.cross(a, b) if dim == 3 else np.stack([a[:, 1], -a[:, 0]], axis=1)
    normal /= -np.linalg.norm(normal, axis=1)[:, None]  # out of the fluid
    exact = np.einsum("fvi,ji,fj->fv", corners, slopes, normal)
    assert inside.sum() > 5
    assert slip[inside] == pytest.approx(exact[inside], abs=0.02 * np.abs(exact).max())
    assert np.abs(slip).max() < 1.5 * np.abs(exact).max()
    dry = (corners[..., 0] < 0.0).all(axis=1)
    assert dry.any()
    assert (slip[dry] == 0.0).all()


@pytest.mark.parametrize("scheme", ["backward_euler", "bdf2", "bdf2_optimized"])
def test_a_steady_slip_has_no_rate(scheme):
    """With steps of any length."""
    history, slip, steps = SlipHistory(SCHEMES[scheme].times), np.array([[0.3, -0.2]]), ()
    assert history.rate(SCHEMES[scheme].difference(0.1, ())) is None
    for dt in (0.1, 0.1, 0.03, 0.06, 0.001):
        history.end_step(slip)
        steps = (dt, *steps)
        difference = SCHEMES[scheme].difference(0.5 * dt, steps[: SCHEMES[scheme].times])
        if len(history.past) == SCHEMES[scheme].times:
            assert history.rate(difference) / difference.alpha == pytest.approx(slip, rel=1e-12)


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_its_history_is_restored(element):
    points = circle((0.47, 0.52), 0.23, 16)
    flows = [
        make_fluid(
            uniform([0, 0], [1, 1], [6, 6]),
            [wall(field(0, 0))],
            [body("b", points, loop(16), motion=lambda x, t: (x + 0.1 * t**2, 0.2 * t + 0.0 * x))],
            element=element,
            scheme="bdf2",
            dt=0.1,
        )
        for _ in range(2)
    ]
    for number in range(4):
        step(flows[0], 0.1 * number, 0.1)
    flows[1].restore(flows[0].save())
    for flow in flows:
        step(flow, 0.4, 0.03)
    assert np.abs(flows[0].moving.slip.past[0]).max() > 0.0
    assert (flows[0].force()["b"] == flows[1].force()["b"]).all()
