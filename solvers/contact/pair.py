"""One slave surface against one master surface: search, mortar integrals, and their full derivatives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from solvers.api import Array
from solvers.contact.search import Search
from solvers.contact.surface import KERNEL_TYPES, Surface
from solvers.kernels import basis_transformation, mortar, nodal_normals

#: Slave facets take part when a master is nearer than this share of the longest edge (and the motion of the step).
NEAR = 0.3

#: Evaluations of a step after which facet pairs that are in use stay in use. With 12 instead of 3 the two tori need up
#: to 14 Newton steps instead of 6.
KEEP_AFTER = 3

Integration = Literal["segments", "elements"]


@dataclass(frozen=True)
class PairTerms:
    """Mortar integrals of a pair; columns are slave dofs, then master dofs (dim * node + component)."""

    D: Array  #: diagonal of D [m^(dim-1)], shape (ns,)
    M: sp.csr_matrix  #: coupling [m^(dim-1)], shape (ns, nm)
    gap: Array  #: weighted gap [m^dim], positive where open, shape (ns,)
    normals: Array  #: averaged unit normals of the slave, shape (ns, dim)
    dgap: sp.csr_matrix  #: shape (ns, dim * (ns + nm))
    dforce: sp.csr_matrix  #: derivative of the contact force at fixed multipliers, shape (dim * (ns + nm),) * 2
    dnormals: sp.csr_matrix  #: shape (dim * ns, dim * (ns + nm))
    area: Array  #: covered area of each slave facet [m^(dim-1)], shape (k,)
    used: NDArray[np.int32]  #: facet pairs that took part, shape (p, 2)


class Pair:
    """A slave and a master surface that may touch."""

    def __init__(self, slave: Surface, master: Surface, integration: Integration = "segments"):
        self.slave, self.master, self.integration = slave, master, integration
        self._search = Search(slave.facets, master.facets)
        self._types = KERNEL_TYPES[slave.facet_type], KERNEL_TYPES[master.facet_type]
        self._facets = tuple(np.ascontiguousarray(s.facets, dtype=np.int64) for s in (slave, master))
        self._mask = None if slave.held is None else _free_of_planes(slave.held)
        T, inverse = basis_transformation(self._facets[0], self._types[0], len(slave.points))
        shape = (len(slave.points),) * 2
        #: slave basis N~ = N T, and its inverse
        self.transformation = sp.csr_matrix(T, shape=shape)
        self.inverse_transformation = sp.csr_matrix(inverse, shape=shape)
        self._edge = _longest_edge(slave.corners)
        self.begin_step()

    def begin_step(self) -> None:
        """Facet pairs are chosen anew."""
        self._evaluations = 0
        self._kept = np.empty(0, dtype=np.int64)

    def _codes(self, facet_pairs: NDArray[np.int32]) -> NDArray[np.int64]:
        """One number for each facet pair, in the same order."""
        return facet_pairs[:, 0].astype(np.int64) * len(self.master.facets) + facet_pairs[:, 1]

    def keep(self, used: NDArray[np.int32]) -> None:
        """Facet pairs in use (of all processes) stay in use until the next step, from some evaluation on.

        Whether facets see each other is a hard decision: were it taken anew each time, Newton's last iterates could
        jump to and fro between two sets of pairs. Pairs still come in, but none goes.
        """
        self._evaluations += 1
        if self._evaluations >= KEEP_AFTER:
            self._kept = np.union1d(self._kept, self._codes(used))

    def near(self, xs: Array, xm: Array, xs_previous: Array, xm_previous: Array) -> tuple[NDArray[np.int32], float]:
        """Facet pairs that may meet, and the largest motion [m] of a node in this step."""
        motion = max(float(np.abs(a - b).max(initial=0.0)) for a, b in ((xs, xs_previous), (xm, xm_previous)))
        found = self._search.pairs(xs, xm, self._edge + motion, xs_previous, xm_previous)
        codes = self._codes(found)
        if np.isin(self._kept, codes).all():
            return found, motion
        together = np.union1d(codes, self._kept)
        count = len(self.master.facets)
        return np.stack([together // count, together % count], axis=1).astype(np.int32), motion

    def evaluate(self, xs: Array, xm: Array, facet_pairs: NDArray[np.int32], motion: float, z: Array) -> PairTerms:
        """All terms at the positions xs, xm [m] for the multipliers z [Pa] of the slave nodes."""
        ns, nm, dim = len(xs), len(xm), xs.shape[1]
        xs, xm, z = (np.ascontiguousarray(a) for a in (xs, xm, z))
        normals, slopes = nodal_normals(xs, self._facets[0], self._types[0], self._mask)
        result = mortar(
            xs,
            self._facets[0],
            self._types[0],
            xm,
            self._facets[1],
            self._types[1],
            normals,
            facet_pairs,
            z,
            method=self.integration,
            reach=self._edge + motion,
            near=NEAR * self._edge + motion,
            kept=np.isin(self._codes(facet_pairs), self._kept).astype(np.uint8),
        )
        columns = dim * (ns + nm)
        dn = sp.csr_matrix(slopes, shape=(dim * ns, dim * ns))

        def total(direct, by_normals, rows) -> sp.csr_matrix:
            derivative = sp.csr_matrix(direct, shape=(rows, columns))
            through = sp.csr_matrix(by_normals, shape=(rows, dim * ns)) @ dn
            return derivative + _widen(through, columns) if through.nnz else derivative

        dforce = total(result.dforce, result.dforce_dn, columns)
        if self._types[0] == "tri6":
            back = sp.kron(self.inverse_transformation.T, sp.identity(dim))
            dforce = (sp.block_diag([back, sp.identity(dim * nm)]) @ dforce).tocsr()
        return PairTerms(
            result.D,
            sp.csr_matrix(result.M, shape=(ns, nm)),
            result.gap,
            normals,
            total(result.dgap, result.dgap_dn, ns),
            dforce,
            _widen(dn, columns),
            result.area,
            facet_pairs[result.used.astype(bool)],
        )


def _free_of_planes(held: NDArray[np.bool_]) -> Array:
    """0 for components that normals do not have, for they lie in planes of symmetry, 1 for others; shape of `held`.

    A node held in all its components is no such node: it needs a normal.
    """
    return np.where(held & ~held.all(axis=1, keepdims=True), 0.0, 1.0)


def _widen(matrix: sp.csr_matrix, columns: int) -> sp.csr_matrix:
    return sp.csr_matrix((matrix.data, matrix.indices, matrix.indptr), shape=(matrix.shape[0], columns))


def _longest_edge(corners: Array) -> float:
    return float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max())
