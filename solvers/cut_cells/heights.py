"""How thin the fluid is in the regions of a table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from solvers.api import Array, Indices
from solvers.cut_cells.table import CutTable

FACING = -0.5  #: cosine of the normals of walls that face each other, as for the closing length


@dataclass(frozen=True)
class Heights:
    """Two lengths [m] of each region, shape (R,); infinite without walls, or without walls that face each other."""

    over_walls: Array  #: volume / area of the walls, half of the gap between two walls
    #: smallest gap from the middle of a wall's piece to one that it faces and is over; the middle of a piece that is
    #: not convex may be beside it, and the gap too small
    between_walls: Array


def heights(edges: Sequence[Array], facets: Indices, table: CutTable) -> Heights:
    """Heights of regions; edges: grid lines [m]; facets: vertices of each, as for `cut_cells`."""
    regions, walls, region = len(table.cell), table.vertices[facets][table.piece_facet], table.piece_region
    index = np.unravel_index(table.cell, table.shape, order="F")
    volume = table.share * np.prod([np.diff(edge)[i] for edge, i in zip(edges, index, strict=True)], axis=0)
    area = np.zeros(regions)
    np.add.at(area, region, table.piece_area)
    over = np.divide(volume, area, out=np.full(regions, np.inf), where=area > 0.0)

    mean = table.piece_moments.sum(axis=1)
    middle = np.einsum("pv,pvd->pd", mean, walls) / mean.sum(axis=1, keepdims=True)
    ways = walls[:, 1:] - walls[:, :1]
    normal = np.cross(ways[:, 0], ways[:, 1]) if len(table.shape) == 3 else ways[:, 0, ::-1] * [1.0, -1.0]
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    count = np.bincount(region, minlength=regions)
    first = np.cumsum(count) - count
    repeats = count[region]  # each piece meets all pieces of its region
    one = np.repeat(np.arange(len(region)), repeats)
    other = np.arange(len(one)) - np.repeat(np.cumsum(repeats) - repeats, repeats) + np.repeat(first[region], repeats)
    facing = np.einsum("pd,pd->p", normal[one], normal[other]) < FACING
    one, other = one[facing], other[facing]
    way = middle[one] - walls[other, 0]
    gap = np.einsum("pd,pd->p", way, normal[other])
    gram = np.einsum("pid,pjd->pij", ways[other], ways[other])
    at = np.linalg.solve(gram, np.einsum("pid,pd->pi", ways[other], way)[..., None])[..., 0]
    inside = (gap >= 0.0) & (at >= 0.0).all(axis=1) & (at.sum(axis=1) <= 1.0)
    between = np.full(regions, np.inf)
    np.minimum.at(between, region[one[inside]], gap[inside])
    return Heights(over, between)
