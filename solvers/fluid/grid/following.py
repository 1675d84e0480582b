"""Nested cells that follow bodies: as a body moves, the cells of the finest level move with it.

The lattices of all levels stay as they are. What changes is which of their cells are halved, so that regions move by
whole coarse cells. A step begins with other cells if a body would come too close to coarse ones in it.

Where cells are merged, the velocity at the remaining nodes is kept. As a function on the larger cells it does not
fulfil the equation of continuity any more. The pressure would correct that within the next step, and the force on
bodies would show it. So each velocity u of the past is corrected before, by (du, dp) with

    rho alpha (du, v) + ... - (dp, div v) = 0,    (q, div u + div du) + ... = 0    for q at cells that changed,

the tangent of the next step, and 0 on the right-hand side for all other q. The terms of stabilisation in the
equation of continuity have the rate and the pressure in the middle of the last step.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from solvers.api import Array
from solvers.fluid.grid.box import CORNER_STEPS, Grid
from solvers.fluid.grid.nested import FINE_LAYERS, Nested, RefinedRegion, RefinedSurface, refined

Surfaces = Mapping[str, tuple[NDArray[np.int64], Sequence[Array]]]


@dataclass(frozen=True)
class RefinedBody:
    """Cells near the surface of a body, wherever that is."""

    name: str
    layers: int  #: of cells of this level on both sides of the surface
    level: int


@dataclass(frozen=True)
class Following:
    """The rule by which nested cells follow bodies."""

    coarsest: Grid
    regions: Sequence[RefinedRegion]  #: that stay where they are
    bodies: Sequence[RefinedBody]

    def cells(self, present: Nested, surfaces: Surfaces) -> Nested:
        """Cells for a step: the present ones if all near bodies are of the finest level.

        surfaces: by name of the body, facets and some positions of their vertices [m] in the step, as first and last.
        """
        around = [(*surfaces[body.name], body) for body in self.bodies]
        if not any(_near_coarse(present, x, facets) for facets, positions, _ in around for x in positions):
            return present
        regions = [
            RefinedSurface(x, facets, body.layers, body.level) for facets, positions, body in around for x in positions
        ]
        found = refined(self.coarsest, [*self.regions, *regions])
        assert isinstance(found, Nested)
        return found


def _near_coarse(grid: Nested, x: Array, facets: NDArray[np.int64]) -> bool:
    near = RefinedSurface(x, facets, FINE_LAYERS, 0).cells(grid)
    return bool((near & grid.coarse).any())


def interpolation(old: Nested, new: Nested, degree: int) -> sparse.csr_matrix:
    """Values at the nodes of new cells from those at the nodes of old ones, by the polynomials of the old cells.

    Rows and columns are the nodes of a degree in the order of `all_nodes`. Hanging nodes get the values of their coarse
    cells. Where cells are halved the flow stays the same; where they are merged its values at the nodes do.
    """
    nodes, columns = new.all_nodes(degree), old.all_nodes(degree)
    shape = (len(nodes), len(columns))
    masters, weights = old.polynomials(degree, nodes)
    kept = weights != 0.0
    rows = np.repeat(np.arange(len(nodes)), np.count_nonzero(kept, axis=1))
    entries = (weights[kept], (rows, np.searchsorted(columns, masters[kept])))
    at_nodes = sparse.csr_matrix(entries, shape=shape)
    hangs, masters, weights = new.hanging(degree, nodes)
    rows = np.concatenate([np.flatnonzero(~hangs), np.repeat(np.flatnonzero(hangs), masters.shape[1])])
    at = np.concatenate([np.flatnonzero(~hangs), np.searchsorted(nodes, masters).ravel()])
    values = np.concatenate([np.ones(np.count_nonzero(~hangs)), weights.ravel()])
    return (sparse.csr_matrix((values, (rows, at)), shape=(len(nodes),) * 2) @ at_nodes).tocsr()


def changed_nodes(old: Nested, new: Nested) -> NDArray[np.int64]:
    """Numbers of the corners of new cells with a corner of a cell that the old ones did not have."""
    corners = new.nodes(np.arange(len(new.first)), 1, CORNER_STEPS[new.dim])
    present = np.isin(new.first, old.first)
    present[present] = old.width[np.searchsorted(old.first, new.first[present])] == new.width[present]
    near = np.isin(corners, corners[~present]).any(axis=1)
    return np.unique(corners[near])
