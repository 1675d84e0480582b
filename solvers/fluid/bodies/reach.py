"""Limits of the motion of bodies in a step: cells with earlier velocities, cells of the finest level, periods."""

from __future__ import annotations

import math

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from solvers.api import StepFailed
from solvers.fluid.background.grid import DistributedGrid
from solvers.fluid.background.nested import FINE_LAYERS
from solvers.fluid.background.space import Unknowns
from solvers.fluid.bodies.surface import Motion
from solvers.fluid.cutting.cut import Cut, Cutter
from solvers.fluid.cutting.pieces import NOTHING

TOO_FAR = (
    "a body moved farther in one step than velocities are extrapolated behind its surface: take a smaller time step"
)


def strip_layers(grid: DistributedGrid, motion: Motion, time: float, smallest: float) -> int:
    """Layers of cells that surfaces may uncover within some time [s]; smallest: shortest edge of a cell [m]."""
    fastest = float(np.linalg.norm(motion.v, axis=1).max(initial=0.0))
    layers = 1.25 * time * fastest / smallest
    return math.ceil(min(max(1.0, layers), max(grid.grid.shape)))  # the grid has no more layers


def require_history(unknowns: Unknowns, cut: Cut, missing: NDArray[np.bool_]) -> None:
    """Raise StepFailed if a cell with fluid has no velocity from an earlier step (collective).

    missing: mask of local dofs without one.
    """
    blocks = np.zeros(unknowns.local // unknowns.block_size, dtype=bool)
    blocks[unknowns.cell_blocks[np.concatenate([cut.uncut, cut.cut])]] = True
    used = unknowns.expand(blocks) & unknowns.velocity_mask
    if unknowns.grid.comm.allreduce(bool((used & missing).any()), op=MPI.LOR):
        raise StepFailed("fluid", TOO_FAR)


def require_finest(cutter: Cutter, comm: MPI.Comm) -> None:
    """Raise StepFailed if bodies are close to cells that are not of the finest level (collective).

    The roots of poorly cut nodes must not have hanging nodes.
    """
    if cutter.grid.nested is not None and comm.allreduce(cutter.on_coarse_cells(FINE_LAYERS), op=MPI.LOR):
        reason = (
            f"a body comes within {FINE_LAYERS} cells of cells that are not of the finest level: "
            "refine where it is and where it goes"
        )
        raise StepFailed("fluid", reason)


def require_within_period(unknowns: Unknowns, cut: Cut) -> None:
    """Raise StepFailed if a body reaches a periodic face: it would not cut cells at the opposite face (collective)."""
    grid = unknowns.grid
    changed = cut.fraction < 1.0 - NOTHING
    changed[np.concatenate([cut.cut, cut.strip])] = True
    indices = np.unravel_index(grid.numbers[changed], grid.grid.shape, order="F")
    for axis in unknowns.periodic:
        at_end = np.isin(indices[axis], [0, grid.grid.shape[axis] - 1]).any()
        if grid.comm.allreduce(bool(at_end), op=MPI.LOR):
            faces = f"{'xyz'[axis]}- and {'xyz'[axis]}+"
            raise StepFailed("fluid", f"a body reaches the periodic faces {faces}: take a longer box, or end earlier")
