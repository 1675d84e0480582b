"""The largest and the least pressure of the fluid itself, not of nodes behind surfaces.

A film that is thinner than a cell hardly determines the pressure of a node behind a surface: it may be 1.5 times the
largest one of the film, and does not converge. In a cell the pressure is linear along each axis, hence harmonic, and
largest at a corner in the fluid or on the surface. It is evaluated at

- all corners of cells without surface,
- the corners of the parts of facets that are in each cut cell.

Corners of cut cells are left out, because rounding decides on which side of a touching surface they are.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np
from mpi4py import MPI

from solvers import fem
from solvers.api import Array
from solvers.fluid.flow.field import Fluid
from solvers.fluid.geometry.pieces import place_of
from solvers.fluid.grid.box import FLUSH
from solvers.fluid.terms.closed_contact.zone import SLIVER
from solvers.mesh.tessellation import area_vectors


def extreme_pressure(fluid: Fluid, extreme: Literal["largest", "least"]) -> Callable[[], dict[str, float]]:
    """Probe of the largest or the least pressure [Pa] of all fluid (collective)."""
    sign = 1.0 if extreme == "largest" else -1.0

    def probe() -> dict[str, float]:
        nodal, owned = sign * fluid.flow, fluid.grid.owned
        whole = fluid.unknowns.cell_pressure[fluid.cut.uncut[fluid.cut.uncut < owned]]
        found = float(nodal[whole].max(initial=-np.inf))
        if fluid.bodies:
            found = _on_surfaces(fluid, nodal, found)
        return {"": sign * fluid.comm.allreduce(found, op=MPI.MAX)}

    return probe


def _on_surfaces(fluid: Fluid, nodal: Array, least: float) -> float:
    """The largest value of nodal values [Pa] on the surfaces in cells of this process, or `least` if that is larger.

    No value in a cell exceeds those of its nodes, and none is below the mean over a piece of surface: few pieces are
    looked at, from the one with the largest node on.
    """
    at, grid = fluid.system.assemble_interface(), fluid.grid
    bound = nodal[at.p].max(axis=1, initial=-np.inf)
    area = at.mass_of_pieces.sum(axis=(1, 2))
    sure = area > SLIVER * np.linalg.norm(area_vectors(at.x), axis=1)
    mean = np.einsum("pav,pa->p", at.psi[sure], nodal[at.p[sure]]) / area[sure]
    found = float(mean.max(initial=least))
    steps = fem.node_steps(grid.domain, 1)
    low, size = place_of(grid.grid, grid.numbers[at.cell])  # of nested cells, surfaces cut the finest ones only
    for piece in np.argsort(-bound):
        if bound[piece] <= found:
            break
        corners = clipped((at.x[piece] - low[piece]) / size[piece])
        if len(corners):
            shapes = np.where(steps == 1, corners[:, None], 1.0 - corners[:, None]).prod(axis=2)
            found = max(found, float((shapes @ nodal[at.p[piece]]).max()))
    return found


def clipped(corners: Array) -> Array:
    """Corners of the part of a segment or triangle in the unit cell, shape (n, dim); none if it is outside.

    Corners that are in a face of the cell up to `FLUSH` are put into it, so that rounding loses no part in this face.
    Source: Sutherland, Hodgman, Commun. ACM 17 (1974) 32-42.
    """
    nearest = np.round(corners).clip(0.0, 1.0)
    corners = np.where(np.abs(corners - nearest) <= FLUSH, nearest, corners)
    for axis in range(corners.shape[1]):
        for side in (-1.0, 1.0):
            beyond = side * (corners[:, axis] - 0.5) - 0.5
            inside, following = beyond <= 0.0, np.roll(beyond, -1)
            crosses = np.flatnonzero(inside != (following <= 0.0))
            t = (beyond[crosses] / (beyond[crosses] - following[crosses]))[:, None]
            between = (1.0 - t) * corners[crosses] + t * np.roll(corners, -1, axis=0)[crosses]
            order = np.argsort(np.concatenate([np.flatnonzero(inside), crosses + 0.5]), kind="stable")
            corners = np.concatenate([corners[inside], between])[order]
    return corners
