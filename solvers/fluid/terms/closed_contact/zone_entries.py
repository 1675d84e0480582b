"""Contribution of closed contact to the coupling blocks of a monolithic system."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from solvers.algebra.sparse import Sparse, nothing, sparse_from_entries
from solvers.api import Array
from solvers.fluid.mesh.space import Unknowns
from solvers.fluid.terms.closed_contact.zone import ClosedZone
from solvers.fluid.terms.coupling_entries import InterfaceEntries


def with_zone(
    entries: InterfaceEntries, zone: ClosedZone, unknowns: Unknowns, flow: Array, vertices: NDArray[np.int64]
) -> InterfaceEntries:
    """Interface entries plus the derivatives of the zone's force (collective).

    flow: values at local dofs; vertices: those whose motion the entries are for.
    """
    dim, number = zone.facets.n.shape[1], np.full(1 + max(vertices.max(), zone.facets.vertices.max()), -1)
    number[vertices] = np.arange(len(vertices))
    moved = number[zone.facets.vertices]
    kept = np.flatnonzero(moved >= 0)
    rows = (dim * moved[kept, None] + np.arange(dim)).ravel()
    dofs, by_flow = zone.force_by_flow()
    by_motion = zone.force_by_motion(flow)[kept][:, :, kept].reshape(len(rows), len(rows))
    n = dim * len(vertices)
    into_force = _dense(rows, dofs, by_flow[kept].reshape(len(rows), -1), (n, unknowns.local))
    if unknowns.grid.comm.size > 1:
        into_force = into_force.with_columns(unknowns.global_dofs, unknowns.size())
    first = unknowns.grid.comm.rank == 0  # all processes have this block; one adds it
    shape = _dense(rows, rows, by_motion, (n, n)) if first else nothing((n, n))
    return replace(
        entries,
        force_by_flow=entries.force_by_flow + into_force,
        force_by_motion=entries.force_by_motion + shape,
    )


def _dense(rows: NDArray, columns: NDArray, values: Array, shape: tuple[int, int]) -> Sparse:
    """A matrix with dense values in some rows and columns."""
    return sparse_from_entries(np.repeat(rows, len(columns)), np.tile(columns, len(rows)), values.ravel(), shape)
