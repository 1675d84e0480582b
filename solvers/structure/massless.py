"""Surfaces without mass: that of their nodes is moved to the nodes behind them.

A node with mass that hits an obstacle has to stop at once: it loses its kinetic energy, and the force that stops it
rings from step to step, the more the smaller the step. Without mass, a surface follows the body behind it: pressures
are continuous in time, and impacts keep energy.
Source: Khenous, Laborde & Renard, Eur. J. Mech. A/Solids 27 (2008); Hager, Hueber & Wohlmuth, Int. J. Numer. Meth.
Engng 73 (2008).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc


def move_mass_inwards(mass: PETSc.Mat, surface: NDArray[np.int64]) -> tuple[PETSc.Mat, NDArray[np.int64]]:
    """(T^T M T, owned dofs without mass): the velocity T v of a surface node is a mean of those behind it.

    mass [kg]; surface: global dofs, the same on every process. The mean is weighted by the entries of M, so that T
    keeps a rigid translation: total mass and momentum stay, the centre of mass moves inwards by a part of a cell.
    A node with no node behind it keeps its mass. Collective.
    """
    start, end = mass.getOwnershipRange()
    on_surface = np.zeros(mass.size[1], dtype=bool)
    on_surface[surface] = True
    indptr, columns, entries = mass.getValuesCSR()
    rows = np.repeat(np.arange(end - start), np.diff(indptr))
    behind = np.where(on_surface[start + rows] & ~on_surface[columns], np.abs(entries), 0.0)
    total = np.bincount(rows, behind, minlength=end - start)
    massless = np.flatnonzero(total > 0.0)

    T = PETSc.Mat().createAIJ(mass.sizes, nnz=(np.diff(indptr).max(initial=0) + 1,) * 2, comm=mass.comm)
    kept = np.setdiff1d(np.arange(end - start), massless)
    for i in kept.tolist():
        T.setValue(start + i, start + i, 1.0)
    for i in massless.tolist():
        part = slice(indptr[i], indptr[i + 1])
        found = behind[part] > 0.0
        T.setValues([start + i], columns[part][found], behind[part][found] / total[i])
        T.setValue(start + i, start + i, 0.0)  # so that the diagonal has a place in T^T M T
    T.assemble()
    return mass.ptap(T), massless
