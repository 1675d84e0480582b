"""Cells of one mesh that cover each other without a facet in common: parts that lie in one another, cells given twice.

With positive determinants everywhere and no folds, a region that is counted twice is bounded by facets of the boundary.
Tested are the nodes of these facets, and for each of their cells its middle and one more point in it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fsci.meshes.boxes import in_boxes
from fsci.meshes.jacobians import inverses
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.locate import shape_functions
from solvers.mesh.mesh import Mesh
from solvers.mesh.topology import boundary_rows, cell_facets

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

#: Depth, in sizes of the smaller cell, up to which cells may lie in each other: where curved surfaces of parts that are
#: not connected touch, and their facets turn by an angle a, they cross by a / 8 of a facet.
CROSSING_CELLS = 0.1

#: Distance from the unit cell up to which a point may lie in a cell whose map is not linear, by the map that is.
DISTORTION = 0.5

#: From such a point: errors of a tenth are squared four times.
STEPS_TO_POINT = 5


def covering(mesh: Mesh, maps: tuple[Array, Array]) -> tuple[int, int] | None:
    """Two cells that cover each other, or None; maps: `middle_maps` of the mesh."""
    points, owners, nodes = _points(mesh)
    which, cells = in_boxes(points, *_boxes(mesh))
    apart = owners[which] != cells
    corner = np.flatnonzero(which < len(nodes))
    apart[corner[(mesh.cells[cells[corner]] == nodes[which[corner], None]).any(axis=1)]] = False
    which, cells = which[apart], cells[apart]
    size = 1.0 / np.linalg.norm(maps[1], axis=(1, 2))
    least = CROSSING_CELLS * np.minimum(size[cells], size[owners[which]]) / size[cells]
    reference = _linearised(mesh, maps, points[which], cells)
    near = _depth(mesh.cell_type, reference) > (least if _affine(mesh) else -DISTORTION)
    which, cells, least, reference = which[near], cells[near], least[near], reference[near]
    if not _affine(mesh):
        reference, missed = _newton(mesh, points[which], cells, reference)
        least = np.where(missed < 0.5 * least, least, np.inf)
    found = np.flatnonzero(_depth(mesh.cell_type, reference) > least)
    pairs = np.sort(np.stack([owners[which[found]], cells[found]], axis=1), axis=1)
    return min(map(tuple, pairs.tolist()), default=None)


def _affine(mesh: Mesh) -> bool:
    return CELL_TYPES[mesh.cell_type].shape.simplex and CELL_TYPES[mesh.cell_type].degree == 1


def _linearised(mesh: Mesh, maps: tuple[Array, Array], points: Array, cells: Indices) -> Array:
    """Reference coordinates of points in cells (n,), by the Jacobian in the middle of the cells."""
    start, inverse = maps
    middle = CELL_TYPES[mesh.cell_type].middle
    return middle + np.einsum("nij,nj->ni", inverse[cells], points - start[cells])


def _newton(mesh: Mesh, points: Array, cells: Indices, reference: Array) -> tuple[Array, Array]:
    """(reference coordinates of points in cells (n, dim), length of the last step) by Newton's method."""
    nodes = mesh.points[mesh.cells[cells]]
    step = np.zeros_like(reference)
    for _ in range(STEPS_TO_POINT):
        values, gradients = shape_functions(mesh.cell_type, reference)
        jacobian = np.einsum("naj,nai->nij", gradients, nodes)
        with np.errstate(all="ignore"):
            step = np.einsum("nij,nj->ni", inverses(jacobian), points - np.einsum("na,nai->ni", values, nodes))
            reference = np.clip(reference + np.nan_to_num(step), -1.0, 2.0)
    return reference, np.nan_to_num(np.linalg.norm(step, axis=1), nan=np.inf)


def _points(mesh: Mesh) -> tuple[Array, Indices, Indices]:
    """(points to test [m], the cell of each, numbers of those that are nodes, which come first)."""
    facets = cell_facets(mesh)
    outer = boundary_rows(mesh)
    owners = outer // len(CELL_TYPES[mesh.cell_type].facets)
    corners = CELL_TYPES[CELL_TYPES[mesh.cell_type].facet].corners
    nodes, first = np.unique(facets[outer, :corners], return_index=True)
    cells = np.unique(owners)
    kind = CELL_TYPES[mesh.cell_type]
    # not only middles: those of regular meshes that are shifted may all lie at the sides of others
    weights = np.random.default_rng(0).dirichlet(np.ones(kind.corners), len(cells))
    within = np.concatenate([np.tile(kind.middle, (len(cells), 1)), weights @ kind.reference_nodes[: kind.corners]])
    cells = np.tile(cells, 2)
    inner = np.einsum("ca,cai->ci", shape_functions(mesh.cell_type, within)[0], mesh.points[mesh.cells[cells]])
    points = np.concatenate([mesh.points[nodes], inner])
    return points, np.concatenate([owners[first // corners], cells]), nodes


def _boxes(mesh: Mesh) -> tuple[Array, Array]:
    """Lowest and highest corners around the cells."""
    low, high = mesh.points[mesh.cells[:, 0]], mesh.points[mesh.cells[:, 0]]
    for column in mesh.cells.T[1:]:
        low, high = np.minimum(low, mesh.points[column]), np.maximum(high, mesh.points[column])
    return low, high


def _depth(cell_type: str, reference: Array) -> Array:
    """Least distance from the sides of the unit cell, of points (n, dim) in it."""
    if CELL_TYPES[cell_type].shape.simplex:
        return np.asarray(np.minimum(reference.min(axis=1), 1.0 - reference.sum(axis=1)))
    return np.asarray(np.minimum(reference, 1.0 - reference).min(axis=1))
