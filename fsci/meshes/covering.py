"""Cells of one mesh that cover each other without a facet in common: parts that lie in one another, cells given twice.

With positive determinants everywhere and no folds, a region that is counted twice is bounded by facets of the boundary.
Tested are the nodes of these facets, and for each of their cells its middle and one more point in it.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from fsci.meshes.jacobians import inverse_sizes, middle_maps
from solvers.cell_types import CELL_TYPES
from solvers.locate import pull_back, shape_functions
from solvers.mesh import Mesh
from solvers.mesh_topology import cell_facets

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

#: Depth, in sizes of the smaller cell, up to which cells may lie in each other: where curved surfaces of parts that are
#: not connected touch, and their facets turn by an angle a, they cross by a / 8 of a facet.
CROSSING = 0.1

#: Distance from the unit cell up to which a point may lie in a cell whose map is not linear, by the map that is.
DISTORTION = 0.5


def covering(mesh: Mesh, ids: Indices) -> tuple[int, int] | None:
    """Two cells that cover each other, or None; ids: `facet_ids` of the mesh."""
    points, owners, nodes = _points(mesh, ids)
    which, cells = _in_boxes(mesh, points)
    apart = owners[which] != cells
    corner = np.flatnonzero(which < len(nodes))
    apart[corner[(mesh.cells[cells[corner]] == nodes[which[corner], None]).any(axis=1)]] = False
    which, cells = which[apart], cells[apart]
    size = 1.0 / inverse_sizes(mesh)
    least = CROSSING * np.minimum(size[cells], size[owners[which]]) / size[cells]
    near = _depth(mesh.cell_type, _linearised(mesh, points[which], cells)) > (least if _affine(mesh) else -DISTORTION)
    which, cells, least = which[near], cells[near], least[near]
    if not len(which):
        return None
    extent = np.ptp(mesh.points, axis=0).max()
    reference, missed = pull_back(mesh.cell_type, (mesh.points[mesh.cells[cells]] - points[which][:, None]) / extent)
    depth = _depth(mesh.cell_type, reference)
    found = np.flatnonzero((depth > least) & (missed * extent < 0.5 * least * size[cells]))
    pairs = np.sort(np.stack([owners[which[found]], cells[found]], axis=1), axis=1)
    return min(map(tuple, pairs.tolist()), default=None)


def _affine(mesh: Mesh) -> bool:
    return CELL_TYPES[mesh.cell_type].shape.simplex and CELL_TYPES[mesh.cell_type].degree == 1


def _linearised(mesh: Mesh, points: Array, cells: Indices) -> Array:
    """Reference coordinates of points in cells (n,), by the Jacobian in the middle of the cells."""
    start, inverse = middle_maps(mesh)
    middle = CELL_TYPES[mesh.cell_type].middle
    return middle + np.einsum("nij,nj->ni", inverse[cells], points - start[cells])


def _points(mesh: Mesh, ids: Indices) -> tuple[Array, Indices, Indices]:
    """(points to test [m], the cell of each, numbers of those that are nodes, which come first)."""
    facets = cell_facets(mesh)
    outer = np.flatnonzero(np.bincount(ids)[ids] == 1)
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


def _in_boxes(mesh: Mesh, points: Array) -> tuple[Indices, Indices]:
    """(points, cells): all pairs of a point in the box of a cell, found by bins over the extent of the mesh."""
    low, high = mesh.points[mesh.cells[:, 0]], mesh.points[mesh.cells[:, 0]]
    for column in mesh.cells.T[1:]:
        low, high = np.minimum(low, mesh.points[column]), np.maximum(high, mesh.points[column])
    start, dim = low.min(axis=0), points.shape[1]
    per_axis = max(int(len(points) ** (1.0 / dim)), 1)
    width = np.maximum((high.max(axis=0) - start) / per_axis, np.finfo(float).tiny)
    shape = (per_axis,) * dim

    def bins(at: Array) -> Indices:
        return np.clip((at - start) / width, 0, per_axis - 1).astype(np.int64)

    bin_of = np.ravel_multi_index(tuple(bins(points).T), shape)
    order = np.argsort(bin_of, kind="stable")
    begin = np.searchsorted(bin_of[order], np.arange(per_axis**dim + 1))
    first, last = bins(low), bins(high)
    near = np.flatnonzero(_sums(np.diff(begin).reshape(shape), first, last))
    cells, position = _spread(near, (last - first + 1)[near].prod(axis=1))
    counts = (last - first + 1)[cells]
    index = np.empty((len(cells), dim), dtype=np.int64)
    for axis in range(dim):
        position, index[:, axis] = np.divmod(position, counts[:, axis])
    number = np.ravel_multi_index(tuple((first[cells] + index).T), shape)
    pairs, place = _spread(np.arange(len(cells)), begin[number + 1] - begin[number])
    which, cells = order[begin[number[pairs]] + place], cells[pairs]
    inside = ((points[which] >= low[cells]) & (points[which] <= high[cells])).all(axis=1)
    return which[inside], cells[inside]


def _sums(counts: Indices, first: Indices, last: Indices) -> Indices:
    """Sums of an array over ranges of its indices, both ends of them (n, dim), by its cumulative sums."""
    total = np.pad(counts, [(1, 0)] * counts.ndim)
    for axis in range(counts.ndim):
        total = total.cumsum(axis=axis)
    sums = np.zeros(len(first), dtype=np.int64)
    for ends in product((0, 1), repeat=counts.ndim):
        corner = np.where(np.array(ends, dtype=bool), last + 1, first)
        sums += (-1) ** (counts.ndim - sum(ends)) * total[tuple(corner.T)]
    return sums


def _spread(items: Indices, counts: Indices) -> tuple[Indices, Indices]:
    """(each item so many times, number of the repetition from 0 on)."""
    repeated = np.repeat(items, counts)
    ends = np.cumsum(counts)
    return repeated, np.arange(len(repeated)) - np.repeat(ends - counts, counts)


def _depth(cell_type: str, reference: Array) -> Array:
    """Least distance from the sides of the unit cell, of points (n, dim) in it."""
    if CELL_TYPES[cell_type].shape.simplex:
        return np.asarray(np.minimum(reference.min(axis=1), 1.0 - reference.sum(axis=1)))
    return np.asarray(np.minimum(reference, 1.0 - reference).min(axis=1))
