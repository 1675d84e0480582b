"""Parts of the fluid in the cells around surfaces, in 2D, and which parts of neighbouring cells are linked."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import ndimage

from solvers.algebra.connected import connected_parts
from solvers.api import Array, Indices, Mask
from solvers.fluid.geometry.pieces import NOTHING
from solvers.fluid.geometry.regions.regions import SAME_POINT, WHOLE_EDGES, Region, chords_of, regions_in_cell
from solvers.fluid.geometry.regions.space_parts import SpacePart
from solvers.fluid.geometry.regions.touching_regions import meet, touching_regions
from solvers.fluid.grid.box import Grid
from solvers.mesh.tessellation import unit_normals

Part = Region | SpacePart

LAYERS_AROUND = 3  #: layers of cells around surfaces in which parts and links are found


def parts_of_fluid(grid: Grid, moments, facets: Indices, x: Array, bounds: Mask) -> tuple[list[Region], Mask, Indices]:
    """(parts of the fluid in all cells around surfaces, cells with surface or solid, cells in which bodies touch)."""
    fluid = 1.0 - moments.fraction
    touched = np.zeros(grid.size, dtype=bool)
    touched[moments.cells] = True
    special = touched | (fluid < 1.0 - SAME_POINT)
    whole = grown(grid, special, LAYERS_AROUND) & (fluid > NOTHING)
    body = connected_parts(facets[:, 0], facets[:, 1], len(x))[facets[:, 0]]
    found, touching = [], []
    ends = np.searchsorted(moments.piece_cell, np.arange(len(moments.cells) + 1))
    for row, cell in enumerate(moments.cells.tolist()):
        numbers = moments.piece_facet[ends[row] : ends[row + 1]]
        numbers = numbers[bounds[numbers]]
        chords = chords_of(grid, cell, x, facets, numbers.tolist())
        if not chords:
            continue
        several = len(np.unique(body[numbers])) > 1
        regions = None
        if whole[cell] and not (several and meet(chords, body)):
            regions = regions_in_cell(cell, float(fluid[cell]), chords)
        if regions is None and several:
            regions = touching_regions(cell, float(1.0 - fluid[cell]), chords)
            if regions is not None:
                touching.append(cell)
        if regions is not None:
            found += regions
            whole[cell] = False
    found += [Region(int(cell), float(fluid[cell]), WHOLE_EDGES) for cell in np.flatnonzero(whole)]
    return sorted(found, key=lambda region: region.cell), special, np.array(touching, dtype=np.int64)


def links_of(grid: Grid, parts: Sequence[Region]) -> Indices:
    """(part, part of the next cell, axis), sorted, for parts whose wet pieces of the common face overlap."""
    cells = np.array([part.cell for part in parts], dtype=np.int64)
    wet = np.array([(*face, a, b) for part in parts for face, a, b in part.faces]).reshape(-1, 4)
    owner = np.repeat(np.arange(len(parts)), [len(part.faces) for part in parts])
    found = []
    for axis, count in enumerate(grid.shape):
        stride = int(np.prod(grid.shape[:axis]))
        low, high = (np.flatnonzero((wet[:, 0] == axis) & (wet[:, 1] == side)) for side in (1, 0))
        low = low[cells[owner[low]] // stride % count < count - 1]
        at, above = join(cells[owner[low]] + stride, high, cells[owner[high]])
        below = low[at]
        overlap = np.minimum(wet[below, 3], wet[above, 3]) - np.maximum(wet[below, 2], wet[above, 2])
        linked = overlap > SAME_POINT
        pairs = owner[below[linked]], owner[above[linked]]
        found.append(np.stack([*pairs, np.full(len(pairs[0]), axis)], axis=1))
    return np.unique(np.concatenate(found), axis=0)


def facing_of(parts: Sequence[Part], corners: Array) -> Array:
    """Mean unit normal of the facets in each part, shape (parts, dim); nan without facets.

    corners: of facets, shape (n, dim, dim).
    """
    normals = unit_normals(corners)
    found = np.full((len(parts), corners.shape[1]), np.nan)
    for number, part in enumerate(parts):
        if facets := part.facets or part.flush:
            mean = normals[list(facets)].sum(axis=0)
            found[number] = mean / max(float(np.linalg.norm(mean)), SAME_POINT)
    return found


def grown(grid: Grid, cells: Mask, layers: int) -> Mask:
    """These cells and so many layers around them."""
    shape = np.ones((3,) * grid.dim, dtype=bool)
    return ndimage.binary_dilation(grid.as_box(cells), shape, iterations=layers).ravel(order="F")


def join(wanted: Indices, values: Indices, keys: Indices) -> tuple[Indices, Indices]:
    """All pairs (position in `wanted`, value with this key)."""
    order = np.argsort(keys, kind="stable")
    low, high = (np.searchsorted(keys[order], wanted, side=side) for side in ("left", "right"))
    count = high - low
    at = np.repeat(np.arange(len(wanted)), count)
    return at, values[order[np.arange(len(at)) + np.repeat(low - (np.cumsum(count) - count), count)]]
