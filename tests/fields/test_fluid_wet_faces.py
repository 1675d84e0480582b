"""What bodies that cross, touch or leave the boundary of the box leave of its faces: areas and rates."""

import numpy as np
import pytest
from fluid_setup import block, body, circle, field, loop, make_fluid, sphere, step, turned, wall
from mpi4py import MPI

from solvers.fluid.flow.conservation.regions import RegionsOfCut
from solvers.fluid.flow.conservation.volume_balance import VolumeBalance
from solvers.fluid.flow.probes import on_patch
from solvers.fluid.grid.box import Grid, uniform
from solvers.fluid.surfaces.surface import Motion
from solvers.fluid.terms.boundary.patches import Patch
from solvers.fluid.terms.boundary.wet_faces import wet_face

POINTS = np.polynomial.legendre.leggauss(3)[0] / 2.0 + 0.5


def wet_integral(grid, face, x, facets, function):
    """int f dA over the wet part of a face; the faces of cells that no body covers by their Gauss points."""
    axis = "xyz".index(face[0])
    edges = [e for i, e in enumerate(grid.edges) if i != axis]
    rule = np.polynomial.legendre.leggauss(3)[1] / 2.0
    weights = rule if grid.dim == 2 else np.multiply.outer(rule, rule).ravel()
    shape = tuple(len(e) - 1 for e in edges)
    all_weights = np.tile(weights, (int(np.prod(shape)), 1))
    found = wet_face(grid, face, POINTS, facets, Motion(x, 0 * x))
    all_weights[found.cells] = found.weights
    total = 0.0
    for number, some in enumerate(all_weights):
        place = np.unravel_index(number, shape, order="F")
        parts = [e[i] + POINTS * (e[i + 1] - e[i]) for e, i in zip(edges, place, strict=True)]
        at = np.stack([m.ravel(order="F") for m in np.meshgrid(*parts, indexing="ij")])
        size = np.prod([e[i + 1] - e[i] for e, i in zip(edges, place, strict=True)])
        total += size * float(some @ function(at))
    return total


@pytest.mark.parametrize("face", ["x-", "x+", "y-", "y+"])
def test_moments_of_an_interval(face):
    """A turned square across a side: what is left of int (1 + y^2) dy, exact with three points."""
    grid = Grid((np.array([-1.0, -0.3, 0.1, 1.0]), np.array([-1.0, -0.8, 0.0, 0.5, 1.0])))
    points, facets = block([-0.3, -0.3], [0.3, 0.3])
    points = turned(points, 0.4)
    axis, sign = "xy".index(face[0]), 1.0 if face[1] == "+" else -1.0
    points[:, axis] += sign * 1.02
    a, b = points, np.roll(points, -1, axis=0)
    crossing = (a[:, axis] > sign) != (b[:, axis] > sign)
    share = (sign - a[:, axis]) / (b[:, axis] - a[:, axis])
    low, high = np.sort((a[:, 1 - axis] + share * (b[:, 1 - axis] - a[:, 1 - axis]))[crossing])
    exact = 2.0 + 2.0 / 3.0 - (high - low) - (high**3 - low**3) / 3.0
    assert wet_integral(grid, face, points, facets, lambda y: 1.0 + y[0] ** 2) == pytest.approx(exact, rel=1e-13)
    other = {"+": "-", "-": "+"}[face[1]]
    assert len(wet_face(grid, face[0] + other, POINTS, facets, Motion(points, 0 * points)).cells) == 0


@pytest.mark.parametrize("face", ["x-", "y+", "z-", "z+"])
def test_moments_of_a_section(face):
    """A box that crosses a face of the box: what is left of int (1 + a b) da db."""
    grid = uniform([-1, -1, -1], [1, 1, 1], [3, 4, 5])
    axis, sign = "xyz".index(face[0]), 1.0 if face[1] == "+" else -1.0
    low, high = np.array([-0.35, -0.2, -0.45]), np.array([0.41, 0.63, 0.27])
    low[axis], high[axis] = sign - 0.2, sign + 0.3
    points, facets = block(low, high)
    a, b = (i for i in range(3) if i != axis)
    area = (high[a] - low[a]) * (high[b] - low[b])
    moment = (high[a] ** 2 - low[a] ** 2) * (high[b] ** 2 - low[b] ** 2) / 4.0
    found = wet_integral(grid, face, points, facets, lambda y: 1.0 + y[0] * y[1])
    assert found == pytest.approx(4.0 - area - moment, rel=1e-12)


def test_a_ball_in_a_face():
    """The section of a polyhedron, by the area of the polygon that the plane cuts out of it."""
    grid = uniform([0, 0, 0], [1, 1, 1], [6, 7, 5])
    points, facets = sphere((1.05, 0.5, 0.45), 0.3, 4)
    covered = 1.0 - wet_integral(grid, "x+", points, facets, lambda y: 0.0 * y[0] + 1.0)
    assert covered == pytest.approx(np.pi * (0.3**2 - 0.05**2), rel=0.01)


@pytest.mark.parametrize("slip", [0.0, 1e-12, -1e-12])
def test_a_body_that_lies_in_a_face(slip):
    """In the boundary of the box but for rounding: it covers what it lies on."""
    grid = uniform([0, 0], [1, 1], [5, 5])
    points, facets = block([0.7, 0.3], [1.0 + slip, 0.6])
    assert wet_integral(grid, "x+", points, facets, lambda y: 0.0 * y[0] + 1.0) == pytest.approx(0.7, abs=1e-9)


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_rates_of_a_body_that_leaves(element):
    """It moves with the flow: out of the box flows what it does not cover, and nothing is lost."""
    disc = circle((0.75, 0.48), 0.2, 40)
    moving = body("disc", disc, loop(40), motion=lambda x, t: (x + np.array([t, 0]), 0 * x + [1, 0]))
    patches = [
        Patch("in", ("x-",), "velocity", field(1, 0)),
        Patch("walls", ("y-", "y+"), "slip"),
        Patch("out", ("x+",), "outflow"),
    ]
    fluid = make_fluid(
        uniform([0, 0], [1, 1], [9, 8]),
        patches,
        [moving],
        element=element,
        mu=0.1,
        dt=0.05,
        initial_velocity=field(1, 0),
    )
    rate, pressure, balance = (
        on_patch(fluid, "flow_rate", "out"),
        on_patch(fluid, "pressure", "out"),
        VolumeBalance(fluid, RegionsOfCut(fluid)).numbers,
    )
    for number in range(8):
        step(fluid, 0.05 * number, 0.05)
        x = fluid.cut.motion.x
        after = np.roll(x, -1, axis=0)
        crossing = (x[:, 0] > 1.0) != (after[:, 0] > 1.0)
        share = ((1.0 - x[:, 0]) / (after[:, 0] - x[:, 0]))[crossing]
        chord = np.ptp(x[:, 1][crossing] + share * (after - x)[:, 1][crossing]) if crossing.any() else 0.0
        assert rate()[""] == pytest.approx(1.0 - chord, abs=1e-9)
        assert pressure()[""] == pytest.approx(0.0, abs=1e-9)
        assert abs(balance()["fluid.mass"]) < 1e-9
    assert chord > 0.2


def test_a_sphere_in_an_inlet():
    """3D: uniform flow past a moving ball in the first face of the box; the balance is that of what is wet."""
    points, facets = sphere((0.02, 0.5, 0.5), 0.3, 2)
    ball = body("ball", points, facets, motion=lambda x, t: (x + np.array([t, 0, 0]), 0 * x + [1, 0, 0]))
    fluid = make_fluid(
        uniform([0, 0, 0], [1, 1, 1], [5, 5, 5]), [wall(field(1, 0, 0))], [ball], dt=0.02,
        initial_velocity=field(1, 0, 0), comm=MPI.COMM_SELF,
    )  # fmt: skip
    step(fluid, 0.0, 0.02)
    assert abs(VolumeBalance(fluid, RegionsOfCut(fluid)).numbers()["fluid.mass"]) < 1e-9
