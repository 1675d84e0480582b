"""The flow rate through a plane: exact for polynomials of the element, whatever bodies and cells it crosses."""

import numpy as np
import pytest
from fluid_setup import block, body, circle, field, loop, make_fluid, solve_steady, wall
from scipy.spatial import ConvexHull, HalfspaceIntersection

from solvers.fluid.flow.section import plane_probe
from solvers.fluid.grid.box import Grid, uniform
from solvers.fluid.grid.nested import RefinedBox, refined
from solvers.fluid.terms.boundary.patches import Patch

SIZES = 1.0, 1.0, 1.0
LINEAR = np.array([[0.3, -1.0, 0.7], [0.4, 0.5, -0.2], [1.1, 0.6, -0.8]])
CONSTANT = np.array([1.0, -0.4, 0.6])


def turned(angles):
    """A rotation about z, then x."""
    (c, s), (d, e) = ((np.cos(a), np.sin(a)) for a in angles)
    return np.array([[1, 0, 0], [0, d, -e], [0, e, d]]) @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def put(fluid, velocity):
    """Let the flow have this velocity at its nodes."""
    nodes = fluid.unknowns.velocity
    for i, component in enumerate(velocity):
        fluid.flow[nodes.dofs[:, i]] = component(nodes.points.T, 0.0)


def linear_field(dim):
    return field(*(lambda *at, i=i: CONSTANT[i] + LINEAR[i, :dim] @ np.array(at[:dim]) for i in range(dim)))


def section_of(corners, point, normal):
    """(area, its centre) of the section of a convex body with a plane; corners: of the body."""
    n = np.array(normal) / np.linalg.norm(normal)
    distance = (corners - point) @ n
    pairs = [(i, j) for i in range(len(corners)) for j in range(i) if distance[i] * distance[j] < 0]
    found = [corners[i] + distance[i] / (distance[i] - distance[j]) * (corners[j] - corners[i]) for i, j in pairs]
    found += [corner for corner, d in zip(corners, distance, strict=True) if d == 0]
    if len(corners[0]) == 2:
        ends = np.array(found)
        way = ends @ np.array([-n[1], n[0]])
        return np.ptp(way), 0.5 * (ends[way.argmin()] + ends[way.argmax()])
    s = np.cross(n, [0.3, 0.5, 0.8])
    axes = np.stack([s / np.linalg.norm(s), np.cross(n, s / np.linalg.norm(s))])
    flat = np.array(found) @ axes.T
    ring = flat[ConvexHull(flat).vertices]
    after = np.roll(ring, -1, axis=0)
    cross = ring[:, 0] * after[:, 1] - ring[:, 1] * after[:, 0]
    area = 0.5 * cross.sum()
    centre = ((ring + after) * cross[:, None]).sum(axis=0) / (6.0 * area)
    return area, centre @ axes + (np.array(point) @ n) * n


def rate_of(part, normal, dim):
    area, centre = part
    n = np.array(normal) / np.linalg.norm(normal)
    return area * n @ (CONSTANT[:dim] + LINEAR[:dim, :dim] @ centre)


def corners_of_box(dim):
    return np.array(np.meshgrid(*[[0.0, 1.0]] * dim)).reshape(dim, -1).T


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
@pytest.mark.parametrize(
    ("point", "normal"),
    [
        ((0.4, 0.5, 0.5), (1, 0, 0)),
        ((0.5, 0.5, 0.5), (0, -2, 0)),  # in a plane of the grid
        ((0.5, 0.5, 0.5 + 1e-15), (0, 0, 1)),
        ((0.45, 0.55, 0.5), (1, 0.3, -0.6)),
        ((0.5, 0.5, 0.5), (1, 1, 1)),  # through corners of cells
    ],
)
def test_plane_through_a_turned_block(element, point, normal):
    points, facets = block([-0.2, -0.25, -0.3], [0.2, 0.25, 0.3])
    points = points @ turned((0.4, 0.7)).T + [0.52, 0.48, 0.5]
    fluid = make_fluid(uniform([0] * 3, SIZES, [4, 4, 4]), [wall(linear_field(3))], [body("block", points, facets)],
                       element=element, scheme="steady")  # fmt: skip
    put(fluid, linear_field(3))
    exact = [rate_of(section_of(corners, point, normal), normal, 3) for corners in (corners_of_box(3), points)]
    assert plane_probe(fluid, "flow_rate", point, normal)()[""] == pytest.approx(exact[0] - exact[1], abs=1e-12)


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
@pytest.mark.parametrize(("point", "normal"), [((0.5, 0.5), (1, 0)), ((0.43, 0.5), (1, 0.7)), ((0.5, 0.5), (1, 1))])
def test_line_through_a_polygon(element, point, normal):
    points, facets = circle((0.52, 0.47), 0.23, 7), loop(7)
    fluid = make_fluid(uniform([0, 0], [1, 1], [5, 5]), [wall(linear_field(2))], [body("heptagon", points, facets)],
                       element=element, scheme="steady")  # fmt: skip
    put(fluid, linear_field(2))
    hull = [rate_of(section_of(corners, point, normal), normal, 2) for corners in (corners_of_box(2), points)]
    assert plane_probe(fluid, "flow_rate", point, normal)()[""] == pytest.approx(hull[0] - hull[1], abs=1e-12)


def test_bodies_that_overlap_count_once():
    """Two turned blocks; the section of their union is that of both less that of the part in both, by its corners."""
    low, high = ([0.2, 0.3, 0.2], [0.55, 0.7, 0.8]), ([0.4, 0.45, 0.1], [0.8, 0.6, 0.9])
    common = ([0.4, 0.45, 0.2], [0.55, 0.6, 0.8])
    corners = [block(*ends)[0] for ends in (low, high, common)]
    bodies = [body(name, *block(*ends)) for name, ends in (("a", low), ("b", high))]
    fluid = make_fluid(uniform([0] * 3, SIZES, [4, 4, 4]), [wall(linear_field(3))], bodies, element="q1q1",
                       scheme="steady")  # fmt: skip
    put(fluid, linear_field(3))
    point, normal = (0.47, 0.5, 0.5), (1, 0.4, 0.3)
    whole, a, b, both = (rate_of(section_of(c, point, normal), normal, 3) for c in (corners_of_box(3), *corners))
    assert plane_probe(fluid, "flow_rate", point, normal)()[""] == pytest.approx(whole - a - b + both, abs=1e-12)


def test_nested_cells():
    grid = refined(uniform([0, 0], [1, 1], [8, 8]), [RefinedBox([0.2, 0.2], [0.8, 0.8], 2)])
    points, facets = circle((0.52, 0.47), 0.12, 7), loop(7)
    fluid = make_fluid(grid, [wall(linear_field(2))], [body("heptagon", points, facets)], element="q2q1",
                       scheme="steady")  # fmt: skip
    put(fluid, linear_field(2))
    for point, normal in (((0.5, 0.5), (0, 1)), ((0.45, 0.5), (1, 0.6))):
        whole, hole = (rate_of(section_of(c, point, normal), normal, 2) for c in (corners_of_box(2), points))
        assert plane_probe(fluid, "flow_rate", point, normal)()[""] == pytest.approx(whole - hole, abs=1e-12)


@pytest.mark.parametrize("scale", [1.0, 1e-3])
@pytest.mark.parametrize("shift", [0.0, 1.0 / 3.0])
@pytest.mark.parametrize("solved", [False, True])
def test_poiseuille_between_bodies(shift, scale, solved):
    """Two bodies are the walls of a channel of height h: the rate is h^2 / 6 for u = eta (h - eta) / h, anywhere."""
    h, low = 0.613 * scale, (0.2 + shift / 8) * scale
    ends = [([-1 * scale, -1 * scale], [4 * scale, low]), ([-1 * scale, low + h], [4 * scale, 2 * scale])]
    walls = [body(name, *block(*corners)) for name, corners in zip("ab", ends, strict=True)]
    profile = field(lambda x, y, t: (y - low) * (low + h - y) / (h * scale), 0)
    patches = [
        Patch("in", ("x-",), "velocity", profile),
        Patch("out", ("x+",), "outflow"),
        Patch("walls", ("y-", "y+"), "no_slip"),
    ]
    edges = [np.linspace(0, 3 * scale, 25), np.linspace(0, scale, 9)]
    fluid = make_fluid(Grid(tuple(edges)), patches, walls, element="q2q1", scheme="steady")
    exact = h**2 / (6 * scale)
    if solved:
        solve_steady(fluid)
    else:
        put(fluid, profile)
    for point, normal in (((1.5, 0.5), (1, 0)), ((1.37, 0.5), (2, 0)), ((1.4, 0.45), (1, 0.5)), ((1.4, 0.45), (-1, 1))):
        rate = plane_probe(fluid, "flow_rate", np.array(point) * scale, normal)()[""]
        assert abs(rate - np.sign(normal[0]) * exact) < 1e-10 * exact


@pytest.mark.parametrize("dim", [2, 3])
def test_both_sides_of_a_plate_in_one_cell_count_once(dim):
    """A slanted plate of a hundredth of a cell, whose sides have unknowns of their own."""
    points, facets = block([-0.003, -0.8, -0.8][:dim], [0.003, 0.8, 0.8][:dim])
    matrix = turned((0.3, 0.2))[:dim, :dim] if dim == 3 else turned((0.3, 0.0))[:2, :2]
    points = points @ matrix.T + [0.47, 0.49, 0.5][:dim]
    fluid = make_fluid(uniform([0] * dim, [1] * dim, [4] * dim), [wall(linear_field(dim))],
                       [body("plate", points, facets)], element="q1q1", scheme="steady")  # fmt: skip
    assert fluid.grid.sheets is not None
    put(fluid, linear_field(dim))
    box = corners_of_box(dim)
    for normal in ((0.2, 1, 0.1), (1, 0.8, -0.3), (1, 0.1, 0)):
        point, n = (0.45, 0.51, 0.48)[:dim], normal[:dim]
        whole = rate_of(section_of(box, point, n), n, dim)
        found = plane_probe(fluid, "flow_rate", point, n)()[""]
        hole = plate_in_box(points, point, n, dim)
        assert found == pytest.approx(whole - hole, abs=1e-11), normal


def plate_in_box(points, point, normal, dim):
    """The rate through the part of a convex body in the unit box; its corners are those of its sides and of the box."""
    in_box = np.concatenate([np.c_[np.eye(dim), -np.ones(dim)], np.c_[-np.eye(dim), np.zeros(dim)]])
    sides = np.concatenate([ConvexHull(points).equations, in_box])
    corners = HalfspaceIntersection(sides, points.mean(axis=0)).intersections
    return rate_of(section_of(corners, point, normal), normal, dim)


@pytest.mark.parametrize("dim", [2, 3])
def test_plane_without_bodies(dim):
    fluid = make_fluid(uniform([0] * dim, [1] * dim, [3] * dim), [wall(linear_field(dim))], element="q2q1",
                       scheme="steady")  # fmt: skip
    put(fluid, linear_field(dim))
    point, normal = (0.45, 0.51, 0.48)[:dim], (1, 0.8, -0.3)[:dim]
    whole = rate_of(section_of(corners_of_box(dim), point, normal), normal, dim)
    assert plane_probe(fluid, "flow_rate", point, normal)()[""] == pytest.approx(whole, abs=1e-12)


@pytest.mark.parametrize(("dim", "normal"), [(2, (1, 0.3)), (2, (0, 1)), (3, (1, 0.3, -0.6)), (3, (0, 0, 1))])
def test_open_area_and_mean_pressure(dim, normal):
    """A linear pressure: its mean is the value at the centre of what is open, box less block."""
    points, facets = block([-0.2, -0.25, -0.3][:dim], [0.2, 0.25, 0.3][:dim])
    points = points @ turned((0.4, 0.7 if dim == 3 else 0.0))[:dim, :dim].T + [0.52, 0.48, 0.5][:dim]
    fluid = make_fluid(uniform([0] * dim, [1] * dim, [4] * dim), [wall(linear_field(dim))],
                       [body("block", points, facets)], element="q2q1", scheme="steady")  # fmt: skip
    nodes = fluid.unknowns.pressure
    fluid.flow[nodes.dofs[:, 0]] = 2.0 + nodes.points @ LINEAR[0, :dim]
    point = (0.5, 0.5, 0.5)[:dim]
    (box, at), (hole, inside) = (section_of(c, point, normal) for c in (corners_of_box(dim), points))
    mean = 2.0 + (box * at - hole * inside) @ LINEAR[0, :dim] / (box - hole)
    assert plane_probe(fluid, "area", point, normal)()[""] == pytest.approx(box - hole, abs=1e-13)
    assert plane_probe(fluid, "pressure", point, normal)()[""] == pytest.approx(mean, abs=1e-12)


def test_a_plane_that_a_body_covers():
    fluid = make_fluid(uniform([0, 0], [1, 1], [4, 4]), [wall(linear_field(2))],
                       [body("block", *block([0.3, -1], [0.6, 2]))], element="q1q1", scheme="steady")  # fmt: skip
    values = {name: plane_probe(fluid, name, (0.45, 0.5), (1, 0))()[""] for name in ("area", "flow_rate", "pressure")}
    assert values["area"] == values["flow_rate"] == 0.0
    assert np.isnan(values["pressure"])
