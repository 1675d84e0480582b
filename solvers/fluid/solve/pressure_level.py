"""The pressure level of pockets: fixed at one node in the linear system, without a source of volume at this node."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from solvers import fem
from solvers.api import Array, Mask
from solvers.fluid.cut.cut import Cut
from solvers.fluid.cut.pockets import Pocket, find_pockets
from solvers.fluid.mesh.distributed_grid import DistributedGrid
from solvers.fluid.solve.system import FlowSystem
from solvers.fluid.surfaces.immersed import ImmersedBody


@dataclass(frozen=True)
class Hold:
    """A pocket whose pressure level is held."""

    dofs: NDArray[np.int64]  #: owned dofs with rows of the identity: one on one process, none on the others
    inside: Mask  #: mask of its owned pressure dofs
    shares: Array  #: share of its fluid at each owned dof; their sum over all processes is one
    keeps_level: bool  #: the mean pressure is that of the time when the pocket closed; else zero at the node
    shares_before: Array  #: the same for nodes that had a pressure before; their sum is one or zero
    level: float  #: mean pressure at these nodes [Pa]
    elastic: bool  #: bounded by a surface that another field moves
    area: float  #: of a cube with the volume of its fluid [m^2] (2D: of a square [m])


class PressureLevels:
    """The pockets of the present cut whose pressure level is held; calls are collective."""

    def __init__(self, system: FlowSystem, bodies: Sequence[ImmersedBody]):
        self._system, self._comm = system, system.grid.comm
        self._elastic = np.concatenate([np.full(b.surface.vertices, b.deforms) for b in bodies] + [[]]) > 0.0
        self._holds: list[Hold] = []
        self._free: list[Mask] = []  #: owned pressure dofs of pockets whose level solids determine
        self._excess: list[float] = []  #: net flux out of each of them by the motion of its boundary [m^3/s]

    @property
    def unknown(self) -> bool:
        """Whether a level is held that an elastic body could determine."""
        return any(hold.elastic for hold in self._holds)

    def hold(self, held: Mask, *, set_by_solids: bool) -> None:
        """Find the pockets of a new cut and add a node of those that are held to the held owned dofs.

        set_by_solids: the equations of elastic bodies determine the level of their pockets, which are not held. In a
        closed box, the level of the largest pocket is zero at its node, if no elastic body is in it. Other levels are
        those of the last iterate.
        """
        pockets, closed = closed_pockets(self._system, self._elastic), self._system.boundary.closed()
        held_ones = [pocket for pocket in pockets if not (pocket.elastic and set_by_solids)]
        sizes = _pressure_sizes(self._system) if held_ones else np.empty(0)
        keeps_level = [pocket.elastic or not (closed and pocket.largest) for pocket in held_ones]
        self._holds = [_hold(self._system, *each, sizes) for each in zip(held_ones, keeps_level, strict=True)]
        self._free = [_inside(self._system, pocket) for pocket in pockets if pocket.elastic and set_by_solids]
        for hold in self._holds:
            held[hold.dofs] = True
            if not hold.keeps_level:
                self._system.flow.x.array[hold.dofs] = 0.0

    def free(self) -> Array | None:
        """The levels that solids determine, 1 at their owned dofs, shape (owned, levels); None: there are none."""
        return np.stack(self._free, axis=1).astype(float) if self._free else None

    def keep(self, flow: Array) -> None:
        """Shift the pressure, at owned dofs, of each pocket that keeps its level, so that its mean is kept.

        The linear system fixes it at one node. The result must not depend on the choice of this node. The mean pressure
        of a pocket that had none before, as it is there from the start, becomes zero.
        """
        for hold in self._holds:
            if hold.keeps_level:
                known = self._comm.allreduce(float(hold.shares_before.sum())) > 0.0
                shares = hold.shares_before if known else hold.shares
                flow[hold.inside] += hold.level - self._comm.allreduce(float(shares @ flow))

    def spread_excess(self, rows: Array) -> None:
        """Balance the net flux into each held pocket, in owned rows, by a uniform source in its fluid.

        Otherwise the fixed node would be a point source, which causes an error of the pressure that does not converge.
        """
        self._excess = [self._comm.allreduce(float(rows[hold.inside].sum())) for hold in self._holds]
        for hold, excess in zip(self._holds, self._excess, strict=True):
            rows -= excess * hold.shares

    def squeezed(self) -> Array:
        """Mean velocity [m/s] with which elastic bodies squeeze each of their pockets, at the last residual."""
        found = zip(self._holds, self._excess, strict=True)
        return np.array([-excess / hold.area for hold, excess in found if hold.elastic])

    def add(self, pressure: Array) -> None:
        """Add a pressure [Pa] to the level of each pocket of `squeezed`."""
        elastic = [hold for hold in self._holds if hold.elastic]
        for hold, more in zip(elastic, pressure, strict=True):
            self._system.flow.x.array[: len(hold.inside)][hold.inside] += more
        self._system.unknowns.share(self._system.flow)


def closed_pockets(system: FlowSystem, elastic: Mask) -> list[Pocket]:
    """The pockets of the present cut (collective); elastic: mask of vertices that another field moves."""
    closed = system.boundary.closed()
    if not (closed or system.with_bodies):
        return []
    assert system.cut is not None
    if not closed and not _in_fluid(system.grid, system.cut):
        return []
    return find_pockets(
        system.grid, system.cut, _coupled(system, system.cut), system.boundary.open_cells(), elastic,
        system.unknowns.periodic,
    )  # fmt: skip


def _coupled(system: FlowSystem, cut: Cut) -> NDArray[np.int32]:
    """Local cells that couple pressures: of the strips behind surfaces only where a ghost penalty acts on their faces.

    Values that are extended into strips couple nothing, also where the strips of two fluids meet within a wall.
    """
    if system.cut_penalty is None or system.cut_penalty.by_faces:
        return cut.active
    return np.sort(np.concatenate([cut.uncut, cut.cut]))


def _in_fluid(grid: DistributedGrid, cut: Cut) -> bool:
    """Whether bodies cut or cover any cell: those outside of the box close no pockets (collective)."""
    return bool(grid.comm.allreduce(len(cut.uncut) < len(grid.sizes), op=MPI.LOR))


def _pressure_sizes(system: FlowSystem) -> Array:
    """int q dx over the fluid for the shape function q of each owned pressure dof [m^dim] (collective)."""
    assert system.cut is not None
    grid, cut, unknowns, weights = system.grid, system.cut, system.unknowns, system.weights
    volume, (psi, _) = grid.sizes.prod(axis=1), weights.pressure_table
    uncut, mine = cut.uncut[cut.uncut < grid.owned], cut.cut < grid.owned
    cells = np.concatenate([uncut, cut.cut[mine]])
    fluid = np.concatenate([np.ones((len(uncut), len(weights.rule))), cut.fluid[mine][:, weights.order]])
    parts = volume[cells, None] * ((fluid * weights.rule) @ psi)
    size = np.bincount(unknowns.cell_pressure[cells].ravel(), parts.ravel(), unknowns.local).astype(float)
    fem.add_ghosts(unknowns.space, size)
    owned = size[: unknowns.owned]
    return owned if unknowns.hanging is None else unknowns.hanging.rows(owned)


def _inside(system: FlowSystem, pocket: Pocket) -> Mask:
    """Mask of the owned pressure dofs of a pocket (collective)."""
    unknowns = system.unknowns
    dofs = unknowns.pressure.dofs[: unknowns.pressure.owned, 0]
    found = np.zeros(unknowns.owned, dtype=bool)
    found[dofs] = system.dofs_of(np.flatnonzero(pocket.cells).astype(np.int32))[dofs]
    found &= system.active_dofs[: unknowns.owned]
    if unknowns.hanging is not None:
        found &= ~unknowns.hanging.dofs[: unknowns.owned]
    return found


def _hold(system: FlowSystem, pocket: Pocket, keep_level: bool, sizes: Array) -> Hold:
    """Hold a pocket at its first node in the lattice, if possible one that had a pressure before (collective)."""
    unknowns, comm = system.unknowns, system.grid.comm
    nodes, last = unknowns.pressure, np.iinfo(np.int64).max
    dofs = nodes.dofs[: nodes.owned, 0]
    inside = _inside(system, pocket)
    numbers = np.where(inside[dofs], nodes.numbers[: nodes.owned], last)
    had_pressure = np.where(system.flow.x.array[dofs] != 0.0, numbers, last)
    choices = [had_pressure, numbers] if keep_level else [numbers]
    smallest = [comm.allreduce(int(choice.min(initial=last)), op=MPI.MIN) for choice in choices]
    best = next((number for number in smallest if number < last), last)
    before = system.flow.x.array[: unknowns.owned]
    shares, shares_before = (_shares(comm, np.where(part, sizes, 0.0)) for part in (inside, inside & (before != 0.0)))
    at = dofs[nodes.numbers[: nodes.owned] == best].astype(np.int64)
    level = comm.allreduce(float(shares_before @ before))
    volume, dim = comm.allreduce(float(sizes[inside].sum())), system.grid.dim
    return Hold(at, inside, shares, keep_level, shares_before, level, pocket.elastic, volume ** ((dim - 1) / dim))


def _shares(comm: MPI.Comm, sizes: Array) -> Array:
    total = comm.allreduce(float(sizes.sum()))
    return sizes / total if total > 0.0 else sizes
