"""Nested cells that follow bodies: the flow goes exactly to other cells, and a force does not show it."""

import numpy as np
import pytest
from fluid_setup import body, circle, field, loop, make_fluid, nodal_errors, step, wall

from solvers.fluid.background.following import Following, RefinedBody, interpolation
from solvers.fluid.background.grid import uniform
from solvers.fluid.background.nested import RefinedBox, RefinedSurface, refined
from solvers.fluid.probes import Forces

FACETS = loop(40)


def around(coarsest, x, layers=5, level=1):
    return refined(coarsest, [RefinedSurface(x, FACETS, layers, level)])


def shear(x, y, t):
    return 1.0 + 0.5 * y


def moving_disc(velocity, start=(0.5, 0.5), radius=0.12):
    """A disc that moves along x as fast as a shear flow at its centre, whose surface moves with the flow."""
    points = circle(start, radius, len(FACETS))

    def motion(points, t):
        x = points + np.array([velocity * t, 0.0])
        return x, np.stack([shear(*x.T, t), np.zeros(len(x))], axis=1)

    return points, body("disc", points, FACETS, motion=motion)


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("dim", [2, 3])
def test_polynomials_stay_the_same(dim, degree):
    """Where old and new cells are finer or coarser than each other, hanging nodes included."""
    grid = uniform([0] * dim, [1.2, 1, 0.8][:dim], [5, 4, 3][:dim])
    old = refined(grid, [RefinedBox([0.1] * dim, [0.4] * dim, 2)])
    new = refined(grid, [RefinedBox([0.3] * dim, [0.7] * dim, 2)])

    def values(cells):
        index = np.unravel_index(cells.all_nodes(degree), [degree * n + 1 for n in cells.shape], order="F")
        x = [edge[0] + (edge[-1] - edge[0]) * i / (degree * (len(edge) - 1)) for edge, i in zip(cells.edges, index)]
        return (1.0 + 2.0 * x[0] - x[-1]) ** degree + x[0] * x[1]

    assert np.abs(interpolation(old, new, degree) @ values(old) - values(new)).max() < 1e-14


@pytest.mark.parametrize(("element", "scheme"), [("q1q1", "bdf2"), ("q2q1", "bdf2"), ("q1q1", "backward_euler")])
def test_a_linear_flow_does_not_notice(element, scheme):
    points, disc = moving_disc(velocity=1.25)
    coarsest = uniform([0, 0], [2, 1], [16, 8])
    velocity = field(shear, 0.0)
    fluid = make_fluid(
        around(coarsest, points), [wall(velocity)], [disc], dt=0.04, mu=0.1, element=element, scheme=scheme,
        following=Following(coarsest, [], [RefinedBody("disc", 5, 1)]), initial_velocity=velocity,
    )  # fmt: skip
    grids, force = set(), Forces(fluid).probe("force", "disc", None)
    for n in range(15):
        step(fluid, 0.04 * n, 0.04)
        grids.add(id(fluid.grid))
        assert max(nodal_errors(fluid, velocity, lambda x, t: 0.0 * x[0], 0.0, level=True)) < 1e-10
    assert len(grids) > 3
    assert np.abs(list(force().values())).max() < 1e-10
