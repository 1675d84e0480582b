"""Structured lattices of nodes: lines, discs, spheres, their products, and the cells picked from them.

Nodes are identified by integers, not by distance, so that seams are joined exactly for any coordinates.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from solvers.mesh.cell_types import CELL_TYPES, reference_nodes
from solvers.mesh.mesh import Mesh
from solvers.mesh.topology import boundary_facets

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

#: Directions -> name of a cell -> its types of first and second order.
LATTICE_CELLS = {
    2: {"quad": ("quad", "quad9"), "tri": ("triangle", "triangle6")},
    3: {"hex": ("hexahedron", "hexahedron27"), "tet": ("tetra", "tetra10")},
}


@dataclass(frozen=True)
class NodeBlocks:
    """NodeBlocks of nodes; a cell takes `order` intervals of its block in every direction."""

    points: Array  #: node positions or parameters, shape (n, any)
    blocks: tuple[Indices, ...]  #: node numbers, each of shape (order * cells + 1, ...) with one axis per direction
    sides: dict[str, Indices]  #: name of a part of the boundary -> its nodes
    order: int  #: 1 or 2

    def mapped(self, function: Callable[..., Sequence[Array]]) -> NodeBlocks:
        """The same blocks with their points moved: `function(x, y, ...)` gives the new coordinates."""
        return replace(self, points=np.column_stack(function(*self.points.T)))


@dataclass(frozen=True)
class Lattice:
    """Counts and sides of blocks of nodes that are made when they are needed."""

    cells: int
    nodes: int
    directions: int
    sides: tuple[str, ...]  #: names
    order: int  #: 1 or 2
    make: Callable[[], NodeBlocks]

    def mapped(self, function: Callable[..., Sequence[Array]]) -> Lattice:
        """The same lattice with its points moved: `function(x, y, ...)` gives the new coordinates."""
        return replace(self, make=lambda: self.make().mapped(function))


def line(cells: int, order: int, sides: tuple[str, str] | None = None) -> Lattice:
    """Parameter 0 to 1 in equal steps; without sides it is closed, of three cells at least: its end is its start."""
    steps = order * cells

    def make() -> NodeBlocks:
        parameter = np.arange(steps + 1) / steps
        if sides is None:
            return NodeBlocks(parameter[:-1, None], (np.arange(steps + 1) % steps,), {}, order)
        ends = {sides[0]: np.array([0]), sides[1]: np.array([steps])}
        return NodeBlocks(parameter[:, None], (np.arange(steps + 1),), ends, order)

    return Lattice(cells, steps + (sides is not None), 1, sides or (), order, make)


def product(first: Lattice, second: Lattice) -> Lattice:
    """Every node of the first with every node of the second: coordinates, directions and sides of both."""
    return Lattice(
        first.cells * second.cells,
        first.nodes * second.nodes,
        first.directions + second.directions,
        first.sides + second.sides,
        first.order,
        lambda: _product(first.make(), second.make()),
    )


def _product(first: NodeBlocks, second: NodeBlocks) -> NodeBlocks:
    size, along = len(second.points), np.arange(len(second.points))
    points = np.hstack([np.repeat(first.points, size, axis=0), np.tile(second.points, (len(first.points), 1))])
    blocks = tuple(np.add.outer(a * size, b) for a in first.blocks for b in second.blocks)
    across = np.arange(len(first.points)) * size
    sides = {name: np.add.outer(nodes * size, along).ravel() for name, nodes in first.sides.items()}
    sides |= {name: np.add.outer(across, nodes).ravel() for name, nodes in second.sides.items()}
    return NodeBlocks(points, blocks, sides, first.order)


def disc(around: int, radial: int, order: int) -> Lattice:
    """Unit disc: a square core with bulged sides inside a shell of `radial` layers; side `outer`.

    `around` counts the cells on the circle, a multiple of 4: each side of the core has a quarter of them.
    """
    quarter = around // 4
    cells, nodes = quarter**2 + around * radial, (order * quarter + 1) ** 2 + order * around * order * radial
    return Lattice(cells, nodes, 2, ("outer",), order, lambda: _disc(around, radial, order))


def _disc(around: int, radial: int, order: int) -> NodeBlocks:
    quarter = around // 4
    edge, turn, layers = order * quarter, order * around, order * radial

    # cells of core and shell of about the same size
    half = np.clip(quarter / (2 * radial + 1.25 * quarter), 0.3, 0.5)
    u, v = np.meshgrid(np.linspace(-1, 1, edge + 1), np.linspace(-1, 1, edge + 1), indexing="ij")
    # three cells meet at a corner of the core: the bulge opens its angle from 90 degrees to nearly 120
    bulge = 0.12
    square = np.stack([u * (1 + bulge * (1 - v**2)), v * (1 + bulge * (1 - u**2))], axis=-1)
    square = half * square.reshape(-1, 2)

    core = np.arange((edge + 1) ** 2).reshape(edge + 1, edge + 1)
    rim = np.concatenate([core[-1, :-1], core[:0:-1, -1], core[0, :0:-1], core[:-1, 0]])
    angle = 2 * np.pi * (np.arange(turn) / turn - 1 / 8)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    part = (np.arange(1, layers + 1) / layers)[:, None, None]
    shell_points = (1 - part) * square[rim] + part * circle

    shell = np.vstack([rim, core.size + np.arange(layers * turn).reshape(layers, turn)])
    shell = np.column_stack([shell, shell[:, 0]])
    points = np.vstack([square, shell_points.reshape(-1, 2)])
    return NodeBlocks(points, (core, shell), {"outer": shell[-1, :-1]}, order)


def sphere(cells: int, order: int) -> Lattice:
    """Unit sphere: the six faces of a cube, `cells` per edge, at equal angles (equiangular gnomonic)."""
    return Lattice(6 * cells**2, 6 * (order * cells) ** 2 + 2, 2, (), order, lambda: _sphere(cells, order))


def _sphere(cells: int, order: int) -> NodeBlocks:
    steps = order * cells
    cube = np.arange((steps + 1) ** 3).reshape(3 * (steps + 1,))
    faces = [cube[0].T, cube[-1], cube[:, 0], cube[:, -1].T, cube[:, :, 0].T, cube[:, :, -1]]
    used = np.unique(np.stack(faces))
    index = np.column_stack(np.unravel_index(used, cube.shape))
    points = np.tan(np.pi / 4 * (2 * index / steps - 1))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    return NodeBlocks(points, tuple(np.searchsorted(used, face) for face in faces), {}, order)


def ball(cells: int, radial: int, order: int) -> Lattice:
    """Unit ball: a cubic core with bulged sides, `cells` per edge, inside a shell of `radial` layers; side `outer`."""
    faces, edge = 6 * cells**2, order * cells
    nodes = (edge + 1) ** 3 + (6 * edge**2 + 2) * order * radial
    return Lattice(cells**3 + faces * radial, nodes, 3, ("outer",), order, lambda: _ball(cells, radial, order))


def _ball(cells: int, radial: int, order: int) -> NodeBlocks:
    edge, layers = order * cells, order * radial
    cube = np.arange((edge + 1) ** 3).reshape(3 * (edge + 1,))
    faces = _sphere(cells, order)
    rim = np.flatnonzero((np.stack(np.unravel_index(cube.ravel(), cube.shape)) % edge == 0).any(axis=0))
    inner = np.column_stack(np.unravel_index(cube.ravel(), cube.shape)) * 2 / edge - 1

    # cells of core and shell of about the same size; the bulge opens the angles at edges of the core
    half = np.clip(cells / (2 * radial + 1.25 * cells), 0.3, 0.5)
    bulge = 0.4
    direction = np.tan(np.pi / 4 * inner)
    length = np.linalg.norm(direction, axis=1, keepdims=True)
    direction = np.divide(direction, length, out=np.zeros_like(direction), where=length > 0)
    core = half * ((1 - bulge) * inner + bulge * np.abs(inner).max(axis=1, keepdims=True) * direction)
    part = (np.arange(1, layers + 1) / layers)[:, None, None]
    shell = (1 - part) * core[rim] + part * faces.points

    number = np.vstack([rim, cube.size + np.arange(layers * len(rim)).reshape(layers, -1)])
    blocks = tuple(np.moveaxis(number[:, face], 0, -1) for face in faces.blocks)
    points = np.vstack([core, shell.reshape(-1, 3)])
    return NodeBlocks(points, (cube, *blocks), {"outer": number[-1]}, order)


def mesh(lattice: NodeBlocks, cell: str) -> Mesh:
    """The mesh of a lattice of 2 directions (cell quad or tri) or 3 (hex or tet), its sides as surfaces."""
    directions = lattice.blocks[0].ndim
    if cell not in LATTICE_CELLS[directions]:
        raise ValueError(f"unknown cell '{cell}'; there are: {', '.join(LATTICE_CELLS[directions])}")
    cell_type = LATTICE_CELLS[directions][cell][lattice.order - 1]
    window = (lattice.order + 1,) * directions
    every = (slice(None, None, lattice.order),) * directions
    windows = [np.lib.stride_tricks.sliding_window_view(block, window)[every] for block in lattice.blocks]
    nodes = np.concatenate([part.reshape(-1, *window) for part in windows])
    if cell in ("quad", "hex"):
        position = np.rint(lattice.order * reference_nodes(cell_type)).astype(int)
        cells = nodes[(slice(None), *position.T)]
    else:
        cells = _simplices(nodes, cell_type, lattice.order)
    plain = Mesh(np.ascontiguousarray(lattice.points), np.ascontiguousarray(cells), cell_type)
    facets = boundary_facets(plain)[:, : CELL_TYPES[CELL_TYPES[cell_type].facet].corners]
    surfaces = {name: facets[np.isin(facets, side).all(axis=1)] for name, side in lattice.sides.items()}
    return replace(plain, surfaces=surfaces)


def _simplices(nodes: Indices, cell_type: str, order: int) -> Indices:
    """Two triangles for each quad; six tetrahedra for each hexahedron, three in the prism on each triangle.

    The diagonals of the prisms' sides go from the lower node number at the bottom to the higher one at the
    top, so that neighbours agree on them however their blocks are turned.
    """
    count, directions = len(nodes), nodes.ndim - 1
    triangles = np.array([[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]])
    corners = np.repeat(triangles[None], count, axis=0)  # (cells, 2, 3, 2)
    if directions == 3:
        cell = np.arange(count)[:, None, None]
        number = nodes[cell, order * corners[..., 0], order * corners[..., 1], 0]
        corners = np.take_along_axis(corners, np.argsort(number, axis=2)[..., None], axis=2)
        bottom = np.concatenate([corners, np.zeros_like(corners[..., :1])], axis=-1)
        top = bottom + np.array([0, 0, 1])
        # the path from bottom to top rises after 1, 2 or 3 corners of the triangle
        rises = [np.concatenate([bottom[:, :, :rise], top[:, :, rise - 1 :]], axis=2) for rise in (1, 2, 3)]
        corners = np.stack(rises, axis=2)
    corners = corners.reshape(count, -1, directions + 1, directions)
    inside_out = np.linalg.det(corners[:, :, 1:] - corners[:, :, :1]) < 0
    corners[inside_out] = corners[inside_out][:, [0, 2, 1, *range(3, directions + 1)]]

    # the sum of two corners (0 or 1) is their midpoint in half cells
    groups = [(group[0], group[-1]) for group in CELL_TYPES[cell_type].nodes]
    position = np.stack([corners[:, :, a] + corners[:, :, b] for a, b in groups], axis=2) * order // 2
    cell = np.arange(count)[:, None, None]
    return nodes[(cell, *np.moveaxis(position, -1, 0))].reshape(-1, len(groups))
