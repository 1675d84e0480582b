"""Numbers of new cells and of their nodes: functions of what is connected, and of nothing else.

Source: the rule by which 4C's cut library gives nodes several sets of unknowns: Schott, Wall, Comput. Methods Appl.
Mech. Engrg. 276 (2014) 233-265, section 3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.api import Indices, Mask
from solvers.fluid.geometry.thin.fluid_parts import LAYERS_AROUND, grown
from solvers.fluid.geometry.thin.sheet_nodes import node_copies
from solvers.fluid.grid.box import Grid


@dataclass(frozen=True)
class Connections:
    """Parts of the fluid and what connects them; see `FluidParts`."""

    cell: Indices
    links: Indices
    special: Mask
    touching: Indices
    same: list[tuple[int, int]]  #: pairs of parts of a cell with the same nodes

    def equal(self, other: Connections) -> bool:
        """The same parts are connected in the same way, however much fluid they have."""
        tables = ("cell", "links", "special", "touching")
        return self.same == other.same and all(np.array_equal(getattr(self, k), getattr(other, k)) for k in tables)


@dataclass(frozen=True)
class SheetNumbers:
    """Cells that follow those of the box; see `Sheets`."""

    of: Connections
    cell_of_part: Indices  #: cell of the mesh that has each part, -1: none, as it is enclosed within a cell
    sharing: Indices  #: parts in those cells of the box whose fluid is not all in one cell of the mesh, sorted
    left: Indices
    parted: Indices
    cells: Indices
    pairs: int
    copies: Indices
    around: Mask
    links: Indices

    def equal(self, other: SheetNumbers) -> bool:
        """The mesh and what is linked in it are the same."""
        tables = ("left", "parted", "cells", "copies", "around", "links")
        same = (np.array_equal(getattr(self, name), getattr(other, name)) for name in tables)
        return self is other or (self.pairs == other.pairs and all(same))


def numbered(grid: Grid, of: Connections) -> SheetNumbers:
    """The numbers of these parts."""
    cells, links, special, size = of.cell, of.links, of.special, grid.size
    copies = node_copies(grid, cells, links, of.same, special)
    moved = (copies > 0).any(axis=1)
    linked = np.zeros(len(cells), dtype=bool)
    linked[links[:, :2]] = True
    new = np.flatnonzero(moved & linked)  # fluid that is enclosed within one cell counts as solid
    shared = np.zeros(size, dtype=bool)
    shared[of.touching] = shared[cells[moved]] = True
    staying = np.zeros(size, dtype=bool)
    staying[cells[~moved]] = True
    cell_of_part = np.where(moved, -1, cells)
    cell_of_part[new] = size + np.arange(len(new))
    ends = links[:, :2]
    linked_cells, changed = cell_of_part[ends], moved[ends].any(axis=1)
    passing = cells[ends[~changed]] @ [size, 1]
    at_faces = ends[changed & special[cells[ends]].any(axis=1)]
    members = np.concatenate([new, at_faces.ravel()])
    return SheetNumbers(
        of,
        cell_of_part,
        np.flatnonzero(shared[cells]),
        np.flatnonzero(shared & ~staying),
        np.setdiff1d(_neighbours(grid, staying), passing),
        cells[members],
        len(at_faces),
        copies[members],
        grown(grid, special, LAYERS_AROUND),
        np.unique(linked_cells[(linked_cells >= 0).all(axis=1)], axis=0),
    )


def _neighbours(grid: Grid, marked: Mask) -> Indices:
    """Pairs of marked cells with a common face, the lower number times the count of cells plus the higher one."""
    number, box, found = grid.as_box(np.arange(grid.size)), grid.as_box(marked), []
    for axis, count in enumerate(grid.shape):
        (low, high), (first, second) = (
            [some.take(np.arange(count - 1) + side, axis).ravel() for side in (0, 1)] for some in (number, box)
        )
        both = first & second
        found.append(low[both] * grid.size + high[both])
    return np.concatenate(found)
