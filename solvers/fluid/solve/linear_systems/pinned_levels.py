"""The coarsest matrix of multigrid where the flow leaves pressure levels to bodies: regular, by one entry for each.

With A z = 0 and z^T A = 0 the system (A + s e e^T) y = r has the solution of A y = r with y e = 0, for each r without a
source, z^T r = 0. What rounding errors leave of a source is divided by s, and not by the last pivot of A, which is of
rounding errors, too: it was 1e-35, and the level of 1e18 that followed left nothing of the other digits.
Source: Bochev, Lehoucq, SIAM Review 47 (2005) 50-66, section 3.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from solvers.api import Array


def pinned(coarsest: PETSc.Mat, levels: Array, interpolations: Sequence[PETSc.Mat]) -> PETSc.Mat:
    """A copy of the coarsest matrix with s e e^T for each level: e the unknown with most of it, s the sum of its row.

    levels: 1 at owned unknowns of the finest matrix, shape (owned, levels); interpolations: finest first. Collective.
    """
    changed, comm = coarsest.copy(), coarsest.comm.tompi4py()
    starts, _, entries = coarsest.getValuesCSR()
    sums = np.add.reduceat(np.abs(entries), starts[:-1]) if len(entries) else np.zeros(0)  # every row has its diagonal
    added = changed.createVecs()[0]
    added.set(0.0)
    for level in levels.T:
        part = level
        for P in interpolations:
            coarse, fine = P.createVecs()
            fine.array[:] = part
            P.multTranspose(fine, coarse)
            part = coarse.array
        most, owner = comm.allreduce((float(part.max(initial=0.0)), -comm.rank), op=MPI.MAX)
        if owner == -comm.rank and most > 0.0:
            at = int(np.argmax(part))
            added.array[at] = sums[at]
    changed.setDiagonal(changed.getDiagonal() + added)
    return changed
