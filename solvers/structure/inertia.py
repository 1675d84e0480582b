"""The inertia of all bodies: where their mass is while surfaces have none, and what it lacks for rigid motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers.api import Array
from solvers.blocks import block_diagonal, times
from solvers.structure.body import Body
from solvers.structure.body_pieces import BodyPieces
from solvers.structure.rigid_inertia import Frames, Momenta, RigidInertia


class ElasticInertia:
    """Mass matrix, massless dofs, and inertia of rigid motion; all follow from the present contact pairs."""

    def __init__(
        self,
        comm: MPI.Comm,
        bodies: Sequence[Body],
        pieces: BodyPieces,
        find_massless: Callable[[], tuple[NDArray[np.int64], NDArray[np.int64]]],
    ):
        """find_massless: owned dofs without mass, and those of pieces that touch with nodes that have mass."""
        self._comm, self._bodies, self._pieces, self._find_massless = comm, bodies, pieces, find_massless
        self.frame: Frames | None = None  #: of `rigid` at the present iterate
        self.momenta: Momenta | None = None  #: of `rigid` at the start of the step

    @cached_property
    def _touching(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        return self._find_massless()

    @property
    def massless(self) -> NDArray[np.int64]:
        """Owned dofs without mass."""
        return self._touching[0]

    @property
    def impulsive(self) -> NDArray[np.int64]:
        """Owned dofs of pieces that touch with nodes that have mass."""
        return self._touching[1]

    @cached_property
    def moves_mass(self) -> bool:
        """Whether any dof is massless."""
        return self._comm.allreduce(bool(len(self.massless)), op=MPI.LOR)

    @cached_property
    def _all_mass(self) -> PETSc.Mat:
        return block_diagonal([body.mass() for body in self._bodies])

    @cached_property
    def mass(self) -> PETSc.Mat:
        """Mass matrix of all bodies [kg], without that of massless dofs."""
        if not self.moves_mass:
            return self._all_mass
        massless = np.isin(np.arange(len(self._pieces.of_dofs)), self.massless)
        return without_mass(self._all_mass, massless, self._pieces.of_nodes, self._pieces.count)

    @cached_property
    def rigid(self) -> RigidInertia | None:
        """What `mass` lacks for rigid motion; None if no dofs are massless."""
        return self.of_pieces() if self.moves_mass else None

    def of_pieces(self) -> RigidInertia:
        """The inertia of all pieces, of those with all of their mass, too."""
        dim = self._bodies[0].dim
        points = np.concatenate([body.points[:dim, : body.owned].T for body in self._bodies])
        turns = np.repeat([not body.linear for body in self._bodies], [body.owned for body in self._bodies])
        pieces = self._pieces.of_nodes, self._pieces.count
        return RigidInertia(self._comm, self._all_mass, self.mass, points, pieces, turns)

    def forget(self) -> None:
        """Find the massless nodes anew, and all that follows from them."""
        for name in ("_touching", "moves_mass", "mass", "rigid"):
            vars(self).pop(name, None)

    def find_frame(self, u: Array) -> None:
        """Set `frame` at the displacement u [m]."""
        self.frame = None if self.rigid is None else self.rigid.frame(u)

    def begin_step(self, v: Array, a: Array, force: Array) -> None:
        """Set `momenta` by the motion at the start of a step; force: the inertia force that `mass` lacks [N]."""
        if self.rigid is not None and self.frame is not None:
            self.momenta = self.rigid.momenta(self.frame, v, a, force)

    def times(self, v: Array) -> Array:
        """The true mass times a field at owned dofs, as the momentum of a velocity [kg m/s]."""
        product = times(self.mass, v)
        return product if self.rigid is None or self.frame is None else product + self.rigid.times(self.frame, v)

    def energy(self, v: Array) -> float:
        """Kinetic energy [J] of the velocity v [m/s] (collective)."""
        energy = 0.5 * self._comm.allreduce(float(v @ times(self.mass, v)))
        return energy if self.rigid is None or self.frame is None else energy + self.rigid.energy(self.frame, v)


def without_mass(mass: PETSc.Mat, massless: NDArray[np.bool_], piece: NDArray[np.int64], count: int) -> PETSc.Mat:
    """The mass matrix [kg] without rows and columns of massless dofs, scaled to the mass of each piece (collective).

    The pattern is that of `mass`. massless: owned dofs, shape (n dim,); piece: number of each owned node, shape (n,).
    """
    moved, scale = mass.copy(), mass.createVecLeft()
    scale.array[:] = ~massless
    moved.diagonalScale(scale, scale)
    at = piece.repeat(len(massless) // len(piece)) if len(piece) else piece
    ones = np.ones(len(massless))
    sums = np.stack([np.bincount(at, times(matrix, ones), count) for matrix in (mass, moved)])
    before, after = mass.comm.tompi4py().allreduce(sums)
    scale.array[:] = (before / after)[at]
    moved.diagonalScale(scale, None)
    return moved
