"""Gaps of a few cells in flows with first-order velocities: the flow that these velocities lack.

In a gap g with cells of height h, tau of the PSPG term is min(g, h)^2 / (12 mu) along the walls, less the share that
slip by Nitsche's method carries (6 / k, opposite a face of the box 3 / (k - 1), k = gamma C_T g / h). The ghost penalty
of the pressure is multiplied by eps min(1, (g / h)^3 / (12 gamma_p)); that of the velocity, where a plane of the grid
is in the gap, is increased until its share of the flow rate is below eps_v (docs/theory_fluid.md, Gaps with q1q1).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.fluid.cut.film import LEAST_RATIO, Walls, sizes_of, to_faces, to_walls, with_solid
from solvers.fluid.cut.images import Periods
from solvers.fluid.grid.box import FLUSH, Grid
from solvers.fluid.settings.penalties import TRACE, Penalties

#: Height of gaps in cells up to which the whole term acts, and from which on none: 16 % of the flow rate are missing
#: then, 1 / n^2. The drag at one cell is 1.135 to 1.088 times the exact one with (1.8, 2) to (3, 4).
FULL_HEIGHT, WIDEST_HEIGHT = 2.0, 2.5
#: eps, the largest share of the flow rate of the ghost penalty of the pressure. Drags are the same to 1 % from 3e-2 to
#: 3e-6.
SHARE_OF_FLOW = 3e-3
#: eps_v, the largest share of the flow rate of a kink of the velocity. Drags are the same to 0.5 % from 0.3 to 3e-4.
KINK = 0.03
#: Points along the normal of a wall, in shares of the gap, whose cells belong to the gap.
ALONG = np.linspace(0.0, 1.0, 5)
#: Largest share of the flow rate that is left to slip; reached at a gap of 0.013 cells.
MOST_SLIP = 0.9


@dataclass(frozen=True)
class NarrowGaps:
    """Cells in gaps, with what the terms need; numbers in the box, sorted."""

    cells: NDArray[np.int64]
    height: Array  #: g / h along the normal
    normal: Array  #: of the nearest wall, (cells, dim)
    length: Array  #: min(g, h) [m]
    reduced: Array  #: min(g, h) / h, at least `LEAST`: length over which Nitsche's penalty acts
    slip: Array  #: share of the flow rate that slips
    share: Array  #: of the term: 1 up to `FULL_HEIGHT` cells, 0 from `WIDEST_HEIGHT` cells on
    pressure: Array  #: factor of the ghost penalty of the pressure in all cells of the box
    across: Array  #: factor of that of the velocity, less 1, for jumps along each axis, (cells, dim)

    @property
    def tangents(self) -> Array:
        """Projectors I - n n^T, (cells, dim, dim)."""
        return np.eye(self.normal.shape[1]) - self.normal[:, :, None] * self.normal[:, None, :]

    def friction(self, viscosity: float) -> Array:
        """1 / tau = 12 mu / min(g, h)^2 without the slip [Pa s/m^2]."""
        return 12.0 * viscosity / (self.length**2 * (1.0 - self.slip))


@dataclass(frozen=True)
class GapFinder:
    """Faces of the box that are walls, and the factors of Nitsche's and the ghost penalty."""

    faces: Sequence[tuple[int, int]]  #: axis and side (0, 1)
    penalties: Penalties
    periodic: tuple[int, ...] = ()  #: axes of the box

    def __call__(self, grid: Grid, walls: Walls, solid: NDArray[np.bool_]) -> NarrowGaps | None:
        """The gaps between walls; None if there is none."""
        sizes, across = sizes_of(grid, walls)
        to_face = to_faces(grid, walls, self.faces)
        layers = int(np.ceil(WIDEST_HEIGHT))
        gap = np.minimum(to_face, to_walls(grid, walls, WIDEST_HEIGHT * across, layers, self.periodic))
        gap = np.maximum(gap, FLUSH * across)  # surfaces that touch
        near = np.flatnonzero(gap < (1.0 - FLUSH) * WIDEST_HEIGHT * across)
        if not len(near):
            return None
        near = near[np.argsort(gap[near] / across[near], kind="stable")]
        cell = np.concatenate([walls.cell[near], *(self._cells_at(grid, walls, near, gap, t) for t in ALONG[1:])])
        cells, first = np.unique(cell, return_index=True)
        of = near[first % len(near)]
        count = np.bincount(walls.cell[near], minlength=grid.size)[cells]
        total = np.bincount(walls.cell[near], gap[near], grid.size)[cells]
        g = np.where(count > 0, total / np.maximum(count, 1), gap[of])
        height, longest = g / across[of], sizes[of].max(axis=1)
        narrow, least = height < 1.0 + FLUSH, np.maximum(np.minimum(height, 1.0), LEAST_RATIO)
        k = self.penalties.nitsche * TRACE[grid.dim, 1] * height / least
        slip = np.where(to_face[of] <= gap[of], 3.0 / np.maximum(k - 1.0, 1.0), 6.0 / k)
        of_pressure = np.maximum(g / longest, LEAST_RATIO) ** 3 / (12.0 * self.penalties.ghost_pressure)
        pressure = np.ones(grid.size)
        pressure[cells] = np.where(narrow, SHARE_OF_FLOW * np.minimum(1.0, of_pressure), 1.0)
        kink = 3.0 / 16.0 / KINK / self.penalties.ghost_viscous * height - 1.0
        return NarrowGaps(
            cells,
            height,
            walls.n[of],
            np.minimum(g, across[of]),
            least,
            np.minimum(slip, MOST_SLIP),
            np.clip((WIDEST_HEIGHT - height) / (WIDEST_HEIGHT - FULL_HEIGHT), 0.0, 1.0),
            with_solid(grid, pressure, solid, self.periodic),
            np.where(narrow, np.maximum(kink, 0.0), 0.0)[:, None] * np.maximum(2.0 * walls.n[of] ** 2 - 1.0, 0.0),
        )

    def _cells_at(
        self, grid: Grid, walls: Walls, some: NDArray[np.int64], gap: Array, share: float
    ) -> NDArray[np.int64]:
        """Cells of the box at a share of the gap in front of some walls."""
        x = Periods(grid, self.periodic).within(walls.x[some] - share * gap[some, None] * walls.n[some])
        index = [
            np.clip(np.searchsorted(edge, x[:, axis]) - 1, 0, len(edge) - 2) for axis, edge in enumerate(grid.edges)
        ]
        return np.ravel_multi_index(tuple(index), grid.shape, order="F")
