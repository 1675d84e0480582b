"""Uniform refinement of a mesh: edges are halved, so that each cell becomes four of its type, in 3D eight.

The new cells fill the old one in its unit cell, and its shape functions say where their nodes are. So the surface stays
what it was: of straight facets a polygon, of facets of second order their parabolas.
"""

from __future__ import annotations

from functools import cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

from solvers.mesh.cell_types import CELL_TYPES, CellType
from solvers.mesh.mesh import Mesh

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

#: Coordinates of new nodes by corners are multiples of 1/PARTS_OF_UNIT: products of quarters along three directions.
PARTS_OF_UNIT = 64
#: Of diagonals whose lengths differ by rounding the first one is taken.
SAME_LENGTH = 1e-9
#: Pairs of opposite edges of a tetrahedron. Their middles are the ends of the diagonals of the octahedron inside.
OPPOSITE_EDGES = (((0, 1), (2, 3)), ((0, 2), (1, 3)), ((0, 3), (1, 2)))


def refined(mesh: Mesh) -> Mesh:
    """The mesh with edges halved; surfaces, regions, lines and named nodes are where they were."""
    kind = CELL_TYPES[mesh.cell_type]
    facet = CELL_TYPES[CELL_TYPES[kind.facet].first_order]
    asked = [(mesh.cells[:, : kind.corners], kind)]
    asked += [(corners, facet) for corners in mesh.surfaces.values()]
    asked += [(nodes[:, :2], CELL_TYPES["line" if nodes.shape[1] == 2 else "line3"]) for nodes in mesh.lines.values()]
    nodes, *others = _numbered([_keys(corners, one, kind.corners) for corners, one in asked])

    local, tables = _division(kind)
    points = np.empty((nodes.max() + 1, local.shape[1]))
    points[nodes] = _functions(kind, local) @ mesh.points[mesh.cells]
    own = np.empty(len(mesh.points), dtype=np.int64)  # new numbers of old nodes
    own[mesh.cells] = nodes[:, _positions_of(kind.reference_nodes, local)]

    children = np.stack([nodes[:, table] for table in tables])[_shortest(mesh, kind), np.arange(len(nodes))]
    parts = [_divided(numbers, one) for numbers, (_, one) in zip(others, asked[1:], strict=True)]
    count = children.shape[1]
    number = np.arange(1, len(nodes) + 1) if mesh.numbers is None else mesh.numbers
    return Mesh(
        points,
        children.reshape(-1, mesh.cells.shape[1]),
        mesh.cell_type,
        surfaces=dict(zip(mesh.surfaces, parts, strict=False)),
        regions={name: (those[:, None] * count + np.arange(count)).ravel() for name, those in mesh.regions.items()},
        lines=_edges(dict(zip(mesh.lines, parts[len(mesh.surfaces) :], strict=True))),
        nodes={name: own[those] for name, those in mesh.nodes.items()},
        numbers=np.repeat(number, count),
        note=mesh.note,
        cones=mesh.cones,
    )


def _keys(corners: Indices, kind: CellType, width: int) -> Indices:
    """Which node each point of the division of each cell is, shape (cells, points, width).

    A node is known by the corners that it depends on and by its coordinates with respect to them: those of an edge are
    the same in all cells around it.
    """
    local, _ = _division(kind)
    weights = np.rint(PARTS_OF_UNIT * _functions(CELL_TYPES[kind.first_order], local)).astype(np.int64)
    keys = np.full((len(corners), len(local), width), -1)
    keys[..., : kind.corners] = np.where(weights > 0, corners[:, None] * (PARTS_OF_UNIT + 1) + weights, -1)
    return np.sort(keys, axis=2)


def _numbered(keys: list[Indices]) -> list[Indices]:
    """A number for each node, from 0 on for those of the first keys, which are of cells; -1 for what no cell has."""
    rows = np.concatenate([one.reshape(-1, one.shape[2]) for one in keys])
    _, first, same = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    inside = first < keys[0].shape[0] * keys[0].shape[1]
    numbers = np.where(inside, np.cumsum(inside) - 1, -1)[same.ravel()]
    ends = np.cumsum([one.shape[0] * one.shape[1] for one in keys])[:-1]
    return [part.reshape(one.shape[:2]) for part, one in zip(np.split(numbers, ends), keys, strict=True)]


def _divided(nodes: Indices, kind: CellType) -> Indices:
    """The parts of facets or lines; `nodes` are those of their divisions."""
    [table] = _division(kind)[1]
    return nodes[:, table].reshape(-1, table.shape[1])


def _edges(lines: dict[str, Indices]) -> dict[str, Indices]:
    """Lines that are edges of cells: one between two corners need not be, and its middle is no node then."""
    inside = {name: nodes[(nodes >= 0).all(axis=1)] for name, nodes in lines.items()}
    return {name: nodes for name, nodes in inside.items() if len(nodes)}


@cache
def _division(kind: CellType) -> tuple[Array, tuple[Indices, ...]]:
    """(positions of all nodes of the parts in the unit cell, tables of the nodes of each part).

    Of tetrahedra there are three tables, one for each diagonal; of others there is one.
    """
    corners = np.array(kind.shape.corners, dtype=float)
    at_corners = [(corners + corner) / 2.0 for corner in corners]
    inner: list[list[Array]] = [[]]
    if kind.shape.name == "triangle":
        inner = [[corners[[0, 1, 2]] / 2.0 + corners[[1, 2, 0]] / 2.0]]
    elif kind.shape.name == "tetrahedron":
        inner = [_around_diagonal(corners, number) for number in range(3)]
    parts = [np.array([_nodes_of(part, kind) for part in (*at_corners, *rest)]) for rest in inner]
    local = np.unique(np.concatenate([part.reshape(-1, part.shape[2]) for part in parts]), axis=0)
    return local, tuple(_positions_of(part, local) for part in parts)


def _around_diagonal(corners: Array, number: int) -> list[Array]:
    """The four tetrahedra around one of the diagonals of the octahedron between the middles of edges."""
    middles = [[corners[list(edge)].mean(axis=0) for edge in pair] for pair in OPPOSITE_EDGES]
    (begin, end), (a, c), (b, d) = middles[number], *(pair for other, pair in enumerate(middles) if other != number)
    found = [np.array([begin, end, *side]) for side in ((a, b), (b, c), (c, d), (d, a))]
    return [one if np.linalg.det(one[1:] - one[0]) > 0.0 else one[[1, 0, 2, 3]] for one in found]


def _nodes_of(corners: Array, kind: CellType) -> Array:
    return np.array([corners[list(group)].mean(axis=0) for group in kind.nodes])


def _positions_of(points: Array, among: Array) -> Indices:
    """Numbers of points of the unit cell among others."""
    return np.asarray(np.abs(points[..., None, :] - among).sum(axis=-1).argmin(axis=-1))


def _functions(kind: CellType, points: Array) -> Array:
    """Values of the shape functions at points of the unit cell, shape (points, nodes)."""
    degree, dim = kind.degree, points.shape[1]
    powers = [
        power for power in product(range(degree + 1), repeat=dim) if not kind.shape.simplex or sum(power) <= degree
    ]

    def monomials(x: Array) -> Array:
        return np.stack([np.prod(x**power, axis=1) for power in np.array(powers)], axis=1)

    values = monomials(points) @ np.linalg.inv(monomials(kind.reference_nodes))
    return np.asarray(np.rint(512.0 * values) / 512.0)  # at quarters they are products of multiples of 1/8


def _shortest(mesh: Mesh, kind: CellType) -> Indices:
    """The table of each cell: tetrahedra are divided along their shortest diagonal."""
    if kind.shape.name != "tetrahedron":
        return np.zeros(len(mesh.cells), dtype=np.int64)
    x = mesh.points[mesh.cells[:, :4]]
    middles = [[x[:, list(edge)].mean(axis=1) for edge in pair] for pair in OPPOSITE_EDGES]
    lengths = np.stack([np.linalg.norm(one - other, axis=1) for one, other in middles])
    return np.asarray((lengths <= (1.0 + SAME_LENGTH) * lengths.min(axis=0)).argmax(axis=0))
