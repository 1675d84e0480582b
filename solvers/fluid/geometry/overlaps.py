"""Cells in which bodies overlap, in 2D: the solid there is the union of the bodies.

Moments of several bodies are sums over them. So an overlap counts twice: the solid may exceed the cell though there is
fluid in it, and surface inside of another body bounds no fluid. In such a cell the regions of the fluid are found
exactly (`touching_regions`), and the moments are those of these regions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.algebra.connected import connected_parts
from solvers.api import Array, Indices
from solvers.fluid.geometry.pieces import NOTHING, joined_pieces, parts_of_facets
from solvers.fluid.geometry.regions.regions import SAME_POINT, Region, chords_of
from solvers.fluid.geometry.regions.touching_regions import touching_regions
from solvers.fluid.grid.box import Grid
from solvers.mesh.gauss import tensor_weights


@dataclass(frozen=True)
class Moments:
    """Integrals over a solid and its surface, named as those of `kernels.moments`."""

    fraction: Array
    cells: Indices
    solid: Array
    piece_cell: Indices
    piece_facet: Indices
    piece_moments: Array
    piece_mass: Array


#: What the regions of a cell depend on, as bytes, and these regions; None: nothing overlaps where there is fluid.
Known = tuple[tuple[bytes, ...], list[Region] | None]


def with_unions(
    grid: Grid,
    points: Array,
    moments,
    facets: Indices,
    x: Array,
    bounds: NDArray[np.bool_],
    tied: NDArray[np.bool_] | None,
    known: dict[int, Known],
):
    """Moments in 2D with the union of the bodies as solid, in cells with fluid where they overlap.

    moments: of `kernels.moments`, which are returned where nothing overlaps; points: of the quadrature in one
    direction; x: vertices [m]; bounds: facets that are not on the boundary of the box; tied: facets that are tied, in
    whose cells nothing overlaps; None: no one is; known: by cells of the box, those of the cut before, which this one
    replaces: where nothing has moved they are used again.
    """
    found = dict(_overlapping(grid, moments, facets, x, bounds, tied, known))
    if not found:
        return moments
    fraction, solid = moments.fraction.copy(), moments.solid.copy()
    weights = tensor_weights(len(points), 2)
    surfaces = []
    for row, regions in found.items():
        cell = moments.cells[row]
        fraction[cell] = 1.0 - sum(region.share for region in regions)
        solid[row] = weights - sum(region.integrals(points) for region in regions)
        surfaces.append(np.concatenate([region.surface for region in regions if region.surface is not None]))
    rows = np.repeat(np.array(list(found)), [len(surface) for surface in surfaces])
    parts = parts_of_facets(grid, moments.cells[rows], rows, np.concatenate(surfaces), facets, x, points)
    new = joined_pieces([parts])
    kept = ~np.isin(moments.piece_cell, list(found))
    pairs = (
        (moments.piece_cell, new.cell),
        (moments.piece_facet, new.facet),
        (moments.piece_moments, new.moments),
        (moments.piece_mass, new.mass),
    )
    return Moments(fraction, moments.cells, solid, *(np.concatenate([old[kept], some]) for old, some in pairs))


def _overlapping(
    grid: Grid,
    moments,
    facets: Indices,
    x: Array,
    bounds: NDArray[np.bool_],
    tied: NDArray[np.bool_] | None,
    known: dict[int, Known],
) -> list[tuple[int, list[Region]]]:
    """(row of each cell with fluid in which bodies overlap, regions of the fluid)."""
    body = connected_parts(facets[:, 0], facets[:, 1], len(x))[facets[:, 0]]
    rows = np.unique(moments.piece_cell * len(x) + body[moments.piece_facet]) // max(len(x), 1)
    several, counts = np.unique(rows, return_counts=True)
    if tied is not None:
        here = np.unique(moments.piece_cell[tied[moments.piece_facet]])
        counts[np.isin(several, here)] = 0
    found, before = [], dict(known)
    known.clear()
    ends = np.searchsorted(moments.piece_cell, np.arange(len(moments.cells) + 1))
    for row in several[counts > 1].tolist():
        cell = int(moments.cells[row])
        numbers = moments.piece_facet[ends[row] : ends[row + 1]]
        numbers = numbers[bounds[numbers]]
        key = numbers.tobytes(), x[facets[numbers]].tobytes(), moments.fraction[cell].tobytes()
        if cell not in before or before[cell][0] != key:
            before[cell] = key, _regions(grid, cell, float(moments.fraction[cell]), facets, x, numbers.tolist())
        known[cell] = before[cell]
        if (regions := known[cell][1]) is not None:
            found.append((row, regions))
    return found


def _regions(
    grid: Grid, cell: int, fraction: float, facets: Indices, x: Array, numbers: list[int]
) -> list[Region] | None:
    """Regions of the fluid in a cell in which bodies overlap; None if they do not, or if there is no fluid."""
    chords = chords_of(grid, cell, x, facets, numbers)
    regions = touching_regions(cell, fraction, chords) if chords else None
    if not chords or not regions:
        return None
    twice = sum(region.share for region in regions) + fraction > 1.0 + NOTHING
    bounding = sum(length(region.surface[:, 1:].reshape(-1, 2, 2)) for region in regions if region.surface is not None)
    hidden = sum(length(np.stack([line[:-1], line[1:]], axis=1)) for line, _ in chords) - bounding > SAME_POINT
    return regions if twice or hidden else None


def length(ends: Array) -> float:
    """Sum of the lengths of segments, (n, 2, 2)."""
    return float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum())
