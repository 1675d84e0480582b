"""Bodies that cross more than a cell in a time step."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from solvers.fluid.grid import Grid
    from solvers.fluid.surface import Motion

#: Cells per step up to which nothing is said. The drag of a disc of 8 cells at Reynolds number 40 is off by 1.1 % with
#: 2 cells per step, less than it varies on its way with short steps, and by 15 % with 3 (docs/verification_fluid.md).
MOST_CELLS = 2.0


def cells_per_step(grid: Grid, velocity: np.ndarray, dt: float) -> float:
    """Largest |v_i| dt / h_i over velocities [m/s] of the shape (n, dim), h_i the smallest cell in each direction."""
    smallest = np.array([float(np.diff(edge).min()) for edge in grid.edges])
    return float((np.abs(velocity) / smallest).max(initial=0.0)) * dt


def warning(name: str, cells: float, dt: float) -> str:
    """The warning about a body that crosses so many cells in a step of this size [s]."""
    return (
        f"body '{name}' crosses {cells:.2g} cells in a time step: the velocity is extrapolated to the cells that it "
        "leaves, and forces are inaccurate; "
        f"a step below {MOST_CELLS * dt / cells:.2g} keeps it below {MOST_CELLS:g} cells"
    )


class FastBodies:
    """Warns of each body that is too fast, again only when it is twice as fast."""

    def __init__(self, grid: Grid):
        self._grid = grid
        self._said: dict[str, float] = {}

    def notes(self, motions: Mapping[str, Motion], dt: float) -> list[str]:
        """What is new at the end of a step."""
        found = []
        for name, motion in motions.items():
            cells = cells_per_step(self._grid, motion.v, dt)
            if cells > max(MOST_CELLS, 2.0 * self._said.get(name, 0.0)):
                self._said[name] = cells
                found.append(warning(name, cells, dt))
        return found
