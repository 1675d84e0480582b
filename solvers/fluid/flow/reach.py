"""Limits of the motion of bodies in a step: cells with earlier velocities, cells of the finest level, periods."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from solvers.api import FailureKind, NoResidual, StepFailed
from solvers.fluid.cut.cut import Cut, Cutter
from solvers.fluid.flow.moving_bodies import MovingBodies
from solvers.fluid.grid.nested import FINE_LAYERS
from solvers.fluid.mesh.distributed_grid import DistributedGrid
from solvers.fluid.mesh.space import Unknowns
from solvers.fluid.settings.time_scheme import FlowStep
from solvers.fluid.surfaces.surface import Motion


class StepInMotion(Protocol):
    """The state at the beginning of a step."""

    @property
    def motions(self) -> tuple[Motion, ...]: ...

    @property
    def layers(self) -> int: ...


class FlowInMotion(Protocol):
    """A flow around bodies that have moved since the step began."""

    current: FlowStep
    smallest_cell: float

    @property
    def unknowns(self) -> Unknowns: ...

    @property
    def moving(self) -> MovingBodies: ...

    @property
    def began(self) -> StepInMotion | None: ...


def strip_layers(grid: DistributedGrid, motion: Motion, time: float, smallest: float) -> int:
    """Layers of cells that surfaces may uncover within some time [s]; smallest: shortest edge of a cell [m]."""
    fastest = float(np.linalg.norm(motion.v, axis=1).max(initial=0.0))
    layers = 1.25 * time * fastest / smallest
    return math.ceil(min(max(1.0, layers), max(grid.grid.shape)))  # the grid has no more layers


def require_history(fluid: FlowInMotion, cut: Cut, missing: NDArray[np.bool_]) -> None:
    """Raise StepFailed if a cell with fluid has no velocity from an earlier step (collective).

    missing: mask of local dofs without one.
    """
    unknowns = fluid.unknowns
    blocks = np.zeros(unknowns.local // unknowns.block_size, dtype=bool)
    blocks[unknowns.cell_blocks[np.concatenate([cut.uncut, cut.cut])]] = True
    used = unknowns.expand(blocks) & unknowns.velocity_mask
    nodes = unknowns.velocity
    without = nodes.points[(used & missing)[nodes.dofs[:, 0]]]
    places = [place for place in unknowns.grid.comm.allgather(without[:1].tolist()) if place]
    if places:
        assert fluid.began is not None
        raise moved_too_far(fluid, max(fluid.began.layers, 1), tuple(places[0][0]))


def moved_too_far(fluid: FlowInMotion, cells: int, place: tuple[float, ...] | None = None) -> NoResidual:
    """The failure of a step in which a body moved by more than some cells, or else fluid appears at a place [m].

    A body that another field moves is where an iterate has it. Its velocity when the step began says whether it moves
    as far, or the iteration diverges.
    """
    assert fluid.began is not None
    ways = [
        np.abs(now.x - before.x).max(axis=1) if len(before.x) else np.zeros(1)
        for now, before in zip(fluid.moving.motions, fluid.began.motions, strict=False)
    ]
    farthest = int(np.argmax([way.max() for way in ways])) if ways else 0
    way = float(ways[farthest].max()) / fluid.smallest_cell if ways else 0.0
    if way <= cells and place is not None:
        where = ", ".join(f"{x:.4g}" for x in place)
        reason = f"fluid appears near ({where}) where there was none, though no body moved by more than {cells} cells"
        return NoResidual(
            "fluid", FailureKind.MOTION, f"{reason}: take a smaller time step, or finer cells there", where=place
        )
    body, vertex = fluid.moving.bodies[farthest], int(ways[farthest].argmax())
    name, at = body.surface.name, tuple(fluid.moving.motions[farthest].x[vertex].tolist())
    fastest = float(np.linalg.norm(fluid.began.motions[farthest].v, axis=1).max(initial=0.0))
    own = fastest * fluid.current.dt / fluid.smallest_cell
    if body.motion is None and own <= cells:
        reason = (
            f"an iterate had body '{name}' {way:.3g} cells from where the step began, of which its velocity explains "
            f"{own:.2g}: the iteration diverged, or the load of the step is too sudden; velocities are extrapolated to "
            f"{cells} behind its surface"
        )
        return NoResidual("fluid", FailureKind.DIVERGED, reason, where=at)
    reason = (
        f"body '{name}' moved by {way:.3g} cells in one step; velocities are "
        f"extrapolated to {cells} behind its surface: take a time step below {fluid.current.dt * cells / way:.2g}"
    )
    return NoResidual("fluid", FailureKind.MOTION, reason, where=at)


def require_finest(cutter: Cutter, comm: MPI.Comm) -> None:
    """Raise StepFailed if bodies are close to cells that are not of the finest level (collective).

    The roots of poorly cut nodes must not have hanging nodes.
    """
    if cutter.grid.nested is not None and comm.allreduce(cutter.on_coarse_cells(FINE_LAYERS), op=MPI.LOR):
        reason = (
            f"a body comes within {FINE_LAYERS} cells of cells that are not of the finest level: "
            "refine where it is and where it goes"
        )
        raise StepFailed("fluid", FailureKind.COARSE_CELLS, reason)
