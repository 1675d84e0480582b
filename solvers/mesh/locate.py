"""The cell of a mesh that contains a point, and the reference coordinates in it, without DOLFINx."""

from __future__ import annotations

import numpy as np

from solvers.api import Array
from solvers.mesh.cell_types import CELL_TYPES, reference_nodes
from solvers.mesh.mesh import Mesh

#: Distance from the mesh, relative to its extent, up to which a point counts as inside: formulas for points on the
#: boundary are seldom exact.
OUTSIDE_DISTANCE = 1e-6

#: Margin of the box of a cell, by degree. A quadratic function exceeds its nodal values by at most 1/8 per direction.
BULGE = {1: 0.0, 2: 0.5}

#: Iterations at most for the reference coordinates of a point: Newton's method doubles its digits in each.
NEWTON_STEPS = 30


def locate(mesh: Mesh, point: Array) -> tuple[int, Array] | None:
    """(cell, reference coordinates) of a point [m]; None if it is outside of the mesh.

    Solves x(xi) = point by Newton's method in all cells whose box contains the point. Lengths are relative to the
    extent of the mesh.
    """
    extent = float(np.ptp(mesh.points, axis=0).max())
    nodes = (mesh.points[mesh.cells] - point) / extent
    low, high = nodes.min(axis=1), nodes.max(axis=1)
    margin = BULGE[CELL_TYPES[mesh.cell_type].degree] * (high - low).max(axis=1, keepdims=True) + OUTSIDE_DISTANCE
    near = np.flatnonzero(((low - margin <= 0.0) & (high + margin >= 0.0)).all(axis=1))
    if not len(near):
        return None
    reference, missed = _pull_back(mesh.cell_type, nodes[near])
    best = int(np.argmin(missed))
    return (int(near[best]), reference[best]) if missed[best] <= OUTSIDE_DISTANCE else None


def _pull_back(cell_type: str, nodes: Array) -> tuple[Array, Array]:
    """(reference coordinates of the point of each cell near the origin, its distance from the origin).

    Newton's iterates are clipped to the cell. The distance vanishes if the origin is in the cell, else it is of the
    order of the distance of the cell.
    """
    inside = _clip(cell_type, np.full((len(nodes), nodes.shape[2]), 1.0 / 3.0))
    for _ in range(NEWTON_STEPS):
        values, gradients = shape_functions(cell_type, inside)
        x = np.einsum("ca,cai->ci", values, nodes)
        jacobian = np.einsum("caj,cai->cij", gradients, nodes)
        step = np.einsum("cij,cj->ci", np.linalg.pinv(jacobian), -x)
        new = _clip(cell_type, inside + step)
        done = np.abs(new - inside).max() < 1e-15
        inside = new
        if done:
            break
    values, _ = shape_functions(cell_type, inside)
    return inside, np.linalg.norm(np.einsum("ca,cai->ci", values, nodes), axis=1)


def _clip(cell_type: str, reference: Array) -> Array:
    """Points clipped to the reference cell."""
    clipped = np.clip(reference, 0.0, 1.0)
    if CELL_TYPES[cell_type].shape.simplex:
        clipped = clipped / np.maximum(clipped.sum(axis=1, keepdims=True), 1.0)
    return clipped


def _exponents(cell_type: str) -> Array:
    """Exponents of the monomials that span the shape functions, shape (functions, dim)."""
    dim, degree = reference_nodes(cell_type).shape[1], CELL_TYPES[cell_type].degree
    powers = np.stack(np.meshgrid(*[np.arange(degree + 1)] * dim, indexing="ij"), axis=-1).reshape(-1, dim)
    simplex = CELL_TYPES[cell_type].shape.simplex
    return powers[powers.sum(axis=1) <= degree] if simplex else powers


def shape_functions(cell_type: str, reference: Array) -> tuple[Array, Array]:
    """Lagrange functions (points, nodes) and their gradients (points, nodes, dim), nodes in the order of VTK.

    reference: points in the unit cell, shape (points, dim).
    """
    powers = _exponents(cell_type)
    inverse = np.linalg.inv(np.prod(reference_nodes(cell_type)[:, None, :] ** powers, axis=2))
    factors = reference[:, None, :] ** powers
    slopes = powers * reference[:, None, :] ** np.maximum(powers - 1, 0)
    gradients = [
        np.prod(np.where(np.arange(powers.shape[1]) == axis, slopes, factors), axis=2)
        for axis in range(powers.shape[1])
    ]
    return factors.prod(axis=2) @ inverse, np.einsum("pmj,ma->paj", np.stack(gradients, axis=2), inverse)
