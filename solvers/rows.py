"""Rows of a distributed matrix in the hands of every process: read some, replace some, add to some."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers.api import Array


@dataclass(frozen=True)
class RowTransformation:
    """A change of a linear system J du = b in the rows of n dofs: [L (J + S) + A] du = L b + c; same on every process.

    L differs from the identity in columns of replaced rows only.
    """

    dofs: NDArray[np.int64]  #: global dof of each of the n, -1 where it is no unknown
    rows: sp.csr_matrix  #: L, shape (n, n)
    stiffness: sp.csr_matrix  #: S, shape (n, n)
    added: sp.csr_matrix  #: A, shape (n, n)
    right: Array  #: c, shape (n,)
    replaced: NDArray[np.bool_]  #: whose rows are not what they were with something added, shape (n,)


@dataclass(frozen=True)
class TakenRows:
    """Rows of J and b as they were before the transformation, where they are needed again."""

    at: NDArray[np.int64]  #: which of the n dofs
    rows: sp.csr_matrix  #: columns are all unknowns
    right: Array

    def balance(self, du: Array, n: int) -> Array:
        """J du - b at the n dofs, zero where the rows were not taken; du of all unknowns."""
        found = np.zeros(n)
        found[self.at] = self.rows @ du - self.right
        return found


@dataclass(frozen=True)
class RowChanges:
    """Rows of a linear system to replace and to add to, the same on every process; columns are all unknowns."""

    replaced: NDArray[np.int64]  #: global rows to replace, each once
    replaced_rows: sp.csr_matrix
    replaced_right: Array
    added: NDArray[np.int64]  #: global rows to add to, each once
    added_rows: sp.csr_matrix
    added_right: Array


def transform_rows(
    matrix: PETSc.Mat, b: PETSc.Vec, change: RowTransformation, numbering: Numbering | None = None
) -> tuple[PETSc.Mat, TakenRows]:
    """The changed matrix, and the old rows that it consists of; `b` changes in place, `matrix` is used up. Collective.

    numbering: places the unknowns of a system of two blocks, of which the dofs belong to the first.
    """
    comm, (start, end) = matrix.comm.tompi4py(), matrix.getOwnershipRange()
    unknowns, dofs = matrix.size[1], change.dofs
    at = np.flatnonzero(change.replaced)
    J = fetch_rows(matrix, dofs[at]) if numbering is None else numbering.fetch_rows(matrix, dofs[at])
    taken = TakenRows(at, J, gather_at(comm, b.array[: end - start], start, dofs[at]))

    others = np.flatnonzero(~change.replaced & (dofs >= 0))
    stiffness, added = (place_columns(part, dofs, unknowns) for part in (change.stiffness, change.added))
    J = J + stiffness[at]
    rows, right = change.rows[:, at], change.right + change.rows[:, at] @ taken.right
    total = rows @ J + added
    changes = RowChanges(
        replaced=dofs[at],
        replaced_rows=total[at],
        replaced_right=right[at],
        added=dofs[others],
        added_rows=(total + stiffness)[others],
        added_right=right[others],
    )
    return change_rows(matrix, b, changes if numbering is None else numbering.place(changes)), taken


def place_columns(matrix: sp.csr_matrix, columns: NDArray[np.int64], unknowns: int) -> sp.csr_matrix:
    """Columns to their place among the unknowns; columns that are no unknowns (-1) drop out."""
    entries = matrix.tocoo()
    target = columns[entries.col]
    keep = target >= 0
    return sp.csr_matrix((entries.data[keep], (entries.row[keep], target[keep])), shape=(matrix.shape[0], unknowns))


def fetch_rows(matrix: PETSc.Mat, rows: NDArray[np.int64]) -> sp.csr_matrix:
    """Whole rows of a distributed matrix on every process, shape (len(rows), unknowns). Collective."""
    comm, unknowns = matrix.comm.tompi4py(), matrix.size[1]
    start, end = matrix.getOwnershipRange()
    if comm.size == 1:
        indptr, indices, data = matrix.getValuesCSR()
        return sp.csr_matrix((data, indices, indptr), shape=matrix.size)[rows]
    wanted = rows[(rows >= start) & (rows < end)] - start
    indptr, indices, data = matrix.getValuesCSR()
    owned = sp.csr_matrix((data, indices, indptr), shape=(end - start, unknowns))[wanted]
    parts = comm.allgather((wanted + start, owned))
    order = np.argsort(np.concatenate([numbers for numbers, _ in parts]))
    found = sp.vstack([part for _, part in parts], format="csr")[order]
    return found[np.argsort(np.argsort(rows))]


def change_rows(matrix: PETSc.Mat, b: PETSc.Vec, changes: RowChanges) -> PETSc.Mat:
    """The changed matrix; `b` is changed in place and `matrix` is used up. Collective."""
    start, end = matrix.getOwnershipRange()

    def owned(rows: NDArray[np.int64]) -> NDArray[np.bool_]:
        return (rows >= start) & (rows < end)

    replace, add = owned(changes.replaced), owned(changes.added)
    place = np.concatenate([changes.replaced[replace], changes.added[add]]) - start
    values = sp.vstack([changes.replaced_rows[replace], changes.added_rows[add]], format="csr")
    into = sp.csr_matrix((np.ones(len(place)), (place, np.arange(len(place)))), shape=(end - start, len(place)))
    local = (into @ values).tocsr()
    if matrix.comm.size == 1:
        changed = _change_local(matrix, changes.replaced, local)
    else:
        matrix.zeroRows(changes.replaced[replace].astype(PETSc.IntType), 0.0)
        changed = PETSc.Mat().createAIJ(
            (matrix.getSizes()[0], matrix.getSizes()[1]),
            csr=(local.indptr.astype(PETSc.IntType), local.indices.astype(PETSc.IntType), local.data),
            comm=matrix.comm,
        )
        changed.axpy(1.0, matrix, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
    right = b.array
    right[changes.replaced[replace] - start] = changes.replaced_right[replace]
    right[changes.added[add] - start] += changes.added_right[add]
    return changed


def _change_local(matrix: PETSc.Mat, replaced: NDArray[np.int64], local: sp.csr_matrix) -> PETSc.Mat:
    indptr, indices, data = matrix.getValuesCSR()
    keep = np.ones(local.shape[0], dtype=bool)
    keep[replaced] = False
    data = data * np.repeat(keep, np.diff(indptr))
    total = sp.csr_matrix((data, indices, indptr), shape=local.shape) + local
    total.sort_indices()
    csr = (total.indptr.astype(PETSc.IntType), total.indices.astype(PETSc.IntType), total.data)
    return PETSc.Mat().createAIJ(total.shape, csr=csr, comm=matrix.comm)


def from_entries(
    comm: MPI.Comm, owned: tuple[int, int], rows: NDArray[np.int64], columns: NDArray[np.int64], data: Array
) -> PETSc.Mat:
    """A matrix with `owned` rows and columns from entries of any process; equal places add up. Collective."""
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
    local = sp.csr_matrix((data, (rows - start, columns)), shape=(owned[0], comm.allreduce(owned[1])))
    csr = (local.indptr.astype(PETSc.IntType), local.indices.astype(PETSc.IntType), local.data)
    return PETSc.Mat().createAIJ(((owned[0], None), (owned[1], None)), csr=csr, comm=comm)


class Numbering:
    """The columns of a system of two blocks: on each process those of the first and then of the second.

    Outside, the unknowns are numbered as those of the first block alone, then those of the second.
    """

    def __init__(self, comm: MPI.Comm, first: int, second: int):
        """Owned unknowns of the blocks (collective)."""
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

    def fetch_rows(self, matrix: PETSc.Mat, rows: NDArray[np.int64]) -> sp.csr_matrix:
        """Rows of a matrix with these columns, columns in the order of the unknowns (collective)."""
        found = fetch_rows(matrix, rows).tocoo()
        return sp.csr_matrix((found.data, (found.row, self._unknown[found.col])), shape=found.shape)

    def place(self, changes: RowChanges) -> RowChanges:
        """Changes by unknowns as changes of a matrix with these columns."""

        def columns(rows: sp.csr_matrix) -> sp.csr_matrix:
            entries = rows.tocoo()
            return sp.csr_matrix((entries.data, (entries.row, self.placed[entries.col])), shape=rows.shape)

        return replace(changes, replaced_rows=columns(changes.replaced_rows), added_rows=columns(changes.added_rows))

    def split(self, matrix: PETSc.Mat) -> tuple[PETSc.Mat, PETSc.Mat]:
        """The columns of the first block and those of the second (collective)."""
        rows = PETSc.IS().createStride(matrix.getLocalSize()[0], matrix.getOwnershipRange()[0], 1, comm=matrix.comm)
        return matrix.createSubMatrix(rows, self.first), matrix.createSubMatrix(rows, self.second)

    def gather(self, comm: MPI.Comm, system: Array) -> Array:
        """Values of all unknowns from the owned ones of the system (collective)."""
        return gather(comm, system)[self.placed]


def gather(comm: MPI.Comm, owned: Array) -> Array:
    """The whole of a distributed array on every process. Collective."""
    if comm.size == 1:
        return owned
    return np.concatenate(comm.allgather(owned))


def gather_at(comm: MPI.Comm, owned: Array, start: int, dofs: NDArray[np.int64]) -> Array:
    """Values at global dofs on every process, zero where the dof is -1; same shape as `dofs`. Collective."""
    local = dofs - start
    mine = (local >= 0) & (local < len(owned)) & (dofs >= 0)
    values = np.zeros(dofs.shape)
    values[mine] = owned[local[mine]]
    return values if comm.size == 1 else comm.allreduce(values)
