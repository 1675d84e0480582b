"""Grids on which single steps of multigrid's smoothers diverge in steady flow."""

from __future__ import annotations

import numpy as np

from solvers.fluid.grid.box import Grid
from solvers.fluid.grid.nested import Nested

#: Longest over shortest edge of a cell from which on they diverge. Around spheres in Stokes and faster flow they
#: converge at 3 in 11 iterations, and do not at 4 and at 6. Stronger smoothers take 6 instead of 11 iterations, and a
#: tenth to a third more time, so that too small a number costs little.
STRETCHED = 3.0


def is_rough(grid: Grid, *, convection: bool) -> bool:
    """Whether cells are stretched, or nested in a flow with convection, whose coarse cells do not resolve wakes."""
    sizes = [np.diff(edge) for edge in grid.edges]
    pairs = [(one, other) for i, one in enumerate(sizes) for j, other in enumerate(sizes) if i != j]
    longest = max(float(one.max() / other.min()) for one, other in pairs)
    return longest > STRETCHED or (convection and isinstance(grid, Nested))
