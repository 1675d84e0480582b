"""Jacobians and volumes of meshes by quadrature, from Lagrange shape functions on VTK's nodes."""

from itertools import product

import numpy as np
from vtkmodules import vtkCommonDataModel as vtk

VTK_CELLS = {
    "line3": vtk.vtkQuadraticEdge,
    "triangle": vtk.vtkTriangle,
    "triangle6": vtk.vtkQuadraticTriangle,
    "quad": vtk.vtkQuad,
    "quad9": vtk.vtkBiQuadraticQuad,
    "tetra": vtk.vtkTetra,
    "tetra10": vtk.vtkQuadraticTetra,
    "hexahedron": vtk.vtkHexahedron,
    "hexahedron27": vtk.vtkTriQuadraticHexahedron,
}


def vtk_nodes(cell_type):
    """Node positions in the unit cell as VTK has them, shape (nodes, dim)."""
    cell = VTK_CELLS[cell_type]()
    positions = np.array([cell.GetParametricCoords()[i] for i in range(3 * cell.GetNumberOfPoints())])
    return positions.reshape(-1, 3)[:, : cell.GetCellDimension()]


def quadrature(cell_type):
    """Points and weights of degree 5 or more in the unit cell."""
    dim = vtk_nodes(cell_type).shape[1]
    x, w = np.polynomial.legendre.leggauss(4)
    points = np.array(list(product((x + 1) / 2, repeat=dim)))
    weights = np.array([np.prod(c) for c in product(w / 2, repeat=dim)])
    if cell_type.startswith(("triangle", "tetra")):  # the cube collapsed onto the simplex
        for axis in range(1, dim):
            weights = weights * (1 - points[:, axis - 1]) ** (dim - axis)
        for axis in range(dim - 1, 0, -1):
            points[:, axis] *= np.prod(1 - points[:, :axis], axis=1)
    return points, weights


def determinants(mesh, points):
    """Jacobian determinants of all cells at points of the unit cell, shape (cells, points)."""
    nodes = vtk_nodes(mesh.cell_type)
    order = 2 if len(nodes) in (6, 9, 10, 27) else 1
    exponents = np.array(list(product(range(order + 1), repeat=nodes.shape[1])))
    if mesh.cell_type.startswith(("triangle", "tetra")):
        exponents = exponents[exponents.sum(axis=1) <= order]
    coefficients = np.linalg.inv(np.prod(nodes[:, None] ** exponents, axis=2))
    gradients = []
    for axis in range(nodes.shape[1]):
        lowered = exponents - np.eye(nodes.shape[1], dtype=int)[axis]
        powers = np.prod(points[:, None] ** np.maximum(lowered, 0), axis=2)
        gradients.append(powers * exponents[:, axis] @ coefficients)
    return np.linalg.det(np.einsum("dqn,cnx->cqxd", np.array(gradients), mesh.points[mesh.cells]))


def smallest_determinant(mesh):
    """Over all nodes and quadrature points, relative to the cell's mean."""
    points = np.vstack([vtk_nodes(mesh.cell_type), quadrature(mesh.cell_type)[0]])
    values = determinants(mesh, points)
    return (values.min(axis=1) / np.abs(values.mean(axis=1))).min()


def volume(mesh):
    points, weights = quadrature(mesh.cell_type)
    return float((determinants(mesh, points) @ weights).sum())
