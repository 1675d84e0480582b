"""The exchange of mass when contact pairs appear or disappear: their surfaces lose their mass, or get it back.

Nodes that have become massless move to their equilibrium first. Each free piece keeps the velocity of its centre and
its angular momentum; what its velocities have besides this rigid motion is scaled such that kinetic and internal energy
of the body stay together. Then accelerations follow from the balance.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from solvers.api import Array
from solvers.structure.time_scheme import ExchangingStructure

#: Factors by which velocities besides rigid motion may be scaled; more or less energy than that is lost or gained.
#: They bound rounding errors that would be scaled where bodies hardly vibrate: a bouncing disc has the same energies to
#: 1e-4 with bounds from (0.9, 1.1) to (0.0005, 2000).
LEAST_SCALE, MOST_SCALE = 0.5, 2.0


def exchange(
    structure: ExchangingStructure, switch: Callable[[], None], settle: Callable[[NDArray[np.int64]], None]
) -> None:
    """Let `switch` choose other pairs at the present time (collective). Raises StepFailed.

    settle: moves nodes that have become massless, owned dofs, to their equilibrium.
    """
    comm, piece, count = structure.comm, structure.pieces.of_nodes, structure.pieces.count
    before, energy = structure.inertia.of_pieces(), _internal(structure)
    frame = before.frame(structure.now.u)
    motion = before.split(frame, structure.now.v)
    massless = _mask(structure)
    switch()
    structure.forget_mass()
    now_massless = _mask(structure)
    changed = _any_by_piece(comm, now_massless != massless, piece, count)
    changed &= ~_any_by_piece(comm, structure.held.free_part(np.ones(len(massless))) != 1.0, piece, count)
    structure.assemble()
    if comm.allreduce(bool((now_massless & ~massless).any()), op=MPI.LOR):
        settle(np.flatnonzero(now_massless & ~massless))
    after = structure.inertia.of_pieces()
    frame = after.frame(structure.now.u)
    rest = after.split(frame, structure.now.v)
    gained = after.split(frame, after.joined(frame, motion, rest.velocities)).energy - motion.energy
    freed = energy - _internal(structure)
    factors = np.ones(count)
    for body, own in enumerate(_pieces_of_bodies(structure)):
        own = own[changed[own]]
        have = float(rest.energy_of_rest[own].sum())
        wanted = have + float(freed[body]) - float(gained[own].sum())
        factor = np.sqrt(max(wanted, 0.0) / have) if have > 0.0 else 1.0
        factors[own] = np.clip(factor, LEAST_SCALE, MOST_SCALE)
    at = piece.repeat(structure.bodies[0].dim)
    v = after.joined(frame, motion, factors[at] * rest.velocities)
    structure.now.v[changed[at]] = v[changed[at]]


def _pieces_of_bodies(structure: ExchangingStructure) -> list[NDArray[np.int64]]:
    """Numbers of the pieces of each body (collective)."""
    ends = np.cumsum([body.owned for body in structure.bodies])[:-1]
    parts = np.split(structure.pieces.of_nodes, ends)
    return [np.unique(np.concatenate(structure.comm.allgather(part))) for part in parts]


def _internal(structure: ExchangingStructure) -> Array:
    """Internal energy [J] of each body (collective)."""
    return np.array([body.internal_energy() for body in structure.bodies])


def _mask(structure: ExchangingStructure) -> NDArray[np.bool_]:
    mask = np.zeros(structure.layout.size, dtype=bool)
    mask[structure.inertia.find_massless()] = True
    return mask


def _any_by_piece(comm: MPI.Comm, dofs: NDArray[np.bool_], piece: NDArray[np.int64], count: int) -> NDArray[np.bool_]:
    nodes = dofs.reshape(len(piece), -1).any(axis=1) if len(piece) else np.zeros(0, dtype=bool)
    return comm.allreduce(np.bincount(piece[nodes], minlength=count)) > 0
