"""Condensation of dual multipliers: rows of the linearised balance become rows without multipliers.

With J the tangent and R the balance without the multipliers' part, the linear system of a Newton step reads

    J_l du - w (M^T z)_l = -R_l                           rows of the master and all others
    J_a du + w (D z - M^T z)_a = -R_a                     rows of active slave nodes a
    dg_a du = -g_a                                        the weighted gap closes
    (I - n n^T) z_a = z_n (dn_a du)                       the traction stays normal to the turning surface

where w is the weight of the new contact force in the balance. D is diagonal, so that
z_a = -(J_a du + R_a) / (w D_a) drops out. (M^T z)_a is there only if a slave node is also a master elsewhere.
Where a support holds a component of a slave node, z has none: the balance there is the support's.
Source: Popp, Gitterle, Gee & Wall, Int. J. Numer. Meth. Engng 83 (2010), sections 4.3 and 4.4.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from solvers.api import Array


@dataclass(frozen=True)
class Linearised:
    """What contact adds to a Newton step, over the interface dofs (dim * node + component)."""

    weight: float  #: of the new contact force in the balance
    active: NDArray[np.int64]  #: active slave nodes, shape (m,)
    normals: Array  #: of the active nodes, shape (m, dim)
    pressure: Array  #: z_n of the active nodes [Pa], shape (m,)
    D: Array  #: of the active nodes, shape (m,)
    free: NDArray[np.bool_]  #: components of the active nodes that no support holds, shape (dim * m,)
    on_master: sp.csr_matrix  #: force on all nodes of unit multipliers, as master (M^T), shape (dim * N, dim * m)
    gap: Array  #: weighted gap of the active nodes, shape (m,)
    scale: Array  #: factor that makes forces of weighted gaps, shape (m,)
    dgap: sp.csr_matrix  #: shape (m, dim * N)
    dnormals: sp.csr_matrix  #: shape (dim * m, dim * N)


@dataclass(frozen=True)
class Condensed:
    """Rows for the active slave dofs, and what is added to all other interface rows; columns: all unknowns."""

    slave_rows: sp.csr_matrix  #: replace the rows of the active dofs, shape (dim * m, unknowns)
    slave_right: Array  #: their right-hand side, shape (dim * m,)
    added_rows: sp.csr_matrix  #: added to the interface rows, shape (dim * N, unknowns)
    added_right: Array  #: added to their right-hand side, shape (dim * N,)
    inverse: sp.csr_matrix  #: of D - M^T among the active dofs, shape (dim * m, dim * m)


def expand(matrix: sp.csr_matrix, dim: int) -> sp.csr_matrix:
    """matrix (x) I: the same for every component of a vector."""
    return sp.kron(matrix, sp.identity(dim), format="csr")


def condense(terms: Linearised, J: sp.csr_matrix, R: Array, columns: NDArray[np.int64]) -> Condensed:
    """Eliminate the multipliers.

    J, R: rows of the active slave dofs, shape (dim * m, unknowns) and (dim * m,); `columns` places interface dofs
    among the unknowns, -1 where they are none.
    """
    dim = terms.normals.shape[1]
    unknowns = J.shape[1]
    inverse = _inverse(terms, dim)
    Y, r = inverse @ J, inverse @ R

    tangential = _tangential(terms.normals)
    D = np.repeat(terms.D, dim)
    normal = _block_columns(terms.normals)
    turning = sp.diags(terms.weight * D * np.repeat(terms.pressure, dim)) @ terms.dnormals
    closing = normal @ sp.diags(terms.scale) @ terms.dgap
    rows = tangential @ (sp.diags(D) @ Y) + place_columns(turning + closing, columns, unknowns)
    right = -(tangential @ (D * r)) - normal @ (terms.scale * terms.gap)
    rows = rows + _diagonal_of_held(terms, columns, dim, unknowns)
    return Condensed(rows.tocsr(), right, (terms.on_master @ Y).tocsr(), -(terms.on_master @ r), inverse)


def recover(terms: Linearised, condensed: Condensed, J_du_plus_R: Array) -> Array:
    """The multipliers z [Pa] of the active nodes, shape (m, dim), from J_a du + R_a."""
    return -(condensed.inverse @ J_du_plus_R).reshape(terms.normals.shape) / terms.weight


def _inverse(terms: Linearised, dim: int) -> sp.csr_matrix:
    """(D - M^T)^-1 among the active dofs, zero for held ones: diagonal but for master nodes of another pair."""
    D, free = np.repeat(terms.D, dim), terms.free.astype(float)
    among = (sp.diags(free) @ terms.on_master[_dofs(terms.active, dim)]).tocoo()
    among.eliminate_zeros()
    inverse = sp.diags(free / D, format="csr")
    if among.nnz == 0:
        return inverse
    mixed = np.unique(np.concatenate([among.row, among.col]))
    into = sp.csr_matrix((np.ones(len(mixed)), (mixed, np.arange(len(mixed)))), shape=(len(D), len(mixed)))
    block = np.linalg.inv(np.diag(D[mixed]) - (into.T @ among @ into).toarray()) * free[mixed]
    apart = np.ones(len(D))
    apart[mixed] = 0.0
    return (sp.diags(apart) @ inverse + into @ sp.csr_matrix(block) @ into.T).tocsr()


def _diagonal_of_held(terms: Linearised, columns: NDArray[np.int64], dim: int, unknowns: int) -> sp.csr_matrix:
    """Entries that the supports overwrite, in rows that are theirs."""
    dofs = columns[_dofs(terms.active, dim)]
    held = np.flatnonzero(~terms.free)
    return sp.csr_matrix((np.ones(len(held)), (held, dofs[held])), shape=(len(dofs), unknowns))


def _dofs(nodes: NDArray[np.int64], dim: int) -> NDArray[np.int64]:
    return (dim * nodes[:, None] + np.arange(dim)).ravel()


def _tangential(normals: Array) -> sp.csr_matrix:
    """Block diagonal matrix of I - n n^T."""
    m, dim = normals.shape
    blocks = np.eye(dim) - normals[:, :, None] * normals[:, None, :]
    return sp.bsr_matrix((blocks, np.arange(m), np.arange(m + 1)), shape=(m * dim, m * dim)).tocsr()


def _block_columns(normals: Array) -> sp.csr_matrix:
    """Block diagonal matrix of the columns n, shape (dim * m, m)."""
    m, dim = normals.shape
    return sp.csr_matrix((normals.ravel(), np.repeat(np.arange(m), dim), np.arange(m * dim + 1)), shape=(m * dim, m))


def place_columns(matrix: sp.csr_matrix, columns: NDArray[np.int64], unknowns: int) -> sp.csr_matrix:
    """Interface columns to their place among the unknowns; columns that are no unknowns drop out."""
    entries = matrix.tocoo()
    target = columns[entries.col]
    keep = target >= 0
    return sp.csr_matrix((entries.data[keep], (entries.row[keep], target[keep])), shape=(matrix.shape[0], unknowns))
