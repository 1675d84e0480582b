"""The mortar integrals of all pairs in one numbering of nodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from solvers.api import Array
from solvers.contact.pair import PairTerms
from solvers.contact.share import Shares

#: Node numbers of the slave and of the master surface of a pair
Sides = tuple[NDArray[np.int64], NDArray[np.int64]]


@dataclass(frozen=True)
class Terms:
    """Mortar integrals of all pairs at one iterate; columns are interface dofs (dim * node + component)."""

    D: Array  #: shape (N,), zero for nodes that are no slaves or see no master
    M: sp.csr_matrix  #: shape (N, N)
    gap: Array  #: weighted gap [m^dim], shape (N,)
    normals: Array  #: of slave nodes, shape (N, dim)
    dgap: sp.csr_matrix  #: shape (N, dim * N)
    dforce: sp.csr_matrix  #: derivative of the contact force at fixed multipliers, shape (dim * N,) * 2
    dnormals: sp.csr_matrix  #: shape (dim * N, dim * N)


def total_terms(pieces: Sequence[tuple[Sides, PairTerms]], shares: Shares, N: int, dim: int) -> Terms:
    """Sum over pairs, given with their sides, and over processes, in the numbering of all N nodes (collective)."""
    n = N * dim
    D, gap, normals = np.zeros(N), np.zeros(N), np.zeros((N, dim))
    matrices: dict[str, list[sp.csr_matrix]] = {"M": [], "dgap": [], "dforce": []}
    dnormals = []
    for (slave, master), found in pieces:
        columns = (dim * np.concatenate([slave, master])[:, None] + np.arange(dim)).ravel()
        D[slave] += shares.total(found.D)
        gap[slave] += shares.total(found.gap)
        normals[slave] = found.normals
        dnormals.append(_renumber(found.dnormals, columns[: dim * len(slave)], columns, (n, n)))
        matrices["M"].append(_renumber(found.M, slave, master, (N, N)))
        matrices["dgap"].append(_renumber(found.dgap, slave, columns, (N, n)))
        matrices["dforce"].append(_renumber(found.dforce, columns, columns, (n, n)))
    summed = {name: shares.total(sum(parts[1:], parts[0])) for name, parts in matrices.items()}
    return Terms(D=D, gap=gap, normals=normals, dnormals=sum(dnormals[1:], dnormals[0]), **summed)


def _renumber(matrix: sp.csr_matrix, rows: NDArray, columns: NDArray, shape: tuple[int, int]) -> sp.csr_matrix:
    entries = matrix.tocoo()
    return sp.csr_matrix((entries.data, (rows[entries.row], columns[entries.col])), shape=shape)
