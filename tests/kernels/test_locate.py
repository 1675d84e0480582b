"""Points are found in meshes of any size and place, whatever their cells."""

from dataclasses import replace

import numpy as np
import pytest

from fsci import shapes
from solvers.mesh.cell_types import reference_nodes
from solvers.mesh.locate import locate

CELLS = [("tri", 1), ("tri", 2), ("quad", 1), ("quad", 2), ("tet", 1), ("tet", 2), ("hex", 1), ("hex", 2)]


def curved(cell, order):
    """A part of a ring, or of a tube, about the origin."""
    if cell in ("tri", "quad"):
        return shapes.ring(1.0, 2.0, [12, 2], order=order, cell=cell)
    return shapes.tube(1.0, 2.0, 1.5, [12, 2, 2], order=order, cell=cell)


def position(mesh, cell, reference):
    """x(xi) by the interpolation that defines shape functions: a polynomial fit through the cell's nodes."""
    nodes, at = mesh.points[mesh.cells[cell]], reference_nodes(mesh.cell_type)
    degree, dim = (2 if len(at) > 4 and mesh.cell_type not in ("hexahedron",) else 1), at.shape[1]
    powers = np.array(list(np.ndindex(*[degree + 1] * dim)))
    if mesh.cell_type.startswith(("tri", "tetra")):
        powers = powers[powers.sum(axis=1) <= degree]
    fit = np.linalg.solve((at[:, None] ** powers).prod(axis=2), nodes)
    return (reference**powers).prod(axis=1) @ fit


@pytest.mark.parametrize(("cell", "order"), CELLS)
@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e4])
def test_points_are_found(cell, order, scale):
    mesh = curved(cell, order)
    mesh = replace(mesh, points=scale * mesh.points + 3.0 * scale)
    rng = np.random.default_rng(5)
    for index in rng.integers(len(mesh.cells), size=8):
        reference = rng.dirichlet(np.ones(mesh.points.shape[1] + 1))[:-1]  # inside of simplices and of boxes
        x = position(mesh, index, reference)
        found = locate(mesh, x)
        assert found is not None
        assert np.abs(position(mesh, *found) - x).max() < 1e-12 * scale
    for node in (0, len(mesh.points) - 1):
        found = locate(mesh, mesh.points[node])
        assert np.abs(position(mesh, *found) - mesh.points[node]).max() < 1e-12 * scale


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e4])
@pytest.mark.parametrize(("cell", "order"), CELLS)
def test_points_beside_the_mesh_are_not(cell, order, scale):
    mesh = curved(cell, order)
    mesh = replace(mesh, points=scale * mesh.points)
    middle = np.pad([0.0, 0.0], (0, mesh.points.shape[1] - 2), constant_values=0.7)
    for radius in (0.0, 0.8, 2.001, 3.0):
        point = middle + np.pad([radius, 0.0], (0, len(middle) - 2))
        assert locate(mesh, scale * point) is None
    bulge = 2.0 * np.cos(np.pi / 12) if order == 1 else 2.0  # a polygon ends before its circle does
    direction = np.array([np.cos(np.pi / 12), np.sin(np.pi / 12)])
    for radius, inside in ((bulge * (1 - 1e-3), True), (bulge * (1 + 1e-3), False)):
        point = middle + np.pad(radius * direction, (0, len(middle) - 2))
        assert (locate(mesh, scale * point) is not None) == inside
