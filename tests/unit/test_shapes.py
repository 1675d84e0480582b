"""Built-in shapes: exact surfaces, positive and conforming cells, volumes that converge at the order of the cells."""

from math import log2, pi

import numpy as np
import pytest
from cell_geometry import smallest_determinant, volume, vtk_nodes

from fsci import shapes
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.mesh import Mesh
from solvers.mesh.topology import boundary_facets, cell_facets, signed_volumes, surface_facets


def radius(points, *axes):
    return np.linalg.norm(points[:, list(axes)], axis=1)


def about_circle(points):
    """Distance from the circle of radius 3 about the y axis."""
    return np.hypot(radius(points, 0, 2) - 3, points[:, 1])


# name: mesh at refinement n, exact volume, equation of each surface
PLANE = {
    "rectangle": (
        lambda n, **kind: shapes.rectangle((3, 2), (2 * n, n), (1, -1), **kind),
        6,
        {
            "left": lambda x: x[:, 0] - 1,
            "right": lambda x: x[:, 0] - 4,
            "bottom": lambda x: x[:, 1] + 1,
            "top": lambda x: x[:, 1] - 1,
        },
    ),
    "disc": (
        lambda n, **kind: shapes.disc(2, (4 * n, n), **kind),
        4 * pi,
        {"outer": lambda x: radius(x, 0, 1) - 2},
    ),
    "ring": (
        lambda n, **kind: shapes.ring(1, 2, (4 * n, n), **kind),
        3 * pi,
        {"inner": lambda x: radius(x, 0, 1) - 1, "outer": lambda x: radius(x, 0, 1) - 2},
    ),
    "part of a ring": (
        lambda n, **kind: shapes.ring(1, 2, (2 * n, n), 90, 90, **kind),
        3 * pi / 4,
        {
            "inner": lambda x: radius(x, 0, 1) - 1,
            "outer": lambda x: radius(x, 0, 1) - 2,
            "start": lambda x: x[:, 0],
            "end": lambda x: x[:, 1],
        },
    ),
}
ENDS = {"bottom": lambda x: x[:, 2], "top": lambda x: x[:, 2] - 3}
SOLID = {
    "box": (
        lambda n, **kind: shapes.box((3, 2, 1), (2, n, 1), (1, 2, 3), **kind),
        6,
        {
            "left": lambda x: x[:, 0] - 1,
            "right": lambda x: x[:, 0] - 4,
            "front": lambda x: x[:, 1] - 2,
            "back": lambda x: x[:, 1] - 4,
            "bottom": lambda x: x[:, 2] - 3,
            "top": lambda x: x[:, 2] - 4,
        },
    ),
    "beam": (
        lambda n, **kind: shapes.beam(4, 2, 1, (3, n, 1), **kind),
        8,
        {
            "left": lambda x: x[:, 0],
            "right": lambda x: x[:, 0] - 4,
            "front": lambda x: x[:, 1] + 1,
            "back": lambda x: x[:, 1] - 1,
            "bottom": lambda x: x[:, 2] + 0.5,
            "top": lambda x: x[:, 2] - 0.5,
        },
    ),
    "cylinder": (
        lambda n, **kind: shapes.cylinder(2, 3, (4 * n, n, 1), **kind),
        12 * pi,
        {"outer": lambda x: radius(x, 0, 1) - 2, **ENDS},
    ),
    "tube": (
        lambda n, **kind: shapes.tube(1, 2, 3, (4 * n, n, 2), **kind),
        9 * pi,
        {"inner": lambda x: radius(x, 0, 1) - 1, "outer": lambda x: radius(x, 0, 1) - 2, **ENDS},
    ),
    "a quarter of a tube": (
        lambda n, **kind: shapes.tube(1, 2, 3, (2 * n, n, 2), 90, 180, **kind),
        9 * pi / 4,
        {
            "inner": lambda x: radius(x, 0, 1) - 1,
            "outer": lambda x: radius(x, 0, 1) - 2,
            "start": lambda x: x[:, 1],
            "end": lambda x: x[:, 0],
            **ENDS,
        },
    ),
    "solid torus": (
        lambda n, **kind: shapes.solid_torus(3, 1, (6 * n, 4 * n), **kind),
        6 * pi**2,
        {"outer": lambda x: about_circle(x) - 1},
    ),
    "half of a solid torus": (
        lambda n, **kind: shapes.solid_torus(3, 1, (3 * n, 4 * n), 180, 90, **kind),
        3 * pi**2,
        {"outer": lambda x: about_circle(x) - 1, "start": lambda x: x[:, 0], "end": lambda x: x[:, 0]},
    ),
    "hollow torus": (
        lambda n, **kind: shapes.hollow_torus(3, 0.5, 1, (6 * n, 4 * n, 1), **kind),
        4.5 * pi**2,
        {"inner": lambda x: about_circle(x) - 0.5, "outer": lambda x: about_circle(x) - 1},
    ),
    "hollow sphere": (
        lambda n, **kind: shapes.hollow_sphere(1, 2, (n, n), **kind),
        28 * pi / 3,
        {"inner": lambda x: radius(x, 0, 1, 2) - 1, "outer": lambda x: radius(x, 0, 1, 2) - 2},
    ),
    "sphere": (
        lambda n, **kind: shapes.sphere(2, (n, n), **kind),
        32 * pi / 3,
        {"outer": lambda x: radius(x, 0, 1, 2) - 2},
    ),
}
CASES = [(name, cell, order) for name in PLANE for cell in ("quad", "tri") for order in (1, 2)]
CASES += [(name, cell, order) for name in SOLID for cell in ("hex", "tet") for order in (1, 2)]


@pytest.mark.parametrize(("name", "cell", "order"), CASES)
def test_shape_is_conforming_positive_and_exact_on_its_surfaces(name, cell, order):
    make, _, equations = (PLANE | SOLID)[name]
    mesh = make(2, cell=cell, order=order)
    assert smallest_determinant(mesh) > 0.05

    # every node is used, and none stands on another
    assert np.array_equal(np.unique(mesh.cells), np.arange(len(mesh.points)))
    assert len(np.unique(np.round(mesh.points, 9) + 0.0, axis=0)) == len(mesh.points)

    # facets, mid nodes included, belong to one cell or two, seen from opposite sides
    facets = cell_facets(mesh)
    _, counts = np.unique(np.sort(facets, axis=1), axis=0, return_counts=True)
    assert counts.max() <= 2
    assert np.count_nonzero(counts == 1) == len(boundary_facets(mesh))

    # those of one cell are the named surfaces, each once
    assert set(mesh.surfaces) == set(equations)
    parts = [surface_facets(mesh, surface) for surface in equations]
    assert all(len(part) for part in parts)
    union = np.sort(np.concatenate(parts), axis=1)
    boundary = np.sort(boundary_facets(mesh), axis=1)
    assert len(union) == len(boundary)
    assert np.array_equal(np.unique(union, axis=0), np.unique(boundary, axis=0))
    for surface, equation in equations.items():
        assert np.abs(equation(mesh.points[np.unique(surface_facets(mesh, surface))])).max() < 1e-13


@pytest.mark.parametrize(("name", "cell", "order"), CASES)
def test_volume_converges_at_twice_the_order_of_the_cells(name, cell, order):
    make, exact, _ = (PLANE | SOLID)[name]
    coarse, fine = (abs(volume(make(n, cell=cell, order=order)) / exact - 1) for n in (3, 6))
    if name in ("rectangle", "box", "beam"):
        assert coarse < 1e-13
    else:
        assert log2(coarse / fine) > 2 * order - 0.2
        assert fine < (0.04 if order == 1 else 0.002)


def test_hollow_torus_has_the_nodes_of_its_formula():
    mesh = shapes.hollow_torus(76, 19.5, 24, (40, 20, 1))
    assert (len(mesh.cells), len(mesh.points), len(mesh.surfaces["outer"])) == (800, 1600, 800)
    a, b, r = np.meshgrid(2 * pi * np.arange(40) / 40, 2 * pi * np.arange(20) / 20, [19.5, 24.0], indexing="ij")
    expected = np.stack([(76 + r * np.cos(b)) * np.cos(a), r * np.sin(b), (76 + r * np.cos(b)) * np.sin(a)])
    distance = np.linalg.norm(mesh.points[:, None] - expected.reshape(3, -1).T[None], axis=2)
    assert distance.min(axis=0).max() < 1e-12
    assert len(np.unique(distance.argmin(axis=1))) == 1600


def test_cells_count_in_the_directions_named():
    assert len(shapes.disc(1, (16, 3)).cells) == 4 * 4 + 16 * 3
    assert len(shapes.tube(1, 2, 1, (8, 2, 5)).cells) == 80
    assert len(shapes.annulus(1, 2, 1, (8, 2, 5)).surfaces["inner"]) == 40
    assert len(shapes.hollow_sphere(1, 2, (4, 3)).cells) == 6 * 16 * 3
    assert len(shapes.box((1, 1, 1), (2, 3, 4), cell="tet").cells) == 6 * 24


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: shapes.disc(1, (6, 2)), "cells: the number of cells around must be a multiple of 4, not 6"),
        (lambda: shapes.ring(1, 2, (2, 1)), "at least 3 cells"),
        (lambda: shapes.ring(1, 2, (8, 1), 400), "angle: must be at most 360 degrees, not 400"),
        (lambda: shapes.tube(2, 1, 1, (8, 1, 1)), "outer_radius: must be greater than 'inner_radius', 2, not 1"),
        (lambda: shapes.hollow_torus(2, 1, 2, (8, 8, 1)), "outer_radius: must be less than 'major_radius', 2, not 2"),
        (lambda: shapes.disc(-1, (8, 2)), "radius: must be greater than 0, not -1"),
        (lambda: shapes.rectangle((1, 1), (1, 0)), "cells: must be at least 1, not 0"),
        (lambda: shapes.rectangle((1, 1, 1), (1, 1)), "size: must have 2 entries, not 3"),
        (lambda: shapes.rectangle((1, 1), (1, 1), cell="hex"), "unknown cell 'hex'; there are: quad, tri"),
    ],
)
def test_impossible_shape_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


@pytest.mark.parametrize("cell_type", [name for name, record in CELL_TYPES.items() if record.facet])
def test_nodes_and_facets_are_those_of_vtk(cell_type):
    nodes = vtk_nodes(cell_type)
    assert np.allclose(CELL_TYPES[cell_type].reference_nodes, nodes)
    corners = {"line": 2, "line3": 2, "triangle": 3, "triangle6": 3, "quad": 4, "quad9": 4}[CELL_TYPES[cell_type].facet]
    pattern = CELL_TYPES[CELL_TYPES[cell_type].facet].reference_nodes
    for facet in CELL_TYPES[cell_type].facets:
        x = nodes[list(facet)]
        # the nodes lie on the facet as on the unit cell of its type
        span = (x[[1, 2]] if corners == 3 else x[[1, corners - 1]]) - x[0]
        assert np.allclose(x, x[0] + pattern @ span[: pattern.shape[1]])
        edge = x[1] - x[0]
        normal = np.array([edge[1], -edge[0]]) if nodes.shape[1] == 2 else np.cross(span[0], span[1])
        assert normal @ (x.mean(axis=0) - nodes.mean(axis=0)) > 0


def test_volume_of_a_cell_turned_inside_out_is_negative():
    points = np.array([[0.0, 0], [2, 0], [2, 1], [0, 1]])
    cells = np.array([[0, 1, 2, 3], [0, 3, 2, 1]])
    assert signed_volumes(Mesh(points, cells, "quad")) == pytest.approx([2, -2])


def test_surface_facets_inside_the_mesh_are_refused():
    mesh = shapes.rectangle((2, 1), (2, 1))
    middle = np.flatnonzero(mesh.points[:, 0] == 1)
    mesh.surfaces["middle"] = middle[None]
    with pytest.raises(ValueError, match="'middle': 1 of its facets are not on the boundary"):
        surface_facets(mesh, "middle")


@pytest.mark.parametrize(("cell", "order"), [("hex", 1), ("hex", 2), ("tet", 1)])
def test_leaflet(cell, order):
    """Three leaflets side by side: lips parallel to planes through the axis, half of the gap away at the axis."""
    gap, thickness, height, lip = 0.04, 0.06, 1.2, 0.4
    mesh = shapes.leaflet(1.0, thickness, height, lip, 0.2, (8, 1, 6), gap=gap, order=order, cell=cell)
    assert smallest_determinant(mesh) > 0.05
    facets = np.concatenate([surface_facets(mesh, name) for name in mesh.surfaces])
    assert np.array_equal(
        np.unique(np.sort(facets, axis=1), axis=0), np.unique(np.sort(boundary_facets(mesh), axis=1), axis=0)
    )
    assert len(facets) == len(boundary_facets(mesh))

    x = mesh.points[np.unique(surface_facets(mesh, "lips"))]
    assert x[:, 2].min() == pytest.approx(height - lip, abs=1e-13)
    assert mesh.points[np.unique(surface_facets(mesh, "inner"))][:, 2].max() == pytest.approx(height - lip, abs=1e-13)
    lips = x[x[:, 1] > -1e-9]
    distance = np.sin(pi / 3) * lips[:, 0] - np.cos(pi / 3) * lips[:, 1]  # from the plane at 60 degrees
    assert distance.max() == pytest.approx(gap / 2, abs=1e-13)
    assert distance.min() == pytest.approx(0.0, abs=1e-13)
    assert np.abs(radius(lips[np.abs(distance) < 1e-12], 0, 1) - 1.0).max() < 1e-12
    foot = mesh.points[np.unique(surface_facets(mesh, "bottom"))]
    assert radius(foot, 0, 1).min() > 1.0  # within the wall of a tube of radius 1
    outer = mesh.points[np.unique(surface_facets(mesh, "outer"))]
    lips = outer[(outer[:, 2] > height - lip - 1e-9) & (outer[:, 1] > 1e-9)]
    distance = np.sin(pi / 3) * lips[:, 0] - np.cos(pi / 3) * lips[:, 1]
    assert distance.min() == pytest.approx(thickness, abs=1e-13)


@pytest.mark.parametrize(("lip", "rows"), [(0.05, 1), (0.2, 1), (0.4, 2), (0.9, 4)])
def test_lips_are_whole_rows_of_cells(lip, rows):
    """The row nearest to the height of the lips; at least one, and one for the pouch."""
    mesh = shapes.leaflet(1.0, 0.06, 1.0, lip, 0.05, (8, 1, 5))
    facets = surface_facets(mesh, "lips")
    assert len(facets) == 8 * rows
    assert mesh.points[np.unique(facets)][:, 2].min() == pytest.approx(1.0 - lip, abs=1e-13)
    assert len(surface_facets(mesh, "inner")) == 8 * (5 - rows)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"cells": (7, 1, 6)}, "must be even, not 7"),
        ({"cells": (8, 1, 1)}, "at least 2, not 1"),
        ({"lip": 1.1}, "'lip' and 'post' must be lower together than 'height', 1.2"),
    ],
)
def test_leaflets_that_are_none(settings, message):
    sizes = {"radius": 1, "thickness": 0.06, "height": 1.2, "lip": 0.4, "post": 0.2, "cells": (8, 1, 6)}
    with pytest.raises(ValueError, match=message):
        shapes.leaflet(**(sizes | settings))


def test_sizes_and_counts_as_arrays():
    """Functions of shapes take arrays and numpy's numbers where they take lists and numbers."""
    mesh = shapes.box(np.array([1.0, 2.0, 3.0]), np.array([1, 2, 2]), origin=np.zeros(3))
    assert np.array_equal(mesh.points, shapes.box([1.0, 2.0, 3.0], [1, 2, 2]).points)
    assert np.array_equal(shapes.disc(np.float64(1.0), np.array([8, 1])).points, shapes.disc(1.0, [8, 1]).points)
    with pytest.raises(ValueError, match="size: must have 2 entries, not 3"):
        shapes.rectangle(np.ones(3), [1, 1])
