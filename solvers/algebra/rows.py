"""Transformations of rows of a distributed linear system, with rows that all processes have."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers.algebra.petsc_blocks import entry_rows, quick_to_multiply
from solvers.algebra.sparse import Sparse, sparse, sparse_from_entries, stack
from solvers.api import Array
from solvers.kernels import changed_rows


@dataclass(frozen=True)
class RowTransformation:
    """A change of a linear system J du = b in the rows of n dofs, [L (J + S) + A] du = L b + c; the same everywhere.

    L differs from the identity in columns of replaced rows only.
    """

    dofs: NDArray[np.int64]  #: global dof of each of the n, -1 for those that are no unknowns
    rows: Sparse  #: L, shape (n, n)
    stiffness: Sparse  #: S, shape (n, n)
    added: Sparse  #: A, shape (n, n)
    right: Array  #: c, shape (n,)
    replaced: NDArray[np.bool_]  #: mask of the rows that are replaced; others are only added to, shape (n,)


@dataclass(frozen=True)
class TakenRows:
    """Replaced rows of J and b as they were before the transformation."""

    at: NDArray[np.int64]  #: indices into the n dofs
    rows: Sparse  #: columns are all unknowns
    right: Array

    def balance(self, du: Array, n: int) -> Array:
        """J du - b at the n dofs, zero in other rows; du: of all unknowns."""
        found = np.zeros(n)
        found[self.at] = self.rows @ du - self.right
        return found


@dataclass(frozen=True)
class RowChanges:
    """Rows of a linear system to replace and to add to, the same on every process; columns: all unknowns."""

    replaced: NDArray[np.int64]  #: global rows to replace, each once
    replaced_rows: Sparse
    replaced_right: Array
    added: NDArray[np.int64]  #: global rows to add to, each once
    added_rows: Sparse
    added_right: Array


def transform_rows(
    matrix: PETSc.Mat, b: PETSc.Vec, change: RowTransformation, numbering: Numbering | None = None
) -> tuple[PETSc.Mat, TakenRows]:
    """Transform a linear system (collective). Returns the changed matrix and the replaced rows.

    b changes in place; `matrix` must not be used again. numbering: of a system of two blocks; the dofs are those of the
    first block.
    """
    comm, (start, end) = matrix.comm.tompi4py(), matrix.getOwnershipRange()
    unknowns, dofs = matrix.size[1], change.dofs
    at, own = np.flatnonzero(change.replaced), owned_rows(matrix)
    J = _on_all(comm, own, start, dofs[at])
    J = J if numbering is None else numbering.as_unknowns(J)
    taken = TakenRows(at, J, gather_at(comm, b.array[: end - start], start, dofs[at]))

    others = np.flatnonzero(~change.replaced & (dofs >= 0))
    stiffness, added = (part.with_columns(dofs, unknowns) for part in (change.stiffness, change.added))
    J = J + stiffness[at]
    rows = change.rows.columns(at)
    right = change.right + rows @ taken.right
    total = rows @ J + added
    changes = RowChanges(
        replaced=dofs[at],
        replaced_rows=total[at],
        replaced_right=right[at],
        added=dofs[others],
        added_rows=(total + stiffness)[others],
        added_right=right[others],
    )
    return change_rows(matrix, own, b, changes if numbering is None else numbering.renumbered(changes)), taken


def owned_rows(matrix: PETSc.Mat) -> Sparse:
    """The rows of this process with ordered columns; on one process a view of the matrix, not to be changed."""
    indptr, indices, data = entry_rows(matrix)
    rows = sparse((data, indices, indptr), (len(indptr) - 1, matrix.size[1]))
    return rows if matrix.getType() == PETSc.Mat.Type.SEQAIJ else rows.ordered()


def _on_all(comm: MPI.Comm, own: Sparse, start: int, rows: NDArray[np.int64]) -> Sparse:
    """Rows of a distributed matrix on every process, shape (len(rows), unknowns) (collective)."""
    if comm.size == 1:
        return own[rows]
    mine = rows[(rows >= start) & (rows < start + own.shape[0])]
    parts = comm.allgather((mine, own[mine - start]))
    order = np.argsort(np.concatenate([numbers for numbers, _ in parts]))
    return stack([part for _, part in parts])[order][np.argsort(np.argsort(rows))]


def change_rows(matrix: PETSc.Mat, own: Sparse, b: PETSc.Vec, changes: RowChanges) -> PETSc.Mat:
    """The changed matrix (collective). own: the rows of this process; b changes in place."""
    start, end = matrix.getOwnershipRange()

    def owned(rows: NDArray[np.int64]) -> NDArray[np.bool_]:
        return (rows >= start) & (rows < end)

    replace, add = owned(changes.replaced), owned(changes.added)
    replaced, added = changes.replaced[replace] - start, changes.added[add] - start
    more = changes.added_rows[add]
    some = np.diff(more.indptr) > 0  # most nodes of the surfaces are not near
    new = stack([changes.replaced_rows[replace], more[some]])
    changed = np.concatenate([replaced, added[some]]).astype(np.int32)
    rows = own.indptr, own.indices, own.data
    total = changed_rows(*rows, changed, len(replaced), new.indptr, new.indices, new.data)
    right = b.array
    right[replaced] = changes.replaced_right[replace]
    right[added] += changes.added_right[add]
    return distributed(sparse(total, own.shape), matrix.getSizes(), matrix.comm)


def distributed(own: Sparse, sizes, comm) -> PETSc.Mat:
    """A matrix from the rows of each process (collective). On one process it uses their arrays without a copy."""
    indptr, indices = (part.astype(PETSc.IntType, copy=False) for part in (own.indptr, own.indices))
    if comm.size == 1:
        matrix = PETSc.Mat().createAIJWithArrays(sizes, (indptr, indices, own.data), comm=comm)
        matrix.setOption(PETSc.Mat.Option.NEW_NONZERO_ALLOCATION_ERR, False)  # a held dof may get a diagonal entry
        return quick_to_multiply(matrix)
    return PETSc.Mat().createAIJ(sizes, csr=(indptr, indices, own.data), comm=comm)


def from_entries(
    comm: MPI.Comm, owned: tuple[int, int], rows: NDArray[np.int64], columns: NDArray[np.int64], data: Array
) -> PETSc.Mat:
    """A matrix from entries of any process, which add up; owned: counts of owned rows and columns (collective)."""
    end = comm.scan(owned[0])  # type: ignore[attr-defined]
    start = end - owned[0]
    if comm.size > 1:
        mine = (rows >= start) & (rows < end)
        foreign = comm.allgather((rows[~mine], columns[~mine], data[~mine]))
        rows, columns, data = (
            np.concatenate([own[mine], *(part[i] for part in foreign)]) for i, own in enumerate((rows, columns, data))
        )
        mine = (rows >= start) & (rows < end)
        rows, columns, data = rows[mine], columns[mine], data[mine]
    own = sparse_from_entries(rows - start, columns, data, (owned[0], comm.allreduce(owned[1])))
    return distributed(own, ((owned[0], None), (owned[1], None)), comm)


class Numbering:
    """Numbering of a system of two blocks: each process has the columns of the first block, then of the second.

    Outside of the system, the unknowns are those of the first block on all processes, then those of the second.
    """

    def __init__(self, comm: MPI.Comm, first: int, second: int):
        """first, second: counts of owned unknowns of the blocks (collective)."""
        sizes = np.array(comm.allgather((first, second)), dtype=np.int64)
        starts = np.concatenate([[0], np.cumsum(sizes.sum(axis=1))])[:-1]
        #: column in the system of each unknown
        self.placed = np.concatenate(
            [start + np.arange(own) for start, own in zip(starts, sizes[:, 0], strict=True)]
            + [start + own[0] + np.arange(own[1]) for start, own in zip(starts, sizes, strict=True)]
        ).astype(np.int64)
        self._unknown = np.argsort(self.placed)
        start = int(starts[comm.rank])
        self.first = PETSc.IS().createStride(first, start, 1, comm=comm)
        self.second = PETSc.IS().createStride(second, start + first, 1, comm=comm)

    def as_unknowns(self, rows: Sparse) -> Sparse:
        """Rows of a matrix of the system, with columns numbered as unknowns."""
        return rows.with_columns(self._unknown, rows.shape[1])

    def renumbered(self, changes: RowChanges) -> RowChanges:
        """Changes with columns numbered as unknowns, renumbered for a matrix of the system."""

        def columns(rows: Sparse) -> Sparse:
            return rows.with_columns(self.placed, rows.shape[1])

        return replace(changes, replaced_rows=columns(changes.replaced_rows), added_rows=columns(changes.added_rows))

    def split(self, matrix: PETSc.Mat) -> tuple[PETSc.Mat, PETSc.Mat]:
        """(columns of the first block, columns of the second) of a matrix (collective)."""
        rows = PETSc.IS().createStride(matrix.getLocalSize()[0], matrix.getOwnershipRange()[0], 1, comm=matrix.comm)
        return matrix.createSubMatrix(rows, self.first), matrix.createSubMatrix(rows, self.second)

    def gather(self, comm: MPI.Comm, system: Array) -> Array:
        """Values of all unknowns from the owned ones of the system (collective)."""
        return gather(comm, system)[self.placed]


def gather(comm: MPI.Comm, owned: Array) -> Array:
    """The whole of a distributed array on every process (collective)."""
    if comm.size == 1:
        return owned
    return np.concatenate(comm.allgather(owned))


def gather_at(comm: MPI.Comm, owned: Array, start: int, dofs: NDArray[np.int64]) -> Array:
    """Values at global dofs on every process, zero where the dof is -1; same shape as `dofs` (collective)."""
    if comm.size == 1:
        return np.where(dofs >= 0, owned[dofs], 0.0)
    local = dofs - start
    mine = (local >= 0) & (local < len(owned)) & (dofs >= 0)
    values = np.zeros(dofs.shape)
    values[mine] = owned[local[mine]]
    return comm.allreduce(values)
