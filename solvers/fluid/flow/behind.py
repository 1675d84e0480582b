"""Velocities of the past behind moving walls, where the next steps will have fluid.

A parabola through a boundary layer, continued behind the wall, is 20 to 100 times as fast as the wall. So the velocity
that counts as that of the past is bounded by that at the mirror image x* of the place x, w the velocity of the wall:

    |u(x) - w| <= |u(x*) - w|,   x* = 2 y - x,   y: nearest point of the wall.

Nodes of films are left as they are (docs/theory_fluid.md, Moving bodies).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc
from scipy.spatial import cKDTree

from solvers import fem
from solvers.api import Array, Indices
from solvers.fluid.cut.cut import Cut
from solvers.fluid.cut.extension import lagrange
from solvers.fluid.cut.images import Periods
from solvers.fluid.mesh.directory import Directory
from solvers.fluid.mesh.space import Unknowns
from solvers.fluid.surfaces.surface import Motion
from solvers.mesh.distance import SAME_DISTANCE
from solvers.mesh.tessellation import unit_normals

#: Facets nearest by their centres among which the nearest one is looked for.
NEAREST_FACETS = 6


class BehindWalls:
    """Bounds velocities of the past on one grid without cells of their own for the sides of thin bodies."""

    def __init__(self, unknowns: Unknowns):
        nodes, grid, degree = unknowns.velocity, unknowns.grid, unknowns.degree
        self.unknowns, self._dofs = unknowns, nodes.dofs[: nodes.owned]
        self._points = nodes.points[: nodes.owned]
        self._cell = max(float(np.diff(edge).max()) for edge in grid.grid.edges)
        size = int(np.prod(unknowns.lattice_shape(degree)))
        self._periods = Periods(grid.grid, unknowns.periodic)
        self._directory = Directory(grid.comm, nodes.numbers[: nodes.owned], unknowns.global_dofs[self._dofs], size)

    def bounded(self, velocity: Array, cut: Cut, wet: NDArray[np.bool_]) -> Array:
        """Velocity [m/s] at local dofs, bounded as far as the strip reaches behind wet facets (collective)."""
        result, reach = velocity.copy(), (cut.depth + 1) * self._cell
        images = cut.images
        some = images.facets[wet[images.facet]]
        behind, mirror, wall = mirrored(self._points, some, images.motion(cut.motion), reach)
        outside = ~self._in_films(cut)[behind]
        behind, mirror, wall = behind[outside], mirror[outside], wall[outside]
        found, there = self._interpolated(velocity, self._periods.within(mirror))
        rise, bound = velocity[self._dofs[behind]] - wall, np.linalg.norm(there - wall, axis=1)
        size = np.linalg.norm(rise, axis=1)
        large = found & (size > bound)
        result[self._dofs[behind[large]]] = wall[large] + (bound[large] / size[large])[:, None] * rise[large]
        return fem.share_owned(self.unknowns.space, result)

    def _in_films(self, cut: Cut) -> NDArray[np.bool_]:
        """Mask of the owned nodes of cut cells with creeping flow."""
        unknowns, found = self.unknowns, np.zeros(self.unknowns.local, dtype=bool)
        if cut.creeping is not None:
            cells = cut.cut[cut.creeping[unknowns.grid.numbers[cut.cut]]]
            found[unknowns.cell_velocity[cells].ravel()] = True
        mask: NDArray[np.bool_] = found[self._dofs[:, 0]]
        return mask

    def _interpolated(self, velocity: Array, points: Array) -> tuple[NDArray[np.bool_], Array]:
        """(whether points are in cells with all their nodes, the velocity [m/s] there) (collective)."""
        unknowns, degree = self.unknowns, self.unknowns.degree
        number, weights = np.zeros((len(points), 1), dtype=np.int64), np.ones((len(points), 1))
        inside, stride = np.ones(len(points), dtype=bool), 1
        shape = unknowns.lattice_shape(degree)
        for x, edge, count in zip(points.T, unknowns.grid.grid.edges, shape, strict=True):
            inside &= (x >= edge[0]) & (x <= edge[-1])
            cell = np.clip(np.searchsorted(edge, x) - 1, 0, len(edge) - 2)
            s = np.clip((x - edge[cell]) / (edge[cell + 1] - edge[cell]), 0.0, 1.0)
            lattice = (degree * cell[:, None] + np.arange(degree + 1)) % count * stride
            functions = lagrange(s, degree)
            number = (number[:, :, None] + lattice[:, None, :]).reshape(len(points), lattice.shape[1] * number.shape[1])
            weights = (weights[:, :, None] * functions[:, None, :]).reshape(number.shape)
            stride *= count
        dofs = self._directory(number.ravel()).reshape(*number.shape, unknowns.dim)
        values = _gathered(unknowns, velocity[: unknowns.owned], np.maximum(dofs, 0).ravel()).reshape(dofs.shape)
        return inside & (dofs >= 0).all(axis=(1, 2)), (weights[..., None] * values).sum(axis=1)


def with_walls(velocity: Array, unknowns: Unknowns, cut: Cut, without: NDArray[np.bool_]) -> Array:
    """Velocity [m/s] at local dofs, that of the nearest wall at nodes within walls that have none (mask of dofs)."""
    nodes, dofs = unknowns.velocity.points, unknowns.velocity.dofs
    some = np.flatnonzero(without[dofs].any(axis=1))
    if not len(some) or not len(cut.facets):
        return velocity
    cell = max(float(np.diff(edge).max()) for edge in unknowns.grid.grid.edges)
    behind, _, wall = mirrored(nodes[some], cut.images.facets, cut.images.motion(cut.motion), (cut.depth + 1) * cell)
    result = velocity.copy()
    result[dofs[some[behind]]] = wall
    return result


def mirrored(points: Array, facets: Indices, motion: Motion, reach: float) -> tuple[Indices, Array, Array]:
    """(points behind facets and no farther than `reach` [m], their mirror images, the wall's velocity [m/s] there)."""
    normals = unit_normals(motion.x[facets])
    facets, normals = (some[(normals != 0.0).any(axis=1)] for some in (facets, normals))
    if not len(facets):
        return np.empty(0, dtype=np.int64), points[:0], points[:0]
    corners = motion.x[facets]
    centres = corners.mean(axis=1)
    bound = reach + float(np.linalg.norm(corners - centres[:, None], axis=2).max())
    far, which = cKDTree(centres).query(
        points, k=np.arange(1, min(NEAREST_FACETS, len(facets)) + 1), distance_upper_bound=bound
    )
    near = np.flatnonzero(np.isfinite(far[:, 0]))
    which = np.where(np.isfinite(far[near]), which[near], which[near, :1])
    weights = _foot(points[near, None], corners[which])
    foot = (weights[..., None] * corners[which]).sum(axis=2)
    away = points[near, None] - foot
    distance, height = np.linalg.norm(away, axis=2), (away * normals[which]).sum(axis=2)
    # of facets with the same nearest point, at an edge, the one that faces the point most
    nearest = distance <= (1.0 + SAME_DISTANCE) * distance.min(axis=1, keepdims=True)
    best = np.where(nearest, np.abs(height), -1.0).argmax(axis=1)
    rows = np.arange(len(near))
    behind = np.flatnonzero((height[rows, best] < 0.0) & (distance[rows, best] <= reach))
    best = best[behind]
    at = facets[which[behind, best]]
    wall = (weights[behind, best][..., None] * motion.v[at]).sum(axis=1)
    return near[behind], 2.0 * foot[behind, best] - points[near[behind]], wall


def _foot(x: Array, corners: Array) -> Array:
    """Barycentric coordinates of a facet's point near x, the nearest one if its projection is inside or 2D."""
    edges = corners[..., 1:, :] - corners[..., :1, :]
    right = (edges * (x[..., None, :] - corners[..., :1, :])).sum(axis=-1)
    inner = np.linalg.solve(edges @ np.swapaxes(edges, -1, -2), right[..., None])[..., 0]
    weights = np.concatenate([1.0 - inner.sum(axis=-1, keepdims=True), inner], axis=-1).clip(min=0.0)
    return weights / weights.sum(axis=-1, keepdims=True)


def _gathered(unknowns: Unknowns, values: Array, dofs: NDArray[np.int64]) -> Array:
    """Values at global dofs of all processes (collective)."""
    x = PETSc.Vec().createWithArray(values, comm=unknowns.grid.comm)
    some = PETSc.Vec().createSeq(len(dofs))
    indices = PETSc.IS().createGeneral(dofs.astype(PETSc.IntType), comm=PETSc.COMM_SELF)
    scatter = PETSc.Scatter().create(x, indices, some, None)
    scatter.scatter(x, some, addv=PETSc.InsertMode.INSERT_VALUES)
    found = some.array.copy()
    for each in (scatter, indices, some, x):
        each.destroy()
    return found
