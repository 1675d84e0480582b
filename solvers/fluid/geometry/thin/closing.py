"""Whether bodies close a way of the fluid: cells on both sides share nodes, though no fluid is between them.

Cells that share a corner share unknowns. Where bodies touch each other or the boundary of the box, fluid would pass
from one side to the other without a way. As behind thin bodies, both sides need unknowns of their own.
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from solvers.algebra.connected import connected_parts
from solvers.api import Array, Indices, Mask
from solvers.fluid.geometry.pieces import NOTHING
from solvers.fluid.grid.box import FLUSH, Grid


def may_touch(grid: Grid, facets: Indices, x: Array) -> bool:
    """Whether there are several bodies, or one reaches the boundary of the box; x: vertices [m]."""
    used = np.unique(facets)
    edges = np.concatenate([facets[:, k : k + 2] for k in range(facets.shape[1] - 1)])
    if len(np.unique(connected_parts(edges[:, 0], edges[:, 1], len(x))[used])) > 1:
        return True
    near = [FLUSH * float(np.diff(edge).min()) for edge in grid.edges]
    return any(
        bool(((x[used, axis] < edge[0] + near[axis]) | (x[used, axis] > edge[-1] - near[axis])).any())
        for axis, edge in enumerate(grid.edges)
    )


def uncut_cells(grid: Grid, moments) -> Mask:
    """Cells that are all fluid, without surface in them; moments: of `kernels.moments`."""
    found: Mask = moments.fraction < NOTHING
    found[moments.cells] = False
    return found


def are_apart(grid: Grid, uncut: Mask) -> bool:
    """Whether uncut cells are not connected across faces: necessary for bodies that close a way."""
    return int(ndimage.label(grid.as_box(uncut))[1]) > 1


def close_a_way(grid: Grid, moments, cells: Indices, links: Indices) -> bool:
    """Whether some uncut cells are connected by corners of cells with fluid, but not across faces with fluid.

    cells: of parts of fluid around surfaces; links: pairs of these parts that fluid connects, in the first columns.
    """
    uncut = uncut_cells(grid, moments)
    label, count = ndimage.label(grid.as_box(uncut))
    number = label.ravel(order="F")
    there = np.flatnonzero(uncut[cells])
    first = np.concatenate([links[:, 0], there])
    second = np.concatenate([links[:, 1], len(cells) + number[cells[there]]])
    side = connected_parts(first, second, len(cells) + count + 1)
    across_faces = side[len(cells) + number[uncut]]
    fluid = moments.fraction < 1.0 - NOTHING
    by_corners = ndimage.label(grid.as_box(fluid), np.ones((3,) * grid.dim))[0].ravel(order="F")[uncut]
    pairs = np.unique(np.stack([across_faces, by_corners]), axis=1)
    return pairs.shape[1] > len(np.unique(by_corners))
