"""The tangent of a structure: the static tangents of its bodies, and the matrix that a time scheme adds."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from petsc4py import PETSc

from solvers.algebra.blocks import block_diagonal
from solvers.algebra.petsc_blocks import BlockRows, has_entries_of, write_entries
from solvers.api import Array
from solvers.structure.body import Body
from solvers.structure.instant import MovingStructure
from solvers.structure.time_scheme import TimeScheme


class Tangent:
    """Assembles d(balance)/du = w K + D: K the static tangent, w and D by the time scheme."""

    def __init__(self, bodies: Sequence[Body]):
        self._bodies = list(bodies)
        self._matrices = [body.create_tangent() for body in bodies]
        self._combined: PETSc.Mat | None = None
        self._dynamic: tuple[TimeScheme, float, PETSc.Mat | None] | None = None  # D, with its scheme and step

    def resistance(self, t: float) -> Array:
        """Stiffness [N/m] that owned dofs resist a contact with, at the time t [s] of the loads (collective).

        That is the diagonal of K, times E* over the modulus of a change of volume that it contains (`of_surfaces`).
        """
        self._assemble_bodies(t)
        parts = zip(self._matrices, self._bodies, strict=True)
        return np.concatenate([matrix.getDiagonal().array * of_surfaces(matrix, body) for matrix, body in parts])

    def assemble(self, structure: MovingStructure, time: TimeScheme) -> PETSc.Mat:
        """The tangent without supports; the next call overwrites the matrix (collective)."""
        weight, added = time.force_weight, self._added(structure, time)
        if self._combined is None or not self._write(self._combined, structure.current.t, weight):
            self._assemble_bodies(structure.current.t)
            self._combined = block_diagonal(self._matrices, self._combined)
            if weight != 1.0:
                self._combined.scale(weight)
        if added is not None:
            self._combined.axpy(1.0, added, PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
        slope = None if structure.damping is None else time.damping_slope(structure, structure.current.dt)
        if structure.damping is not None and slope is not None:
            structure.damping.add_tangent(self._combined, structure.now.v, slope, weight)
        return self._combined

    def forget(self) -> None:
        """Compute D anew: mass and damping have changed."""
        self._dynamic = None

    def _write(self, matrix: PETSc.Mat, t: float, weight: float) -> bool:
        """Write the weighted blocks of all bodies into the matrix, with the same entries; False if some has none."""
        parts: list[BlockRows] = []
        for body in self._bodies:
            blocks = body.tangent_blocks(t)
            if blocks is None:
                return False
            parts.append(blocks)
        if not has_entries_of(matrix, *parts):
            return False
        write_entries(matrix, *parts, factor=weight)
        return True

    def _assemble_bodies(self, t: float) -> None:
        for body, matrix in zip(self._bodies, self._matrices, strict=True):
            body.assemble_tangent(matrix, t)

    def _added(self, structure: MovingStructure, time: TimeScheme) -> PETSc.Mat | None:
        """D, computed again when the scheme or the length of the step changes."""
        scheme, dt, _ = self._dynamic or (None, 0.0, None)
        if scheme is not time or dt != structure.current.dt:
            self._dynamic = time, structure.current.dt, time.dynamic_stiffness(structure, structure.current.dt)
        assert self._dynamic is not None
        return self._dynamic[2]


def of_surfaces(matrix: PETSc.Mat, body: Body) -> float:
    """Modulus of a half-space against that of uniaxial strain, E* / M = 4 (G / M) (1 - G / M), of a body (collective).

    A surface escapes sideways: E* = 4 G (M - G) / M stays finite where the material is nearly incompressible and
    M = lambda + 2 G is not. G and M are those of the energies u K u of uniform strains: means over the body.
    Source: Johnson, Contact Mechanics (1985), section 2.2, for E* = E / (1 - nu^2).
    """
    dim, u, comm = body.domain.dim, matrix.createVecRight(), body.domain.comm
    x, force = body.points[:dim, : body.owned], u.duplicate()
    x = x - comm.allreduce(x.sum(axis=1))[:, None] * dim / u.getSize()  # from the mean node

    def energy(strain: Array) -> float:
        u.array[:] = (strain @ x).T.ravel()
        matrix.mult(u, force)
        return float(force.dot(u))

    axes, pairs = np.eye(dim), list(combinations(range(dim), 2))
    uniaxial = sum(energy(np.outer(e, e)) for e in axes) / dim
    shear = sum(energy((np.outer(axes[i], axes[j]) + np.outer(axes[j], axes[i])) / 2.0) for i, j in pairs) / len(pairs)
    ratio = min(shear / uniaxial, 0.5) if uniaxial > 0.0 < shear else 0.5  # of an unstable material: as it is
    return 4.0 * ratio * (1.0 - ratio)
