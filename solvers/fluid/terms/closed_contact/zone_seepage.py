"""Seepage through closed contact: the layer of `seepage` where no cell of the flow is in front of it.

With the pressure P = E p of `zone` the continuity equation has the term kappa / mu int_D grad_t P . grad_t Q ds,
Q = E q, over each facet. E 1 = 1: the flux into the zone equals that out of it.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from petsc4py import PETSc

from solvers.algebra.sparse import Sparse, sparse_from_entries
from solvers.api import Array
from solvers.fluid.mesh.space import Unknowns
from solvers.fluid.terms.closed_contact.zone import ClosedZone, stiffness


class ZoneSeepage:
    """The term of one zone."""

    def __init__(self, zone: ClosedZone, mobility: Array):
        """mobility: kappa / mu of the facets of all surfaces [m^3/Pa s]."""
        self._zone, self._mobility = zone, mobility

    @cached_property
    def _matrix(self) -> Sparse:
        """K, kappa / mu int_D grad_t lambda_v . grad_t lambda_w ds at the vertices of the zone."""
        facets = self._zone.facets
        d, n = facets.corners.shape[1], len(facets.vertices)
        weight = self._zone.share * self._mobility[facets.numbers]
        blocks = weight[:, None, None] * stiffness(facets.x, facets.size)
        rows, columns = np.repeat(facets.corners, d, axis=1).ravel(), np.tile(facets.corners, (1, d)).ravel()
        return sparse_from_entries(rows, columns, blocks.ravel(), (n, n))

    def flux(self, flow: Array) -> Array:
        """Volume [m^3/s] that enters the zone at each of its vertices, for the flow at local dofs (collective)."""
        return self._matrix @ self._zone.pressure(flow)

    def leak(self, flow: Array) -> float:
        """Flow rate [m^3/s] through the zone, half of the sum of all fluxes into and out of it (collective)."""
        return 0.5 * float(np.abs(self.flux(flow)).sum())

    def add_rows(self, out: Array, flow: Array) -> None:
        """Add E^T K E p to rows at local dofs (collective)."""
        flux = self.flux(flow)
        dofs, E = self._zone.by_pressure
        out[dofs] += E.T @ flux

    def added_to(self, matrix: PETSc.Mat, unknowns: Unknowns) -> PETSc.Mat:
        """A new matrix: the tangent plus E^T K E, which couples all pressure dofs of the rim (collective)."""
        dofs, E = self._zone.by_pressure
        columns = [unknowns.global_dofs[dofs], E]
        parts = self._zone.comm.allgather(columns)
        numbers, everywhere = (np.concatenate(part, axis=-1) for part in zip(*parts, strict=True))
        block = E.T @ (self._matrix @ everywhere)
        more = PETSc.Mat().create(matrix.comm)
        more.setSizes(matrix.getSizes())
        more.setBlockSize(matrix.getBlockSize())
        more.setType(matrix.getType())
        more.setUp()
        more.setOption(PETSc.Mat.Option.NEW_NONZERO_ALLOCATION_ERR, False)
        rows = columns[0].astype(PETSc.IntType)
        more.setValues(rows, numbers.astype(PETSc.IntType), block, PETSc.InsertMode.ADD_VALUES)
        more.assemble()
        total = matrix.copy()
        total.axpy(1.0, more, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
        return total
