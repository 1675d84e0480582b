"""Films between walls that are closer than a cell: the factor by which stabilisation is reduced in their cells.

The penalty on the distance to the extension is multiplied by eps min(1, (g/h)^3 / (12 gamma)), in a film of height g
and a cell of size h, so that its contribution relative to the flux and the resistance of the film is below eps. PSPG
and grad-div terms are left out (docs/theory_fluid.md, Films).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from scipy import ndimage
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from solvers.api import Array
from solvers.fluid.cut.extension import FREE_SHARE
from solvers.fluid.grid.box import FLUSH, Grid
from solvers.fluid.mesh.distributed_grid import DistributedGrid

#: eps, the largest relative contribution of the penalty to a film. Drags are the same to 1.6 % from 3e-3 to 1e-6.
SHARE_OF_FILM = 3e-3
#: g / h below which the factor is constant. Nodes with little fluid have rounding errors of 1e-9 of the velocity,
#: divided by the factor. Drags of films from 0.05 cells on are the same to 1.3 % from 0.1 to 1e-4.
LEAST_RATIO = 0.1
#: Sine of 22.26 degrees. Components of normals below it count as zero: so normals are grouped by about the nearest of
#: eight directions in the plane. With half of 45 degrees facets of a disc of 24 would lie between two groups, and
#: rounding would choose. This angle over pi, [0; 8, 10, 1, 1, ...], is far from all simple fractions.
OCTANT = np.sin(np.pi / (8.0 + 1.0 / (10.0 + 0.5 * (1.0 + np.sqrt(5.0)))))
#: Product of the unit normals below which two walls are opposite: the angle between them is at most 60 degrees.
OPPOSITE = -0.5
#: Share of the section of its cell, normal to n, that a wall of a film has, there or in a cell beside. A notch, as
#: between the facets of a disc and the end of a flag in it, is no film: without the penalty its few drops of fluid
#: would determine the nodes of the whole cell. FSI1 does not converge with 1e-2 and a disc of 100 facets, whose notch
#: is 3 % of a cell. From 1e-4 to 0.3 drags of films are the same to 2e-4.
LEAST_WALL = 0.1


@dataclass(frozen=True)
class Walls:
    """Plane pieces of surface, sorted by cell."""

    cell: NDArray[np.int64]  #: number in the box
    x: Array  #: middle [m], shape (n, dim)
    n: Array  #: unit normal out of the fluid, shape (n, dim)
    area: Array  #: [m^(dim-1)], shape (n,)

    def __getitem__(self, some: NDArray[np.bool_]) -> Walls:
        return Walls(self.cell[some], self.x[some], self.n[some], self.area[some])


@dataclass(frozen=True)
class Films:
    """Faces of the box that are walls, and the penalty factor; `factor` reduces it in films."""

    faces: Sequence[tuple[int, int]]  #: axis and side (0, 1)
    penalty: float  #: gamma
    periodic: tuple[int, ...] = ()  #: axes of the box

    def factor(self, grid: Grid, walls: Walls, solid: NDArray[np.bool_]) -> Array | None:
        """Factor of the penalty in each cell of the box; 1 outside of films. None if there is no film."""
        wide = wide_walls(grid, walls)
        gap, near, sizes = self._gaps(grid, walls[wide])
        if not near.any():
            return None
        ends = ~wide & self._around(grid, walls.cell[wide][near])[walls.cell]
        walls = walls[wide | ends]
        if ends.any():
            gap, near, sizes = self._gaps(grid, walls)
        ratio = np.maximum(gap[near] / sizes[near].max(axis=1), LEAST_RATIO)
        factor = np.ones(grid.size)
        np.minimum.at(factor, walls.cell[near], SHARE_OF_FILM * np.minimum(1.0, ratio**3 / (12.0 * self.penalty)))
        return with_solid(grid, factor, solid, self.periodic)

    def _gaps(self, grid: Grid, walls: Walls) -> tuple[Array, NDArray[np.bool_], Array]:
        """(height of the fluid in front of walls [m], whether that is a film, sizes of their cells [m], (n, dim))."""
        sizes, across = sizes_of(grid, walls)
        gap = np.minimum(to_faces(grid, walls, self.faces), to_walls(grid, walls, across, periodic=self.periodic))
        return gap, gap < (1.0 - FLUSH) * across, sizes  # a gap of one cell is no film, whatever the rounding

    def _around(self, grid: Grid, cells: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Mask of all cells of the box: those of films between wide walls, and those around, where films go on."""
        mask = np.zeros(grid.size, dtype=bool)
        mask[cells] = True
        found: NDArray[np.bool_] = ndimage.maximum_filter(
            grid.as_box(mask), 3, mode=at_ends(grid, self.periodic)
        ).ravel(order="F")
        return found


def with_solid(grid: Grid, factor: Array, solid: NDArray[np.bool_], periodic: tuple[int, ...] = ()) -> Array:
    """Factors of cells of the box; solid cells around those of a film get its factor: they share nodes with it."""
    around: Array = ndimage.minimum_filter(grid.as_box(factor), 3, mode=at_ends(grid, periodic)).ravel(order="F")
    return np.where(solid, around, factor)


def sizes_of(grid: Grid, walls: Walls) -> tuple[Array, Array]:
    """Edge lengths of the cells of walls, shape (n, dim), and their lengths along the normals, (n,) [m]."""
    index = np.unravel_index(walls.cell, grid.shape, order="F")
    sizes = np.stack([np.diff(edge)[i] for edge, i in zip(grid.edges, index, strict=True)], axis=1)
    return sizes, 1.0 / np.linalg.norm(walls.n / sizes, axis=1)


def wide_walls(grid: Grid, walls: Walls) -> NDArray[np.bool_]:
    """Whether walls are LEAST_WALL of their cells or more."""
    sizes, across = sizes_of(grid, walls)
    wide: NDArray[np.bool_] = walls.area >= LEAST_WALL * sizes.prod(axis=1) / across
    return wide


def to_faces(grid: Grid, walls: Walls, faces: Sequence[tuple[int, int]]) -> Array:
    """Distance [m] through the fluid to faces of the box (axis and side), along the normal."""
    gap = np.full(len(walls.cell), np.inf)
    for axis, side in faces:
        slope = walls.n[:, axis] if side == 0 else -walls.n[:, axis]
        height = np.abs(walls.x[:, axis] - grid.edges[axis][-side])
        facing = slope > -OPPOSITE
        gap[facing] = np.minimum(gap[facing], height[facing] / slope[facing])
    return gap


def walls_of(cell: NDArray[np.int64], corners: NDArray[np.int64], x: Array, lengths: Array, normal: Array) -> Walls:
    """Merge connected pieces of one cell with similar normals, in 2D within one of eight directions, into planes.

    corners: vertices of the pieces' facets, shape (pieces, dim), with positions x [m]; lengths: int lambda_v ds over
    each piece [m^(dim-1)], of the same shape; normal: unit normals out of the fluid.
    """
    count, dim = corners.shape
    # a vertex has one number per cell: pieces in different cells are not connected
    corner = np.unique(cell[:, None] * len(x) + corners, return_inverse=True)[1].ravel()
    links = coo_array((np.ones(corner.size), (np.repeat(np.arange(count), dim), count + corner)), [2 * corner.size] * 2)
    part = connected_components(links, directed=False)[1][:count]
    facing = (np.where(np.abs(normal) > OCTANT, np.sign(normal), 0.0) + 1.0) @ 3.0 ** np.arange(dim)
    _, first, group = np.unique(3**dim * part + facing.astype(np.int64), return_index=True, return_inverse=True)
    area = lengths.sum(axis=1)

    def total(values: Array) -> Array:
        return np.stack([np.bincount(group, column) for column in values.T], axis=1)

    n, middle = total(area[:, None] * normal), total(np.einsum("pv,pvi->pi", lengths, x[corners]))
    areas = total(area[:, None])
    middle, n = middle / areas, n / np.linalg.norm(n, axis=1, keepdims=True)
    order = np.argsort(cell[first], kind="stable")
    return Walls(cell[first][order], middle[order], n[order], areas[order, 0])


def at_ends(grid: Grid, periodic: tuple[int, ...]) -> list[str]:
    """What filters of SciPy over the cells of the box do at its ends, by axis."""
    return ["wrap" if axis in periodic else "reflect" for axis in range(grid.dim)]


def to_walls(grid: Grid, walls: Walls, reach: Array, layers: int = 1, periodic: tuple[int, ...] = ()) -> Array:
    """Distance [m] through the fluid, along the normal, to the closest opposite wall in so many layers of cells around.

    Infinite where there is none within `reach` [m]. Surfaces at negative distance do not count: they are on the other
    side of the body.
    """
    index = np.stack(np.unravel_index(walls.cell, grid.shape, order="F"), axis=1)
    periods = [n if axis in periodic else 0 for axis, n in enumerate(grid.shape)]
    a, b = cKDTree(index, boxsize=periods).query_pairs(layers, p=np.inf, output_type="ndarray").T
    opposing = np.einsum("ai,ai->a", walls.n[a], walls.n[b])
    a, b, opposing = (v[opposing < OPPOSITE] for v in (a, b, opposing))
    a, b, opposing = np.concatenate([a, b]), np.concatenate([b, a]), np.tile(opposing, 2)
    away = walls.x[a] - walls.x[b]
    for axis in periodic:
        length = grid.edges[axis][-1] - grid.edges[axis][0]
        away[:, axis] -= length * np.round(away[:, axis] / length)
    distance = np.einsum("ai,ai->a", away, walls.n[b]) / opposing
    aside = away - distance[:, None] * walls.n[a]
    far = distance**2 + (aside**2).sum(axis=1)
    some = np.flatnonzero((distance > 0.0) & (distance < reach[a]))
    # of several that are equally close, the one in the first cell in the order of the lattice's axes
    some = some[np.lexsort((b[some], *index[b[some]].T[::-1], far[some], a[some]))]
    first = np.unique(a[some], return_index=True)[1]
    gap = np.full(len(walls.cell), np.inf)
    gap[a[some[first]]] = distance[some[first]]
    return gap


def creeping_cells(
    grid: Grid, factor: Array, solid: NDArray[np.bool_], share: Array, periodic: tuple[int, ...] = ()
) -> NDArray[np.bool_]:
    """Cells of the box with creeping flow: those of films, and poorly cut ones at their ends.

    The latter share nodes behind the surface with the solid cells of films, hence the film's velocity continued. Its
    convection is as inexact as in the film, and steps had no solution with it.
    factor: of `Films`; solid: solid cells; share: of fluid; all by cells of the box.
    """
    of_films = grid.as_box(solid & (factor < 1.0))
    beside = ndimage.maximum_filter(of_films, 3, mode=at_ends(grid, periodic)).ravel(order="F")
    return (factor < 1.0) | (beside & (share < FREE_SHARE[grid.dim]))


def film_cells(
    grid: DistributedGrid, cells: NDArray[np.int32], creeping: NDArray[np.bool_] | None
) -> NDArray[np.int32] | None:
    """Owned cells among some local ones with creeping flow; None if no process has any (collective)."""
    if not grid.comm.allreduce(creeping is not None, op=MPI.LOR):
        return None
    owned = cells[cells < grid.owned]
    return owned[:0] if creeping is None else owned[creeping[grid.numbers[owned]]]


def coercive(films: NDArray[np.bool_], cell: NDArray[np.int64], volume: Array, area: Array) -> Array:
    """Least Nitsche penalty over the viscosity [1/m], 4 |Gamma_K| / |K in fluid| in films, by pieces.

    From there on Nitsche's method is coercive in a film (docs/theory_fluid.md, Films). Below, the flow's matrix gets
    negative eigenvalues in cells with slivers, and Newton's method meets iterates where it is singular.
    films: pieces in cells with creeping flow; cell: number of their cells; volume: of fluid in the cell [m^dim];
    area: of each piece [m^(dim-1)].
    Source: Dolbow, Harari, Int. J. Numer. Meth. Engng 78 (2009) 229-252.
    """
    surface = np.bincount(cell, area)[cell]
    return np.where(films, 4.0 * surface / np.where(films, volume, 1.0), 0.0)
