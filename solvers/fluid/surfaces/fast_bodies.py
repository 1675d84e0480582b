"""Warnings of bodies that cross more than two cells in a time step."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from solvers.fluid.grid.box import Grid
    from solvers.fluid.surfaces.surface import Motion

#: Cells per step above which there is a warning. The error of the drag of a disc of 8 cells at Reynolds number 40 is
#: 1.1 % with 2 cells per step, less than its variation along the grid with short steps, and 15 % with 3
#: (docs/verification_fluid.md).
MOST_CELLS_PASSED = 2.0


def cells_per_step(grid: Grid, velocity: np.ndarray, dt: float) -> float:
    """Largest |v_i| dt / h_i over velocities [m/s] of the shape (n, dim), h_i the smallest cell in each direction."""
    smallest = np.array([float(np.diff(edge).min()) for edge in grid.edges])
    return float((np.abs(velocity) / smallest).max(initial=0.0)) * dt


def warning(name: str, cells: float, dt: float) -> str:
    """The warning about a body that crosses so many cells in a step of this size [s]."""
    return (
        f"body '{name}' crosses {cells:.2g} cells in a time step: the velocity is extrapolated to the cells that it "
        "leaves, and forces are inaccurate; "
        f"a step below {MOST_CELLS_PASSED * dt / cells:.2g} keeps it below {MOST_CELLS_PASSED:g} cells"
    )


class FastBodies:
    """Warns once of each body that is too fast, and again when it is twice as fast."""

    def __init__(self, grid: Grid):
        self._grid = grid
        self._warned: dict[str, float] = {}  #: cells per step in the last warning, by name of the body

    def notes(self, motions: Mapping[str, Motion], dt: float) -> list[str]:
        """New warnings at the end of a step of length dt [s]; motions: by name of the body."""
        found = []
        for name, motion in motions.items():
            cells = cells_per_step(self._grid, motion.v, dt)
            if cells > max(MOST_CELLS_PASSED, 2.0 * self._warned.get(name, 0.0)):
                self._warned[name] = cells
                found.append(warning(name, cells, dt))
        return found
