"""The inertia of all bodies: where their mass is while surfaces have none, and what it lacks for rigid motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers.algebra.blocks import block_diagonal, times
from solvers.api import Array
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
        self._comm, self._bodies, self._pieces, self._search = comm, bodies, pieces, find_massless
        self._found: tuple[NDArray[np.int64], NDArray[np.int64]] | None = None  #: massless and impulsive dofs
        self._moves_mass = False  #: any dof on any process is massless
        self._all_mass: PETSc.Mat | None = None
        self._mass: PETSc.Mat | None = None
        self._rigid: RigidInertia | None = None
        self.frame: Frames | None = None  #: of `find_rigid` at the present iterate
        self.momenta: Momenta | None = None  #: of `find_rigid` at the start of the step

    def _find(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        if self._found is None:
            self._found = self._search()
            self._moves_mass = self._comm.allreduce(bool(len(self._found[0])), op=MPI.LOR)
        return self._found

    def find_massless(self) -> NDArray[np.int64]:
        """Owned dofs without mass (collective)."""
        return self._find()[0]

    def find_impulsive(self) -> NDArray[np.int64]:
        """Owned dofs of pieces that touch with nodes that have mass (collective)."""
        return self._find()[1]

    def moves_mass(self) -> bool:
        """Whether any dof is massless (collective)."""
        self._find()
        return self._moves_mass

    def _assemble_all(self) -> PETSc.Mat:
        if self._all_mass is None:
            self._all_mass = block_diagonal([body.mass() for body in self._bodies])
        return self._all_mass

    def assemble_mass(self) -> PETSc.Mat:
        """Mass matrix of all bodies [kg], without that of massless dofs; once for each set of them (collective)."""
        if self._mass is None:
            self._mass = self._assemble_all()
            if self.moves_mass():
                massless = np.isin(np.arange(len(self._pieces.of_dofs)), self.find_massless())
                self._mass = without_mass(self._mass, massless, self._pieces.of_nodes, self._pieces.count)
        return self._mass

    def find_rigid(self) -> RigidInertia | None:
        """What `assemble_mass` lacks for rigid motion; None if no dofs are massless (collective)."""
        if self._rigid is None and self.moves_mass():
            self._rigid = self.of_pieces()
        return self._rigid

    def of_pieces(self) -> RigidInertia:
        """The inertia of all pieces, of those with all of their mass, too."""
        dim = self._bodies[0].dim
        points = np.concatenate([body.points[:dim, : body.owned].T for body in self._bodies])
        turns = np.repeat([not body.linear for body in self._bodies], [body.owned for body in self._bodies])
        pieces = self._pieces.of_nodes, self._pieces.count
        return RigidInertia(self._comm, self._assemble_all(), self.assemble_mass(), points, pieces, turns)

    def forget(self) -> None:
        """Find the massless nodes anew, and all that follows from them."""
        self._found = self._mass = self._rigid = None

    def find_frame(self, u: Array) -> None:
        """Set `frame` at the displacement u [m]."""
        rigid = self.find_rigid()
        self.frame = None if rigid is None else rigid.frame(u)

    def begin_step(self, v: Array, a: Array, force: Array) -> None:
        """Set `momenta` by the motion at the start of a step; force: of inertia that the mass matrix lacks [N]."""
        rigid = self.find_rigid()
        if rigid is not None and self.frame is not None:
            self.momenta = rigid.momenta(self.frame, v, a, force)

    def times(self, v: Array) -> Array:
        """The true mass times a field at owned dofs, as the momentum of a velocity [kg m/s]."""
        product, rigid = times(self.assemble_mass(), v), self.find_rigid()
        return product if rigid is None or self.frame is None else product + rigid.times(self.frame, v)

    def energy(self, v: Array) -> float:
        """Kinetic energy [J] of the velocity v [m/s] (collective)."""
        energy, rigid = 0.5 * self._comm.allreduce(float(v @ times(self.assemble_mass(), v))), self.find_rigid()
        return energy if rigid is None or self.frame is None else energy + rigid.energy(self.frame, v)


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
