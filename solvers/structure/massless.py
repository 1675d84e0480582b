"""Massless contact surfaces: their mass is moved to the rest of the body.

A node with mass stops abruptly when it hits an obstacle. It loses its kinetic energy, and the contact force oscillates
from step to step, with an amplitude that increases as the step decreases. A surface without mass is in static
equilibrium with the body behind it: contact pressures are continuous in time, and impacts conserve energy.
Source: Khenous, Laborde & Renard, Eur. J. Mech. A/Solids 27 (2008).
"""

from __future__ import annotations

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers.api import Array
from solvers.structure.instant import Moving

#: Smallest factor of the density, relative to the mean one. For linear cells (F M + M F) / 2 is positive definite if
#: the ratio of the factors of neighbours is below 7 + 4 sqrt(3). The largest ratio in a body is about twice the inverse
#: of this number. It has an effect only on bodies with less than four layers of cells.
LEAST_FACTOR = 0.25

#: Mean square distance from the centre, over the square of the body's size, below which the body has no extent in a
#: direction: rounding errors.
NO_EXTENT = 1e-12


class NoMassLeft(ValueError):
    """All nodes of a body lie on slave surfaces."""

    def __init__(self, body: str):
        super().__init__(body)
        self.body = body


def massless_dofs(structure: Moving) -> list[NDArray[np.bool_]]:
    """Masks of the massless owned dofs of each body: those of all contact surfaces (collective).

    If these are all nodes of a body, such as a sheet of one cell between two others, only those of its slave surfaces.
    Raises NoMassLeft.
    """
    constraint = structure.constraint
    assert constraint is not None
    candidates = [constraint.touching_dofs(), constraint.multiplier_dofs()]
    parts = [np.split(_owned(structure, dofs), structure.layout.offsets[1:-1]) for dofs in candidates]
    found = []
    for body, *choices in zip(structure.bodies, *parts, strict=True):
        with_rest = [part for part in choices if structure.comm.allreduce(not part.all(), op=MPI.LOR)]
        if not with_rest:
            raise NoMassLeft(body.name)
        found.append(with_rest[0])
    return found


def _owned(structure: Moving, dofs: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Mask of the owned dofs of the structure that are among these global ones."""
    among = np.zeros(structure.layout.size, dtype=bool)
    among[structure.layout.among_owned(dofs)[1]] = True
    return among


def mass_matrices(structure: Moving) -> list[tuple[PETSc.Mat, PETSc.Mat | None]]:
    """(mass matrix [kg], its change by moved mass or None) of each body (collective)."""
    found: list[tuple[PETSc.Mat, PETSc.Mat | None]] = []
    marked = np.zeros(structure.layout.size, dtype=bool)
    marked[structure.massless] = True
    for body, massless in zip(structure.bodies, np.split(marked, structure.layout.offsets[1:-1]), strict=True):
        mass, moved = body.mass(), None
        if structure.comm.allreduce(bool(len(structure.massless)), op=MPI.LOR):
            consistent, points = mass, body.points[: body.dim, : body.owned].T
            mass, moved = move_mass_inwards(consistent, massless, points), consistent
            moved.aypx(-1.0, mass, PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
        found.append((mass, moved))
    return found


def move_mass_inwards(mass: PETSc.Mat, massless: NDArray[np.bool_], points: Array) -> PETSc.Mat:
    """The mass matrix [kg] of a body with massless surfaces, (F M' + M' F) / 2, with the pattern of M (collective).

    M' is the consistent matrix M without rows and columns of the massless dofs, and F the diagonal matrix of a factor f
    of the density that is linear in space. Mass and centre of mass are conserved:

        sum_ij p_i (F M' + M' F)_ij / 2 = sum_ij p_i M_ij    for p = 1, x, y, z.

    If a body has so few cells that the factor would be too small somewhere, the variation of the factor is reduced, and
    the centre of mass moves inwards.

    massless: owned dofs without mass, shape (n * dim,); points: reference positions [m] of the owned nodes, shape
    (n, dim).
    """
    comm = mass.comm.tompi4py()
    x, y = mass.createVecs("right"), mass.createVecs("left")

    def times(matrix: PETSc.Mat, array: Array) -> Array:
        x.array[:] = array
        matrix.mult(x, y)
        return y.array.copy()

    inside = mass.copy()
    x.array[:] = ~massless
    inside.diagonalScale(x, x)
    everywhere = np.ones(len(massless))
    rows, rows_before = times(inside, everywhere), times(mass, everywhere)
    total, total_before = comm.allreduce(np.array([rows.sum(), rows_before.sum()]))
    position = _positions(comm, points)
    position -= comm.allreduce(rows @ position) / total
    image = np.stack([0.5 * (rows * p + times(inside, p)) for p in position.T], axis=1)
    slopes = _solve(comm.allreduce(position.T @ image) / total, comm.allreduce(rows_before @ position) / total)
    mean = total_before / total
    x.array[:] = mean + _bounded(comm, position @ slopes, mean)
    matrix = inside.copy()
    matrix.diagonalScale(x, None)
    inside.diagonalScale(None, x)
    matrix.axpy(1.0, inside, PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
    matrix.scale(0.5)
    return matrix


def _positions(comm: MPI.Comm, points: Array) -> Array:
    """Positions at the owned dofs, divided by the size of the body, shape (owned dofs, dim)."""
    low = np.min(comm.allgather(points.min(axis=0, initial=np.inf)), axis=0)
    high = np.max(comm.allgather(points.max(axis=0, initial=-np.inf)), axis=0)
    return ((points - low) / (high - low).max()).repeat(points.shape[1], axis=0)


def _solve(matrix: Array, right: Array) -> Array:
    """Minimum-norm solution of a symmetric system; zero in directions without extent of mass."""
    values, vectors = np.linalg.eigh(matrix)
    inverse = np.divide(1.0, values, out=np.zeros_like(values), where=values > NO_EXTENT)
    return vectors @ (inverse * (vectors.T @ right))


def _bounded(comm: MPI.Comm, change: Array, mean: float) -> Array:
    """The change of the factor, scaled down if mean + change would be too small anywhere."""
    lowest = comm.allreduce(change.min(initial=0.0), op=MPI.MIN)
    most = (1.0 - LEAST_FACTOR) * mean
    return change if lowest >= -most else change * (most / -lowest)
