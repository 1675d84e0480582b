"""Membranes and leaflets: a surface in space, or a polyline in the plane, as the middle of layers of cells.

A node x of the surface becomes x + s d with s from -1/2 to 1/2, where d has the least squares of n . d - thickness over
the corners of facets around it, weighted by their angles; n are their normals. It is exact where these lie in three
planes or less, so that plates, folds and corners have their thickness, measured along the normals.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fsci.meshes.jacobians import inverted
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.mesh import Mesh
from solvers.mesh.topology import boundary_facets

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

#: Share of the largest eigenvalue below which the normals around a node have one plane less. A bend of the angle a
#: has a^2 / 4, and a d that neglects it misses a^2 / 8 of the thickness: from 1e-13 to 1e-7 it does not show.
ONE_PLANE = 1e-10
#: Cells by the corners of a facet.
CELLS = {2: ("quad", "quad9"), 3: ("tetra", "tetra10"), 4: ("hexahedron", "hexahedron27")}


class BadSheet(ValueError):
    """A surface that is not the middle of a body."""


@dataclass(frozen=True)
class Sheet:
    """How a surface becomes a body."""

    thickness: float  #: in the unit of the points
    layers: int
    order: int  #: of the cells, 1 or 2


def thickened(points: Array, facets: Indices, sheet: Sheet, rims: Mapping[str, Indices]) -> Mesh:
    """Layers of cells around a surface; it has the surfaces top, where the normals of its facets point, bottom, edge.

    points: (n, 2 or 3), equal ones become one node; facets: lines in the plane, triangles or quadrilaterals in space,
    (m, 2, 3 or 4), turned to face like their neighbours; rims: name -> parts of the edge, (k, 1 or 2), which become
    surfaces of this name. Raises BadSheet with a place.
    """
    nodes, same = np.unique(points, axis=0, return_inverse=True)
    same = same.ravel()
    facets = same[facets]
    facets = facets[(facets != np.roll(facets, 1, axis=1)).all(axis=1)]
    used, local = np.unique(facets, return_inverse=True)
    nodes, facets = nodes[used], local.reshape(facets.shape)
    facets = _facing_alike(nodes, facets)
    d = _offsets(nodes, facets, sheet.thickness)

    count = len(nodes)
    shares = np.arange(sheet.layers + 1) / sheet.layers - 0.5
    levels = (nodes + shares[:, None, None] * d).reshape(-1, nodes.shape[1])
    below = (facets + count * np.arange(sheet.layers)[:, None, None]).reshape(-1, facets.shape[1])
    cells = _cells(below, count)
    kind = CELLS[facets.shape[1]]
    mesh = Mesh(levels, cells, kind[0])
    _require_room(mesh, nodes[facets].mean(axis=1))
    own = np.full(same.max() + 1, -1)
    own[used] = np.arange(count)
    mesh = replace(
        mesh, surfaces=_surfaces(mesh, count, sheet.layers, {key: own[same[of]] for key, of in rims.items()})
    )
    return mesh if sheet.order == 1 else _second_order(mesh, kind[1])


def _ends(facets: Indices) -> tuple[Indices, NDArray[np.bool_]]:
    """Sides of the facets, by their nodes in ascending order, shape (facets, sides, 1 or 2), and which way they run."""
    if facets.shape[1] == 2:
        return facets[:, :, None], np.tile([False, True], (len(facets), 1))
    sides = np.stack([facets, np.roll(facets, -1, axis=1)], axis=2)
    return np.sort(sides, axis=2), sides[..., 0] < sides[..., 1]


def _facing_alike(nodes: Array, facets: Indices) -> Indices:
    """The facets, those turned round that face the other way than the first of their part.

    Each facet stands for two things, itself and itself turned round; neighbours link those that face alike.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    sides, forward = _ends(facets)
    keys, number, times = np.unique(sides.reshape(-1, sides.shape[2]), axis=0, return_inverse=True, return_counts=True)
    if (times > 2).any():
        place = nodes[keys[times > 2][0]].mean(axis=0)
        raise BadSheet(
            f"{times.max()} facets meet at {_at(place)}: a membrane has two sides; make it of several bodies"
        )
    number = number.ravel()
    order = np.argsort(number, kind="stable")
    at = np.flatnonzero(number[order][1:] == number[order][:-1])
    one, other = order[at], order[at + 1]
    unlike = (forward.ravel()[one] == forward.ravel()[other]).astype(np.int64)
    one, other = one // sides.shape[1], other // sides.shape[1]
    links = [np.concatenate([2 * one, 2 * one + 1]), np.concatenate([2 * other + unlike, 2 * other + 1 - unlike])]
    matrix = coo_array((np.ones(len(links[0])), links), (2 * len(facets), 2 * len(facets)))
    parts = connected_components(matrix, directed=False)[1].reshape(-1, 2)
    if (both := np.flatnonzero(parts[:, 0] == parts[:, 1])).size:
        raise BadSheet(f"the surface with a facet at {_at(nodes[facets[both[0]]].mean(axis=0))} has one side only")
    _, first, part = np.unique(parts.min(axis=1), return_index=True, return_inverse=True)
    turned = parts[:, 0] != parts[first, 0][part.ravel()]
    return np.where(turned[:, None], facets[:, ::-1], facets)


def _offsets(nodes: Array, facets: Indices, thickness: float) -> Array:
    """d at each node."""
    x = nodes[facets]
    after, before = np.roll(x, -1, axis=1) - x, np.roll(x, 1, axis=1) - x
    if facets.shape[1] == 2:
        along = x[:, 1] - x[:, 0]
        normals = np.repeat(np.column_stack([-along[:, 1], along[:, 0]])[:, None], 2, axis=1)
        weights = np.ones(facets.shape)
    else:
        normals = np.cross(after, before)
        weights = np.arctan2(np.linalg.norm(normals, axis=2), np.einsum("nci,nci->nc", after, before))
    lengths = np.linalg.norm(normals, axis=2)
    if (flat := np.flatnonzero(~(lengths > 0.0).all(axis=1))).size:
        raise BadSheet(f"the facet at {_at(x[flat[0]].mean(axis=0))} has no normal: its corners are on a line")
    normals = normals / lengths[..., None]
    M, b = np.zeros((len(nodes), x.shape[2], x.shape[2])), np.zeros_like(nodes)
    np.add.at(M, facets, weights[..., None, None] * normals[..., :, None] * normals[..., None, :])
    np.add.at(b, facets, weights[..., None] * normals)
    return thickness * np.einsum("nij,nj->ni", np.linalg.pinv(M, rcond=ONE_PLANE, hermitian=True), b)


def _cells(below: Indices, above: int) -> Indices:
    """Cells on facets; above: what the number of a node above is larger by.

    The three tetrahedra of a prism share their diagonals with those beside it: all go up from the lower number.
    """
    if below.shape[1] == 2:
        return np.column_stack([below, below[:, ::-1] + above])
    if below.shape[1] == 4:
        return np.column_stack([below, below + above])
    order = np.argsort(below, axis=1)
    a, even = np.take_along_axis(below, order, axis=1), (order[:, 1] - order[:, 0]) % 3 == 1
    rises = [np.column_stack([a[:, :rise], a[:, rise - 1 :] + above]) for rise in (1, 2, 3)]
    # on a facet whose corners are in order, the middle one is inside out
    found = [np.where((even == (rise != 1))[:, None], one, one[:, [0, 2, 1, 3]]) for rise, one in enumerate(rises)]
    return np.stack(found, axis=1).reshape(-1, 4)


def _require_room(mesh: Mesh, middles: Array) -> None:
    """No cell is folded by those beside it; middles: of the facets, whose cells follow each other layer by layer."""
    wrong = inverted(mesh)
    if len(wrong):
        per_facet = 3 if mesh.cell_type == "tetra" else 1
        at = _at(middles[wrong[0] // per_facet % len(middles)])
        raise BadSheet(
            f"layers of this thickness fold at {at}, where the surface bends within half of it: take a smaller "
            "'thickness', or larger facets there"
        )


def _surfaces(mesh: Mesh, count: int, layers: int, rims: Mapping[str, Indices]) -> dict[str, Indices]:
    facets = boundary_facets(mesh)
    level, node = facets // count, facets % count
    on_top, on_bottom = (level == layers).all(axis=1), (level == 0).all(axis=1)
    beside = ~(on_top | on_bottom)
    found = {"top": facets[on_top], "bottom": facets[on_bottom], "edge": facets[beside]}
    ends = _pairs(node[beside], count)
    for name, of in rims.items():
        found[name] = found["edge"][np.isin(ends, _pairs(of, count))]
    return {name: of for name, of in found.items() if len(of)}


def _pairs(nodes: Indices, count: int) -> Indices:
    """A number for the lowest and the highest of the nodes in each row."""
    return nodes.min(axis=1, initial=count) * (count + 1) + nodes.max(axis=1, initial=-1)


def _second_order(mesh: Mesh, name: str) -> Mesh:
    """The same cells with nodes in the middle of edges, faces and cells."""
    kind = CELL_TYPES[name]
    width = kind.corners
    keys = np.full((len(mesh.cells), len(kind.nodes), width), -1)
    positions = np.empty((len(mesh.cells), len(kind.nodes), mesh.points.shape[1]))
    for at, group in enumerate(kind.nodes):
        of = mesh.cells[:, list(group)]
        keys[:, at, : len(group)] = np.sort(of, axis=1)
        positions[:, at] = mesh.points[of].mean(axis=1)
    _, first, cells = np.unique(keys.reshape(-1, width), axis=0, return_index=True, return_inverse=True)
    cells = cells.reshape(keys.shape[:2])
    points = positions.reshape(-1, mesh.points.shape[1])[first]
    number = np.empty(len(mesh.points), dtype=np.int64)
    number[mesh.cells] = cells[:, : mesh.cells.shape[1]]
    surfaces = {key: number[of] for key, of in mesh.surfaces.items()}
    return replace(mesh, points=points, cells=cells, cell_type=name, surfaces=surfaces)


def _at(x: Array) -> str:
    return f"({', '.join(f'{one:.6g}' for one in x)})"
