"""Faces of cells on the boundary of the box that bodies cover in part or whole: integrals over their wet part."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from solvers import fem
from solvers.api import Array
from solvers.fluid.cut.cut import Cut
from solvers.fluid.grid.box import FACES
from solvers.fluid.mesh.distributed_grid import DistributedGrid
from solvers.fluid.mesh.space import Unknowns
from solvers.fluid.terms.boundary.meeting_patches import points_on_face
from solvers.fluid.terms.boundary.wet_faces import WetFace, WetFaces
from solvers.mesh.gauss import gauss


@dataclass(frozen=True)
class CoveredFaces:
    """Covered faces on one face of the box, with Gauss points and weights of their wet part."""

    grid: DistributedGrid
    unknowns: Unknowns
    cells: NDArray[np.int32]  #: local cells
    axis: int
    side: int  #: 0 or 1
    reference: Array  #: points in the reference cell, shape (points, dim)
    weights: Array  #: wet weights times areas [m^(dim-1)], shape (cells, points)

    def only(self, marked: NDArray[np.bool_]) -> CoveredFaces:
        """The faces of marked local cells."""
        keep = marked[self.cells]
        return replace(self, cells=self.cells[keep], weights=self.weights[keep])

    def velocity(self, values: Array) -> Array:
        """Velocity at the points from values at local dofs, shape (cells, points, dim)."""
        shapes, _ = fem.tabulate_lagrange(self.grid.domain, self.unknowns.degree, self.reference)
        return np.einsum("qa,cai->cqi", shapes, values[self.unknowns.cell_velocity[self.cells]])

    def pressure(self, values: Array) -> Array:
        """Pressure at the points from values at local dofs, shape (cells, points)."""
        shapes, _ = fem.tabulate_lagrange(self.grid.domain, 1, self.reference)
        return values[self.unknowns.cell_pressure[self.cells]] @ shapes.T

    def viscous_traction(self, values: Array, mu: float | Array) -> Array:
        """2 mu eps(u) n [Pa] at the points, n out of the box, shape (cells, points, dim).

        values: at local dofs; mu [Pa s], shape (cells, 1) if it varies.
        """
        _, slopes = fem.tabulate_lagrange(self.grid.domain, self.unknowns.degree, self.reference)
        u = values[self.unknowns.cell_velocity[self.cells]]
        gradient = np.einsum("qaj,cai->cqij", slopes, u) / self.grid.sizes[self.cells][:, None, None, :]
        both = gradient[..., self.axis] + gradient[..., self.axis, :]  # du_i/dn + du_n/dx_i
        return np.asarray((1.0 if self.side else -1.0) * np.asarray(mu)[..., None] * both)

    def outward(self, vectors: Array) -> Array:
        """Components of vectors along the outward normal of the box."""
        normal: Array = vectors[..., self.axis]
        return normal if self.side else -normal

    def along_normal(self, values: Array) -> Array:
        """Vectors of given lengths along the outward normal."""
        vectors = np.zeros((*values.shape, self.grid.dim))
        vectors[..., self.axis] = values if self.side else -values
        return vectors

    def load(self, traction: Array) -> tuple[NDArray[np.int32], Array]:
        """(local dofs, int t . v over the wet part) with tractions t [Pa] at the points, shape (cells, points, dim)."""
        shapes, _ = fem.tabulate_lagrange(self.grid.domain, self.unknowns.degree, self.reference)
        weighted = self.weights[:, :, None] * traction
        return self.unknowns.cell_velocity[self.cells], np.einsum("qa,cqi->cai", shapes, weighted)

    def outflow(self, mu: float | Array, mass_flux: Array) -> Array:
        """d/du of the form of an outflow over the wet part [Pa s m^(dim-2)], (cells, functions, dim, functions, dim).

        -<mu (grad u)^T n, v> - <min(0, rho a . n) u, v> / 2; mass_flux: rho a at the points, (cells, points, dim).
        """
        shapes, slopes = fem.tabulate_lagrange(self.grid.domain, self.unknowns.degree, self.reference)
        slopes = slopes / self.grid.sizes[self.cells][:, None, None, :]
        (cells, _, functions, dim), w = slopes.shape, self.weights
        block = np.zeros((cells, functions, dim, functions, dim))
        normal = 1.0 if self.side else -1.0
        block[..., self.axis] = -normal * np.einsum("cq,qa,cqbi->caib", mu * w, shapes, slopes)
        back = 0.5 * np.minimum(0.0, self.outward(mass_flux))
        mass = np.einsum("cq,qa,qb->cab", w * back, shapes, shapes)
        for i in range(dim):
            block[:, :, i, :, i] -= mass
        return block

    def friction(self, factor: Array) -> Array:
        """d/du of <factor u, v> over the wet part, same shape; factor [Pa s/m] at the points, shape (cells, points)."""
        shapes, _ = fem.tabulate_lagrange(self.grid.domain, self.unknowns.degree, self.reference)
        mass = np.einsum("cq,qa,qb->cab", self.weights * factor, shapes, shapes)
        return np.einsum("cab,ik->caibk", mass, np.eye(self.grid.dim))


def covered_faces(
    grid: DistributedGrid,
    unknowns: Unknowns,
    cut: Cut,
    points: int,
    facets: NDArray[np.int32],
    cells: NDArray[np.int32],
    known: WetFaces,
) -> tuple[NDArray[np.bool_], list[CoveredFaces]]:
    """(mask of the facets that no body covers, the others as covered faces).

    points: Gauss points in each direction of a face; polynomials of the degree points - 1 are integrated exactly.
    facets: local facets on the boundary of the box; cells: the local cell of each. known: those of earlier cuts.
    """
    free, covered = np.ones(len(facets), dtype=bool), []
    if len(cut.facets):
        middles = fem.facet_midpoints(grid.domain, facets)
        for face in FACES[: 2 * grid.dim]:
            on = grid.on_face(middles, face)
            found = (
                known.of(grid.grid, face, points, cut.images.facets, cut.images.motion(cut.motion))
                if on.any()
                else None
            )
            if found is not None and len(found.cells):
                part, touched = _covered(grid, unknowns, found, face, points, cells[on])
                free[np.flatnonzero(on)[touched]] = False
                covered += [part] if len(part.cells) else []
    return free, covered


def _covered(
    grid: DistributedGrid,
    unknowns: Unknowns,
    found: WetFace,
    face: str,
    points_per_direction: int,
    cells: NDArray[np.int32],
) -> tuple[CoveredFaces, NDArray[np.int64]]:
    """(the covered faces, indices of their cells in `cells`)."""
    axis, side = "xyz".index(face[0]), int(face[1] == "+")
    points = gauss(points_per_direction)[0]
    indices = np.unravel_index(grid.numbers[cells], grid.grid.shape, order="F")
    others = [i for i in range(grid.dim) if i != axis]
    shape = [grid.grid.shape[i] for i in others]
    number = np.ravel_multi_index([indices[i] for i in others], shape, order="F")
    row_of = np.full(int(np.prod(shape)), -1)
    row_of[found.cells] = np.arange(len(found.cells))
    touched = np.flatnonzero(row_of[number] >= 0)
    reference = points_on_face(points, grid.dim, axis, side)
    areas = grid.sizes[cells[touched]][:, others].prod(axis=1)
    wet = found.weights[row_of[number[touched]]]
    if grid.sheets is not None:
        for row, cell in enumerate(grid.in_sheets[cells[touched]].tolist()):
            share = grid.sheets.shares.get(cell)
            if share is not None and (found_wet := share.wet(axis, side, points)) is not None:
                wet[row] = found_wet
    weights = wet * areas[:, None]
    return CoveredFaces(grid, unknowns, cells[touched], axis, side, reference, weights), touched
