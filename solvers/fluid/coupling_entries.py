"""The blocks of a monolithic system that belong to the flow's side of the interface, entry by entry.

With the operators of `interface` and the derivatives of `shape`, for displacements d of the vertices of some bodies,
whose velocity is g = alpha d - ..., rows r and force f of the flow change by

    dr = (alpha C + S) dd,    df = C^T S dw - (alpha M + S_f) dd.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.fluid.interface import InterfaceTerms
from solvers.fluid.shape import shape_derivatives
from solvers.fluid.space import Unknowns
from solvers.vertices import Entries


@dataclass(frozen=True)
class InterfaceEntries:
    """Derivatives by motion and flow; each process has those of its cells."""

    into_flow: Entries  #: dr/dd: global unknowns of the flow, dofs of the vertices; held rows are empty
    force_by_flow: Entries  #: df/dw: dofs of the vertices, global unknowns of the flow
    force_by_motion: Entries  #: df/dd: dofs of the vertices in both


def interface_entries(
    operator: InterfaceTerms,
    unknowns: Unknowns,
    flow: Array,
    alpha: float,
    held: NDArray[np.bool_],
    vertices: NDArray[np.int64],
) -> InterfaceEntries:
    """For the motion of some vertices, numbered as they are given.

    flow, held: velocity and pressure at local dofs, and which of these have no rows. alpha [1/s]: dg/dd.
    """
    by_shape, load_by_shape = shape_derivatives(operator, flow)
    C = operator.coupling_blocks
    back = np.concatenate([-C[0].ravel(), C[1].ravel()])
    into = np.concatenate([(alpha * c + s).ravel() for c, s in zip(C, by_shape, strict=True)])
    load = (alpha * operator.mass_blocks - load_by_shape).ravel()

    dim, numbers = operator.dim, unknowns.global_dofs
    moved = np.full((operator.vertices, dim), -1)  #: dof among the given vertices
    moved[vertices] = np.arange(len(vertices) * dim).reshape(-1, dim)
    moved = moved.ravel()
    rows, columns = operator.pattern
    of_flow, of_surface, ours = numbers[rows], moved[columns], moved[columns] >= 0
    kept = ours & ~held[rows]
    into_flow = Entries(of_flow[kept], of_surface[kept], into[kept])
    by_flow = Entries(of_surface[ours], of_flow[ours], back[ours])
    rows, columns = (moved[dofs] for dofs in operator.surface_pattern)
    ours = (rows >= 0) & (columns >= 0)
    return InterfaceEntries(into_flow, by_flow, Entries(rows[ours], columns[ours], -load[ours]))
