"""Sheets: separate cells, and hence unknowns, for the fluid on each side of a thin body (docs/theory_fluid.md).

New cells follow those of the box in the mesh. Faces between a new cell and its neighbour, which the ghost penalty
integrates over, are represented by further pairs of cells, which have no other purpose. The numbers of nodes determine
which cells share unknowns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from solvers import kernels
from solvers.algebra.connected import connected_parts
from solvers.api import Array, FailureKind, Indices, Mask, StepFailed
from solvers.fluid.geometry.bodies import closed_surfaces
from solvers.fluid.geometry.pieces import off_boundary, without_slivers
from solvers.fluid.geometry.thin.closing import are_apart, close_a_way, may_touch, uncut_cells
from solvers.fluid.geometry.thin.fluid_parts import FluidParts, grown, parts_of_fluid, ragged
from solvers.fluid.geometry.thin.sheet_nodes import Joined, same_nodes
from solvers.fluid.geometry.thin.sheet_numbers import Connections, SheetNumbers, numbered
from solvers.fluid.geometry.thin.thickness import AROUND_PAIR, THIN
from solvers.fluid.geometry.thin.thinness import OPPOSITE_NORMALS, may_be_thin, solid_of
from solvers.fluid.geometry.tied_slits import slivers_of, without_slits
from solvers.fluid.grid.box import CORNER_STEPS, Grid
from solvers.fluid.surfaces.immersed import ImmersedBody
from solvers.fluid.surfaces.surface import together
from solvers.mesh.gauss import gauss
from solvers.mesh.mesh import Mesh

#: Distance [cells], in 3D, of points in cells whose indices differ by one in each direction.
CELL_DIAGONAL = 3.0**0.5


@dataclass(frozen=True)
class FluidShare:
    """The parts of fluid in a cell of the box that one cell of the mesh has, if it does not have all."""

    parts: FluidParts
    numbers: tuple[int, ...]

    @property
    def fraction(self) -> float:
        return float(self.parts.share[list(self.numbers)].sum())

    @property
    def regions(self) -> list[int]:
        """In the table; empty if the cell has all of the fluid."""
        found = self.parts.region[list(self.numbers)].tolist()
        return [] if min(found) < 0 else found

    def integrals(self, points: Array) -> Array | None:
        """int L_q over the fluid, relative to the cell; None if the cell has all of the fluid."""
        if not self.regions:
            return None
        return np.asarray(sum(self.parts.integrals(part, points) for part in self.numbers))

    def wet(self, axis: int, side: int, points: Array) -> Array | None:
        """int L_q over the open part of a face, relative to the face; None if the cell has all of the fluid."""
        if not self.regions:
            return None
        return np.asarray(sum(self.parts.wet(part, axis, side, points) for part in self.numbers))


@dataclass(frozen=True)
class Sheets:
    """Cells that follow those of the box: first those with fluid, then pairs of cells with a face between them.

    In nested cells the box is the finest lattice: it has all cells near surfaces. Coarser ones are in the mesh alone.
    """

    grid: Grid
    numbering: SheetNumbers
    fluid: Array  #: share of fluid in each cell of the mesh
    bounds: Indices  #: (cell of the mesh, facet that bounds its fluid), shape (n, 2)
    touching: Indices  #: cells of the box with fluid in which bodies touch, sorted
    parts: FluidParts
    #: cells of the box in which bodies touched when the step began, sorted
    closed: Indices = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    repeated: tuple[int, ...] = ()  #: periodic axes: nodes at their ends are those at their beginnings

    @property
    def left(self) -> Indices:
        """Cells of the box whose fluid belongs to new cells only, sorted."""
        return self.numbering.left

    @property
    def parted(self) -> Indices:
        """Neighbours in the box with no fluid on their common face, low * (cells of the box) + high, sorted."""
        return self.numbering.parted

    @property
    def cells(self) -> Indices:
        """Number in the box of each new cell."""
        return self.numbering.cells

    @property
    def pairs(self) -> int:
        """How many pairs there are."""
        return self.numbering.pairs

    @property
    def copies(self) -> Indices:
        """Number of the copy that each node of a new cell is, in the lattice of second degree; 0: that of the box."""
        return self.numbering.copies

    @property
    def around(self) -> Mask:
        """Cells of the box near surfaces, where only `links` are neighbours."""
        return self.numbering.around

    @property
    def links(self) -> Indices:
        """Cells of the mesh with fluid on both sides of the face between them, shape (n, 2)."""
        return self.numbering.links

    def same_unknowns(self, other: Sheets) -> bool:
        """The mesh and what is linked in it are the same, wherever the surface is in the cells."""
        return self.numbering.equal(other.numbering)

    @cached_property
    def shares(self) -> dict[int, FluidShare]:
        """Of cells of the mesh that have a share of the fluid, by their numbers in it."""
        found: dict[int, list[int]] = {}
        for part, cell in zip(*(some.tolist() for some in self.of_shares), strict=True):
            found.setdefault(cell, []).append(part)
        return {cell: FluidShare(self.parts, tuple(parts)) for cell, parts in found.items()}

    @cached_property
    def of_shares(self) -> tuple[Indices, Indices]:
        """(part, cell of the mesh that has it) in cells of the box whose fluid is not all in one cell of the mesh."""
        part = self.numbering.sharing
        cell = self.numbering.cell_of_part[part]
        return part[cell >= 0], cell[cell >= 0]

    @property
    def singles(self) -> int:
        """New cells with fluid."""
        return len(self.cells) - 2 * self.pairs

    @property
    def size(self) -> int:
        """Cells of the mesh."""
        return self.grid.size + len(self.cells)

    @cached_property
    def successors(self) -> dict[int, list[int]]:
        """Cells of the mesh that have the fluid of a cell of the box, for those that share or lose it."""
        found: dict[int, list[int]] = {cell: [] for cell in self.left.tolist()}
        have = np.unique(self.of_shares[1])
        for cell, place in zip(have.tolist(), self.box_cells(have).tolist(), strict=True):
            found.setdefault(place, []).append(cell)
        return found

    @cached_property
    def facets_of_parts(self) -> dict[int, list[set[int]]]:
        """For each cell of the box, the facets of each cell of the mesh in its place."""
        of_cell: dict[int, set[int]] = {}
        for cell, facet in self.bounds.tolist():
            of_cell.setdefault(cell, set()).add(facet)
        found: dict[int, list[set[int]]] = {}
        for cell, facets in of_cell.items():
            found.setdefault(int(self.box_cells(np.array([cell]))[0]), []).append(facets)
        return found

    def cell_at(self, cell: int, x: Array) -> int:
        """Cell of the mesh that has the fluid at x, given in the reference coordinates of a cell of the box."""
        there = self.successors.get(cell) or [cell]
        if len(there) == 1:
            return there[0]
        region = self.parts.region_at(cell, x)
        return next((c for c in there if region in self.shares[c].regions), there[0])

    def mesh(self, grid: Grid) -> Mesh:
        """Mesh of a grid on the lattice of the box and of the new cells.

        These are not connected to others, except pairs to each other.
        """
        box, dim = grid.mesh(), self.grid.dim
        index = np.stack(np.unravel_index(self.cells, self.grid.shape, order="F"), axis=1)
        points, cells, count = [box.points], [box.cells], len(box.points)
        for units in (index[: self.singles, None], index[self.singles :].reshape(-1, 2, dim)):
            if len(units):
                corners, numbers = _corners_of(units)
                at = corners.reshape(-1, dim).T
                points.append(np.stack([edge[i] for edge, i in zip(self.grid.edges, at, strict=True)], axis=1))
                first = count + corners.shape[1] * np.arange(len(units))
                cells.append((first[:, None, None] + numbers).reshape(-1, numbers.shape[2]))
                count += len(points[-1])
        return Mesh(np.concatenate(points), np.concatenate(cells), box.cell_type)

    def box_cells(self, original: Indices) -> Indices:
        """Number in the box of each cell of the mesh; new cells have that of the cell they are a copy of."""
        return np.concatenate([np.arange(self.grid.size), self.cells])[original]

    def nodes(self, original: Indices, degree: int, steps: Indices) -> Indices:
        """Numbers of the nodes of cells of the mesh, shape (cells, nodes); copies have those after the lattice's.

        steps: from the first node of a cell to each in the lattice of this degree, shape (nodes, dim).
        """
        number, copy = (
            self._lattice(self.box_cells(original), degree, steps),
            np.zeros((len(original), len(steps)), int),
        )
        new = original >= self.grid.size
        copy[new] = self.copies[original[new] - self.grid.size][:, _in_cell(steps, degree)]
        size = self.lattice_size(degree)
        further = size + np.searchsorted(self._further(degree), copy * size + number)
        return np.where(copy > 0, further, number)

    def lattice_shape(self, degree: int) -> tuple[int, ...]:
        """Nodes of the lattice of the box per direction; along a periodic axis the last one is not counted."""
        return tuple(degree * n + (axis not in self.repeated) for axis, n in enumerate(self.grid.shape))

    def lattice_size(self, degree: int) -> int:
        """Nodes of the lattice of the box."""
        return int(np.prod(self.lattice_shape(degree)))

    def node_count(self, degree: int) -> int:
        """Count of nodes: those of the lattice and the copies."""
        return self.lattice_size(degree) + len(self._further(degree))

    def on_lattice(self, numbers: Indices, degree: int) -> Indices:
        """Number in the lattice of each node; copies have that of the node they are a copy of."""
        size = self.lattice_size(degree)
        keys = np.concatenate([self._further(degree), [0]])[np.maximum(numbers - size, -1)]
        return np.where(numbers < size, numbers, keys % size)

    def among_finer(self, numbers: Indices, degree: int) -> Indices:
        """Numbers of nodes of first degree among those of a higher degree."""
        size, finer = self.lattice_size(1), self.lattice_size(degree)
        keys = np.concatenate([self._further(1), [0]])[np.maximum(numbers - size, -1)]
        copy = np.where(numbers < size, 0, keys // size)
        index = np.unravel_index(self.on_lattice(numbers, 1), self.lattice_shape(1), order="F")
        there = np.ravel_multi_index([degree * i for i in index], self.lattice_shape(degree), order="F")
        return np.where(copy > 0, finer + np.searchsorted(self._further(degree), copy * finer + there), there)

    def _lattice(self, cells: Indices, degree: int, steps: Indices) -> Indices:
        index = np.stack(np.unravel_index(cells, self.grid.shape, order="F"), axis=1)
        counts = self.lattice_shape(degree)
        at = (degree * index[:, None, :] + steps) % np.array(counts)
        return np.ravel_multi_index(tuple(np.moveaxis(at, 2, 0)), counts, order="F")

    def _further(self, degree: int) -> Indices:
        """All copies of nodes, each as copy * size + number in the lattice."""
        steps = np.array(list(product(range(degree + 1), repeat=self.grid.dim)))
        copy = self.copies[:, _in_cell(steps, degree)]
        return np.unique((copy * self.lattice_size(degree) + self._lattice(self.cells, degree, steps))[copy > 0])


def _corners_of(units: Indices) -> tuple[Indices, Indices]:
    """Corners of units of one or two cells, shape (units, corners, dim), and the numbers of each cell's among them.

    units: indices of their cells, shape (units, cells, dim).
    """
    ways = (units - units[:, :1]).reshape(len(units), -1)
    kinds, kind = np.unique(ways, axis=0, return_inverse=True)
    found = []
    for way in kinds.reshape(len(kinds), *units.shape[1:]):
        lattice = (way[:, None] + CORNER_STEPS[units.shape[2]]).reshape(-1, units.shape[2])
        corners, number = np.unique(lattice, axis=0, return_inverse=True)
        found.append((corners, number.reshape(units.shape[1], -1)))
    corners, numbers = (np.stack(some) for some in zip(*found, strict=True))
    kind = kind.ravel()
    return units[:, :1] + corners[kind], numbers[kind]


def _in_cell(steps: Indices, degree: int) -> Indices:
    """Numbers of nodes among those of a cell of second degree."""
    return (steps * (2 // degree)) @ 3 ** np.arange(steps.shape[1])


def find_sheets(
    grid: Grid,
    facets: Indices,
    x: Array,
    bounds: NDArray[np.bool_],
    *,
    thin: int = THIN,
    always: bool = False,
    closing: bool = False,
    joined: Joined = MappingProxyType({}),
    tied: tuple[Mask, Mask] | None = None,
    repeated: tuple[int, ...] = (),
    before: Sheets | None = None,
) -> Sheets | None:
    """Sheets of the fluid around surfaces with vertices at x [m]; None if no body is thin, unless `always`.

    closing: also where bodies close a way, however thick they are.

    bounds: facets that are not on the boundary of the box. thin: cells apart, at most, of the fluid on both sides; 0:
    no body is thin.
    joined: parts of fluid in these cells at these facets share their nodes. tied: masks of the facets that are tied and
    of those that the flow acts on; None: no body is tied. repeated: periodic axes, whose faces no body reaches.
    before: of an earlier position, whose numbers are those of this one if the same parts are connected.
    """
    if not len(facets):
        return None
    may_close = closing and may_touch(grid, facets, x)
    may_part = always or (thin > 0 and (grid.dim == 2 or _some_are_thin(grid, facets, x, thin, tied)))
    if not (may_part or may_close):
        return None
    x = without_slivers(grid, facets, x)
    moments = kernels.moments(grid.edges, gauss(3)[0], x, facets, np.ones(grid.size, dtype=bool))
    may_close &= are_apart(grid, uncut_cells(grid, moments))
    if not (may_part or may_close):
        return None
    if (surfaces := closed_surfaces(facets, x)) is None:
        return None
    if tied is not None:
        moments = without_slits(moments, gauss(3)[0], tied[0], tied[1] & bounds, slivers_of(grid))
    parts = parts_of_fluid(grid, moments, surfaces, x, None if before is None else before.parts.geometry)
    cells, links, special = parts.cell, parts.links, parts.special
    if not len(cells) and not always:  # all surfaces are outside of the box
        return None
    if not always:
        close, facing = np.flatnonzero(grown(grid, special, 1)[cells]), parts.facing()
        if grid.dim == 3:
            close = _opposed(grid, cells, facing, close, thin)
        if not (may_part and _is_thin(grid, cells, links, facing, close, thin)) and not (
            may_close and close_a_way(grid, moments, cells, links)
        ):
            return None
    _require_off_ends(grid, special, repeated)
    connections = Connections(cells, links, special, parts.touching, same_nodes(parts, joined))
    known = before is not None and before.numbering.of.equal(connections)
    numbering = before.numbering if before is not None and known else numbered(grid, connections)
    part, facet = parts.pieces.T
    of_mesh = numbering.cell_of_part[part]
    return Sheets(
        grid,
        numbering,
        _fluid(grid, moments.fraction, parts, numbering),
        np.column_stack([of_mesh, facet])[of_mesh >= 0],
        np.intersect1d(parts.touching, cells),
        parts,
        repeated=repeated,
    )


def _fluid(grid: Grid, solid: Array, parts: FluidParts, numbering: SheetNumbers) -> Array:
    """Share of fluid in each cell of the mesh; solid: share of solid in each cell of the box."""
    found = np.concatenate([np.clip(1.0 - solid, 0.0, 1.0), np.zeros(len(numbering.cells))])
    found[parts.touching] = found[parts.cell[numbering.sharing]] = 0.0
    part = numbering.sharing[numbering.cell_of_part[numbering.sharing] >= 0]
    np.add.at(found, numbering.cell_of_part[part], parts.share[part])
    return found


def _opposed(grid: Grid, cells: Indices, facing: Array, close: Indices, thin: int) -> Indices:
    """Those parts that face the opposite direction of another one nearby: in 3D all others would take too long."""
    close = close[~np.isnan(facing[close]).any(axis=1)]
    index = np.stack(np.unravel_index(cells[close], grid.shape, order="F"), axis=1)
    pairs = cKDTree(index).query_pairs(thin + 0.5, p=np.inf, output_type="ndarray") if len(close) else index[:, :2]
    first, second = close[pairs].T
    return np.unique(close[pairs][(facing[first] * facing[second]).sum(axis=1) < OPPOSITE_NORMALS])


def _some_are_thin(grid: Grid, facets: Indices, x: Array, thin: int, tied: tuple[Mask, Mask] | None) -> bool:
    body = solid_of(facets, x, None if tied is None else tied[0])
    return may_be_thin(grid, facets, x, CELL_DIAGONAL * (thin + 1), body)


def _is_thin(grid: Grid, cells: Indices, links: Indices, facing: Array, close: Indices, thin: int) -> bool:
    """Whether a thin body is between two parts: they face opposite directions and are not linked nearby.

    Parts around a corner of a thick body do not face opposite directions, or are linked around it.
    cells: of the parts; facing: mean normal of the surface in each, nan where there is none; close: parts to test;
    thin: their largest distance [cells].
    """
    index = np.stack(np.unravel_index(cells, grid.shape, order="F"), axis=1)
    ends = links[:, :2]
    linked = np.zeros(len(cells), dtype=bool)
    linked[ends.ravel()] = True
    some = close[linked[close]]
    around = cKDTree(index).query_ball_point(index[some], thin + AROUND_PAIR, p=np.inf, return_sorted=True)
    ends = ends[np.argsort(ends[:, 0], kind="stable")]
    begins = np.searchsorted(ends[:, 0], np.arange(len(cells) + 1))
    number = np.full(len(cells), -1)
    for part, near in zip(some, map(np.array, around), strict=True):
        number[near] = np.arange(len(near))
        first, place = ragged(begins[near + 1] - begins[near])
        second = number[ends[begins[near][first] + place, 1]]
        group = connected_parts(first[second >= 0], second[second >= 0], len(near))
        opposed = ~(facing[near] @ facing[part] > OPPOSITE_NORMALS)
        opposed &= np.abs(index[near] - index[part]).max(axis=1) <= thin
        if (group != group[number[part]])[linked[near] & opposed].any():
            return True
        number[near] = -1
    return False


def _require_off_ends(grid: Grid, special: Mask, repeated: tuple[int, ...]) -> None:
    """Raise StepFailed if a thin body reaches a periodic face: cells of its sides are not joined across it."""
    box = grid.as_box(special)
    for axis in repeated:
        if np.take(box, [0, -1], axis=axis).any():
            name = "xyz"[axis]
            reason = (
                f"a thin body, or another one beside thin bodies, reaches the periodic faces {name}- and {name}+: "
                "take a longer box, or end earlier"
            )
            raise StepFailed("fluid", FailureKind.PERIODIC_FACES, reason)


def sheets_of(grid: Grid, bodies: Sequence[ImmersedBody], repeated: tuple[int, ...] = ()) -> Sheets | None:
    """Sheets of the fluid around bodies at rest that are thin or close a way; None if none is."""
    if not bodies or not all(body.rests for body in bodies):
        return None
    motions = [body.motion(0.0) for body in bodies if body.motion is not None]
    facets, motion = together([body.surface for body in bodies], motions, grid.dim)
    return find_sheets(grid, facets, motion.x, off_boundary(grid, motion.x[facets]), closing=True, repeated=repeated)
