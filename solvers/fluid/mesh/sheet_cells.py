"""Cuts and unknowns on a grid with sheets: each new cell has its share of the fluid and of the surface."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solvers import fem
from solvers.algebra.connected import connected_parts
from solvers.api import Array, Indices
from solvers.cut_cells import CutTable
from solvers.fluid.geometry.pieces import joined_pieces, selected
from solvers.fluid.geometry.regions import pieces_of_regions
from solvers.fluid.geometry.thin.fluid_parts import FluidParts
from solvers.fluid.mesh.distributed_grid import DistributedGrid
from solvers.fluid.mesh.periodic import BEYOND_NODES, LatticeNodes
from solvers.mesh.gauss import tensor_weights


def on_sheets(grid: DistributedGrid, points: Array, cut: Any, counts: NDArray[np.bool_]) -> Any:
    """A `Cut` of the box extended to new cells: each has its own share of the fluid and of the pieces of surface.

    counts: facets that the flow acts on.
    """
    sheets, original = grid.sheets, grid.in_sheets
    assert sheets is not None
    box, local = sheets.grid.size, np.full(sheets.grid.size + len(sheets.cells), -1)
    local[original] = np.arange(len(original))
    for_faces, new = original >= box + sheets.singles, (original >= box) & (original < box + sheets.singles)
    empty = for_faces | np.isin(original, sheets.left)
    is_cut = np.zeros(len(original), dtype=bool)
    is_cut[cut.cut] = True
    row_of = np.full(box, -1)
    row_of[grid.numbers[cut.cut]] = np.arange(len(cut.cut))
    is_cut = (is_cut | new) & ~empty
    cells = np.flatnonzero(is_cut).astype(np.int32)
    rows = row_of[grid.numbers[cells]]
    fluid = np.where(rows[:, None] < 0, 1.0, cut.fluid[rows])
    fraction = np.where(empty, 0.0, cut.fraction)
    weights = tensor_weights(len(points), grid.dim)
    share, is_active = (
        np.concatenate([some, np.zeros(len(sheets.cells), some.dtype)]) for some in (cut.share, cut.is_active)
    )
    share[sheets.left], is_active[sheets.left], is_active[box : box + sheets.singles] = 0.0, False, True
    (part, has), regions = sheets.of_shares, sheets.parts.region
    share[has] = sheets.fluid[has]
    place = np.full(len(original), -1)
    place[cells] = np.arange(len(cells))
    table = sheets.parts.geometry.table(len(points))
    rows_of, owner = np.full(len(table.cell), -1), np.arange(box)
    owner[sheets.left] = owner[sheets.box_cells(has)] = -1
    whole = regions[part] < 0  # the cell has all of the fluid
    owner[sheets.box_cells(has[whole])] = has[whole]
    mine = ~whole & (local[has] >= 0)
    part, at = part[mine], local[has[mine]]
    row = rows_of[regions[part]] = place[at]
    fluid[row] = 0.0
    np.add.at(fluid, row, table.moments[regions[part]])
    fluid[row] /= weights
    fraction[at] = share[original[at]]
    cell_of_piece = grid.numbers[cut.cut[cut.pieces.cell]]
    target = owner[cell_of_piece]
    target = np.where((target >= 0) & (local[target] >= 0), place[local[target]], -1)
    region = _region_of_pieces(sheets.parts, table, cell_of_piece, cut.pieces.facet, counts)
    target = np.where((target < 0) & (region >= 0), rows_of[region], target)
    rows_of[np.isin(table.cell, cell_of_piece[region >= 0])] = -1
    own = pieces_of_regions(table, points, grid.grid, cut.facets, cut.motion.x, rows_of)
    parts = [selected(cut.pieces, target), selected(own, np.where(counts[own.facet], own.cell, -1))]
    return replace(
        cut,
        uncut=cut.uncut[~(empty | new)[cut.uncut]],
        cut=cells,
        strip=cut.strip[original[cut.strip] < box],
        ghost_faces=cut.ghost_faces[_passable(grid, cut.ghost_faces, empty, for_faces)],
        contact_cells=cut.contact_cells[original[cut.contact_cells] < box],
        is_active=is_active,
        share=share,
        fluid=fluid,
        fraction=fraction,
        pieces=joined_pieces(parts),
    )


def _region_of_pieces(
    parts: FluidParts, table: CutTable, cell: Indices, facet: Indices, counts: NDArray[np.bool_]
) -> Indices:
    """Region that pieces of facets in cells of the box bound as a whole; -1: in this cell some facet does not.

    Facets are divided where surfaces touch. All others meet with the same ends in two cells: what the table has of them
    does so but for rounding errors over the sine of the angle to the planes of the grid, and no surface closes.
    """
    of_table = np.flatnonzero(counts[table.piece_facet])
    keys = table.cell[table.piece_region[of_table]] * len(counts) + table.piece_facet[of_table]
    wanted = cell * len(counts) + facet
    order = np.argsort(keys, kind="stable")
    of_table, keys = of_table[order], keys[order]
    first, last = (np.searchsorted(keys, wanted, side=side) for side in ("left", "right"))
    divided = np.zeros(len(table.state), dtype=bool)
    divided[parts.touching] = divided[table.closed_cell] = True
    divided[cell[last - first != 1]] = True
    divided[table.cell[table.piece_region[of_table[~np.isin(keys, wanted)]]]] = True
    found = np.full(len(cell), -1)
    some = np.flatnonzero(~divided[cell])
    found[some] = table.piece_region[of_table[first[some]]]
    return found


def _passable(
    grid: DistributedGrid, faces: NDArray[np.int32], empty: NDArray[np.bool_], for_faces: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Faces with linked fluid on both sides."""
    assert grid.sheets is not None
    interior, sides = grid.find_interior_faces()
    ends = sides[np.searchsorted(interior, faces)]
    pairs = np.sort(grid.numbers[ends], axis=1).astype(np.int64)
    parted = np.isin(pairs @ [grid.grid.size, 1], grid.sheets.parted)
    return for_faces[ends].all(axis=1) | ~(empty[ends].any(axis=1) | parted)


def join_nodes(
    grid: DistributedGrid, space: Any, degree: int, nodes: list[LatticeNodes]
) -> tuple[Any, list[LatticeNodes]]:
    """Identify nodes with equal numbers (collective).

    degree: of the velocity. Returns (the new space, the nodes of velocity and pressure with their numbers).
    """
    size, dim, comm = int(space.dofmap.index_map_bs), grid.dim, grid.comm
    everything = np.arange(len(grid.original), dtype=np.int32)
    start, end = space.dofmap.index_map.local_range
    columns = [(0, degree)] if size > 1 else [*((axis, degree) for axis in range(dim)), (dim, 1)]
    number = np.zeros(end - start + int(space.dofmap.index_map.num_ghosts), dtype=np.int64)
    for component, its_degree in columns:
        blocks = fem.component_cell_dofs(space, component) // size
        number[blocks] = component * BEYOND_NODES + grid.cell_nodes(everything, its_degree)
    new = np.unique(number[fem.cell_blocks(space)[grid.apart]])
    shared = np.flatnonzero(np.isin(number, np.unique(np.concatenate(comm.allgather(new)))))
    mine = shared[shared < end - start]
    tables = comm.allgather((number[mine], start + mine))
    owners = np.repeat(np.arange(comm.size, dtype=np.int32), [len(numbers) for numbers, _ in tables])
    numbers, masters = (np.concatenate(column) for column in zip(*tables, strict=True))
    numbers, first = np.unique(numbers, return_index=True)
    twin = first[np.searchsorted(numbers, number[shared])]
    space, joined = fem.identify_blocks(space, shared.astype(np.int32), masters[twin], owners[twin])

    def renumbered(part: LatticeNodes) -> LatticeNodes:
        blocks = part.dofs // size
        return replace(part, dofs=size * joined[blocks] + part.dofs % size, numbers=number[blocks[:, 0]] % BEYOND_NODES)

    return space, [renumbered(part) for part in nodes]


def connected_cells(grid: DistributedGrid, cells: NDArray[np.int32]) -> tuple[Indices, int]:
    """Connected parts of some cells on all processes; cells are connected if they share corners (collective).

    cells: those of this process. Returns (part of each local cell, from 1 on, 0 for other cells; count of parts).
    """
    corners = grid.cell_nodes(cells, 1)
    gathered = grid.comm.allgather((grid.original[cells], corners))
    everything, nodes = (np.concatenate(column) for column in zip(*gathered, strict=True))
    ends = np.unique(nodes, return_inverse=True)[1].reshape(nodes.shape) + len(everything)
    first = np.repeat(np.arange(len(everything)), nodes.shape[1])
    part = connected_parts(first, ends.ravel(), len(everything) + int(ends.max(initial=0)) + 1)[: len(everything)]
    order = np.full(len(everything), np.iinfo(np.int64).max)
    np.minimum.at(order, part, everything)  # parts by their first cell, on any number of processes
    first_cells = np.unique(order[part])
    labels = np.zeros(len(grid.original), dtype=np.int64)
    before = sum(len(numbers) for numbers, _ in gathered[: grid.comm.rank])
    labels[cells] = 1 + np.searchsorted(first_cells, order[part[before : before + len(cells)]])
    return labels, len(first_cells)
