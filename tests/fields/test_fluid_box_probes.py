"""Means over the fluid in a box: exact for polynomials of the element, whatever bodies and cells its faces cross."""

import numpy as np
import pytest
from fluid_setup import block, body, circle, field, loop, make_fluid, wall
from programs import on_processes
from scipy.optimize import linprog
from scipy.spatial import ConvexHull, Delaunay, HalfspaceIntersection

from solvers.fluid.flow.box_probes import CrossesThinBody, box_probe
from solvers.fluid.grid.box import uniform
from solvers.fluid.grid.nested import RefinedBox, refined

LINEAR = np.array([[0.3, -1.0, 0.7], [0.4, 0.5, -0.2], [1.1, 0.6, -0.8]])
CONSTANT = np.array([1.0, -0.4, 0.6])
AXES = "xyz"


def fluid_of(grid, bodies, element, dim):
    """A flow of linear velocity and pressure."""
    velocity = [lambda *at, i=i: CONSTANT[i] + LINEAR[i, :dim] @ np.array(at[:dim]) for i in range(dim)]
    fluid = make_fluid(grid, [wall(field(*velocity))], bodies, element=element, scheme="steady")
    nodes = fluid.unknowns.velocity
    for i in range(dim):
        fluid.flow[nodes.dofs[:, i]] = CONSTANT[i] + nodes.points @ LINEAR[i, :dim]
    fluid.flow[fluid.unknowns.pressure.dofs[:, 0]] = 2.0 + fluid.unknowns.pressure.points @ LINEAR[0, :dim]
    return fluid


def moments_of(corners, low, high):
    """(volume, its centre, second moments) of a convex body's part in a box."""
    dim = len(low)
    sides = np.concatenate([np.c_[np.eye(dim), -np.array(high)], np.c_[-np.eye(dim), np.array(low)]])
    if corners is not None:
        sides = np.concatenate([ConvexHull(corners).equations, sides])
    ball = np.c_[sides[:, :-1], np.ones(len(sides))]  # the largest one inside
    inside = linprog([0.0] * dim + [-1.0], ball, -sides[:, -1], bounds=[(None, None)] * dim + [(0, None)]).x[:dim]
    points = HalfspaceIntersection(sides, inside).intersections
    parts = points[Delaunay(points).simplices]
    sizes = np.abs(np.linalg.det(parts[:, 1:] - parts[:, :1])) / np.prod(np.arange(1, dim + 1))
    sums = parts.sum(axis=1)
    second = np.einsum("n,nvi,nvj->ij", sizes, parts, parts) + np.einsum("n,ni,nj->ij", sizes, sums, sums)
    return sizes.sum(), sizes @ parts.mean(axis=1), second / ((dim + 1) * (dim + 2))


def check(fluid, low, high, bodies, tolerance=1e-11):
    dim = len(low)
    volume, first, second = moments_of(None, low, high)
    for sign, corners in bodies:
        hole = moments_of(corners, low, high)
        volume, first, second = volume - sign * hole[0], first - sign * hole[1], second - sign * hole[2]
    A, c = LINEAR[:dim, :dim], CONSTANT[:dim]
    energy = 0.5 * fluid.settings.density * (c @ c * volume + 2 * c @ A @ first + np.sum((A @ second) * A))
    assert box_probe(fluid, "volume", low, high)()[""] == pytest.approx(volume, abs=tolerance)
    found = box_probe(fluid, "velocity", low, high)()
    assert [found[a] for a in AXES[:dim]] == pytest.approx(c + A @ first / volume, abs=tolerance)
    assert box_probe(fluid, "pressure", low, high)()[""] == pytest.approx(2 + A[0] @ first / volume, abs=tolerance)
    assert box_probe(fluid, "kinetic_energy", low, high)()[""] == pytest.approx(energy, abs=tolerance)


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
@pytest.mark.parametrize(
    ("low", "high"),
    [
        ([0.25, 0.25, 0.25], [0.75, 0.75, 0.5]),  # in planes of the grid
        ([0.31, 0.28, 0.4], [0.66, 0.9, 0.55]),
        ([-1.0, 0.41, 0.2], [0.5 + 1e-15, 0.47, 3.0]),  # within cells, and beyond the grid
        ([0.48, 0.46, 0.44], [0.54, 0.97, 0.61]),
    ],
)
def test_block_in_space(element, low, high):
    points, facets = block([-0.2, -0.25, -0.3], [0.2, 0.25, 0.3])
    angle = np.array([[np.cos(0.4), -np.sin(0.4), 0], [np.sin(0.4), np.cos(0.4), 0], [0, 0, 1]])
    points = points @ angle.T + [0.52, 0.48, 0.5]
    fluid = fluid_of(uniform([0] * 3, [1] * 3, [4] * 3), [body("block", points, facets)], element, 3)
    check(fluid, np.clip(low, 0, 1), np.clip(high, 0, 1), [(1, points)])


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
@pytest.mark.parametrize("shift", [0.0, 1 / 15])
@pytest.mark.parametrize("nested", [False, True])
def test_polygon(element, shift, nested):
    """A heptagon; the box also moved by a third of a cell."""
    grid = uniform([0, 0], [1, 1], [5, 5])
    grid = refined(grid, [RefinedBox([0.0, 0.0], [1.0, 0.75], 2)]) if nested else grid
    points = circle((0.52, 0.47), 0.13, 7)
    fluid = fluid_of(grid, [body("heptagon", points, loop(7))], element, 2)
    check(fluid, [0.2 + shift, 0.4], [0.55, 0.8 + shift], [(1, points)])
    check(fluid, [0.2, 0.1], [0.9, 0.95], [(1, points)])


def test_bodies_that_overlap_count_once():
    low, high, both = ([0.2, 0.3], [0.55, 0.7]), ([0.4, 0.45], [0.8, 0.6]), ([0.4, 0.45], [0.55, 0.6])
    bodies = [body(name, *block(*ends)) for name, ends in (("a", low), ("b", high))]
    fluid = fluid_of(uniform([0, 0], [1, 1], [4, 4]), bodies, "q1q1", 2)
    check(fluid, [0.15, 0.2], [0.47, 0.62], [(1, block(*low)[0]), (1, block(*high)[0]), (-1, block(*both)[0])])


def test_box_full_of_a_body():
    fluid = fluid_of(uniform([0, 0], [1, 1], [4, 4]), [body("a", *block([0.2, 0.2], [0.8, 0.8]))], "q1q1", 2)
    assert box_probe(fluid, "volume", [0.3, 0.3], [0.7, 0.4])()[""] == 0.0
    assert np.isnan(box_probe(fluid, "pressure", [0.3, 0.3], [0.7, 0.4])()[""])


def test_two_processes():
    on_processes(2, __file__)


def test_thin_body():
    """Beside a plate of a hundredth of a cell the faces of the box are planes of the grid, or refused."""
    points, facets = block([0.497, 0.1], [0.503, 0.9])
    points = points @ np.array([[1.0, 0.02], [0.1, 1.0]])
    fluid = fluid_of(uniform([0, 0], [1, 1], [20, 20]), [body("plate", points, facets)], "q1q1", 2)
    assert fluid.grid.sheets is not None
    check(fluid, [0.25, 0.25], [0.75, 0.6], [(1, points)])
    with pytest.raises(CrossesThinBody, match=r"x = 0.33 is no plane of the grid, .* the nearest one is 0.35"):
        box_probe(fluid, "volume", [0.33, 0.25], [0.75, 0.6])


if __name__ == "__main__":
    test_block_in_space("q1q1", [0.31, 0.28, 0.4], [0.66, 0.9, 0.55])
    test_polygon("q2q1", 1 / 15, True)
    test_bodies_that_overlap_count_once()
    test_thin_body()
