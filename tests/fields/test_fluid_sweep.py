"""What flows out is what bodies displace, in each step and with every scheme, to the tolerance of the solver."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fluid_setup import body, circle, field, loop, make_fluid, sphere, step, turned

from solvers.fluid.flow.conservation.cavities import enclosed
from solvers.fluid.flow.probes import flow_rate
from solvers.fluid.grid.box import uniform
from solvers.fluid.terms.boundary.patches import Patch

DT = 0.05


def points_of(dim):
    return (circle((0.62, 0.5), 0.2, 24), loop(24)) if dim == 2 else sphere((0.6, 0.5, 0.5), 0.25, 1)


def turning_and_growing(points, t):
    """It turns by 0.3 in a step around a point that is not its middle, and grows; it may move straight, too."""
    about = np.full(points.shape[1], 0.5)
    middle = points.mean(axis=0)
    return turned(middle + (points - middle) * (1.0 + 0.6 * t), 6.0 * t, about)


def velocity_of(shape, points, t):
    return (shape(points, t + 1e-6) - shape(points, t - 1e-6)) / 2e-6


def flow(dim, scheme, element="q1q1"):
    points, facets = points_of(dim)
    moving = body(
        "mover", points, facets,
        motion=lambda x, t: (turning_and_growing(x, t), velocity_of(turning_and_growing, x, t)),
    )  # fmt: skip
    sides = ("y-", "y+", "z-", "z+")[: 2 * dim - 2]
    patches = [Patch("out", ("x+",), "traction", field(*[0.0] * dim)), Patch("walls", ("x-", *sides), "no_slip")]
    cells = [12] * 2 if dim == 2 else [6] * 3
    return make_fluid(
        uniform([0] * dim, [1] * dim, cells), patches, [replace(moving, sweeps=True)],
        mu=0.1, scheme=scheme, element=element, dt=DT,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("dim", "scheme", "element"),
    [
        (2, "backward_euler", "q1q1"),
        (2, "bdf2", "q1q1"),
        (2, "bdf2_optimized", "q1q1"),
        (2, "bdf2", "q2q1"),
        (3, "backward_euler", "q1q1"),
        (3, "bdf2", "q1q1"),
    ],
)
def test_outflow_is_the_change_of_volume(dim, scheme, element):
    fluid = flow(dim, scheme, element)
    facets, out = points_of(dim)[1], flow_rate(fluid)
    volumes, lengths = [enclosed(fluid.moving.motions[0].x, facets)], (0.05, 0.05, 0.05, 0.03)
    t = 0.0
    for dt in lengths:
        step(fluid, t, dt)
        t += dt
        volumes.insert(0, enclosed(fluid.moving.motions[0].x, facets))
        rule = fluid.current.difference
        rate = rule.alpha * volumes[0] - sum(b * v for b, v in zip(rule.beta, volumes[1:], strict=False))
        assert rate > 0.05
        assert out(["out"]) == pytest.approx(rate, rel=1e-9)
