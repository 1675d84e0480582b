"""The wet part of the faces of the box, where bodies cross or touch its boundary.

On a face of a cell with Gauss points x_q, tensor weights w_q and Lagrange basis L_q on these points, the wet weights
are w_q - int_solid L_q dA / A. They integrate polynomials of the degree of the basis exactly over the wet part.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers import kernels
from solvers.api import Array
from solvers.fluid.grid.box import FLUSH, Grid
from solvers.fluid.surfaces.surface import Motion
from solvers.mesh.gauss import gauss
from solvers.mesh.lagrange import lagrange

Facets = NDArray[np.int64]


@dataclass(frozen=True)
class WetFace:
    """The cells on one face of the box that solids cover in part or whole."""

    cells: NDArray[np.int64]  #: their numbers on the face, the lowest direction fastest
    weights: Array  #: their wet weights, shape (cells, points), points with the lowest direction fastest


def wet_face(box: Grid, face: str, points: Array, facets: Facets, motion: Motion) -> WetFace:
    """The part of a face of the box such as 'x-' that closed surfaces do not cover; points: Gauss points on [0, 1].

    If facets lie in the plane of the face up to rounding, the surfaces are cut a little further inwards.
    """
    axis, edge = "xyz".index(face[0]), box.edges["xyz".index(face[0])]
    plane, inwards = (edge[0], 1.0) if face[1] == "-" else (edge[-1], -1.0)
    inset = FLUSH * float(np.diff(edge).min())
    flush = bool((np.abs(motion.x[facets][:, :, axis] - plane) <= inset).all(axis=1).any())
    place = float(plane + 2.0 * inwards * inset * flush)
    edges = [e for other, e in enumerate(box.edges) if other != axis]
    n, rule = len(points), gauss(len(points))[1]
    corners, above = motion.x[facets], motion.x[facets][:, :, axis] > place
    crossing = above.any(axis=1) & ~above.all(axis=1)
    if not crossing.any():
        return WetFace(np.empty(0, dtype=np.int64), np.empty((0, n ** (box.dim - 1))))
    if box.dim == 2:
        solid, fraction = _line(edges[0], points, *_crossings(corners[crossing], axis, place))
        full = rule
    else:
        ends = _segments(motion.x, facets[crossing], axis, place)
        x, pairs = ends.reshape(-1, 2), np.arange(2 * len(ends), dtype=np.int64).reshape(-1, 2)
        solid, fraction = _plane(edges, points, x, pairs)
        full = np.multiply.outer(rule, rule).ravel()
    solid = np.where((fraction >= 1.0)[:, None], full, solid)  # bodies may overlap
    cells = np.flatnonzero(fraction > 0.0)
    assert solid.shape[1] == n ** (box.dim - 1)
    return WetFace(cells, full - solid[cells])


def _crossings(corners: Array, axis: int, place: float) -> tuple[Array, Array]:
    """(coordinate [m] at which each segment crosses a line, 1 if solid begins there going upwards, -1 if it ends)."""
    other, (a, b) = 1 - axis, (corners[:, 0], corners[:, 1])
    along = b - a
    share = (place - a[:, axis]) / along[:, axis]
    outward = along[:, 1] if other == 0 else -along[:, 0]  # component of the normal (dy, -dx) along the line
    return a[:, other] + share * along[:, other], np.where(outward > 0.0, -1.0, 1.0)


def _line(edge: Array, points: Array, at: Array, begins: Array) -> tuple[Array, Array]:
    """(int_solid L_q / h, share of solid) of each cell of a line, from the crossings `at` and their signs `begins`."""
    start = np.clip((at[:, None] - edge[:-1]) / np.diff(edge), 0.0, 1.0)  # of the solid in each cell, if it begins
    nodes, weights = gauss(len(points))
    t = start[:, :, None] + (1.0 - start[:, :, None]) * nodes
    solid = np.einsum("c,cjnq,n,cj->jq", begins, lagrange(points, t), weights, 1.0 - start)
    fraction = begins @ (1.0 - start)
    return solid, np.where(np.abs(fraction) < 1e-14, 0.0, fraction)


def _segments(x: Array, triangles: Facets, axis: int, place: float) -> Array:
    """Segments in which triangles cut a plane, with solid on their left, shape (triangles, 2 ends, 2 directions)."""
    others, corners = [i for i in range(3) if i != axis], x[triangles]
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2)  # the same point for both triangles at the edge
    above = x[edges, axis] > place
    row, edge = np.nonzero(above[..., 0] != above[..., 1])  # two edges of each triangle
    a, b = np.moveaxis(x[edges[row, edge]], 1, 0)
    share = (place - a[:, axis]) / (b[:, axis] - a[:, axis])
    ends = (a + share[:, None] * (b - a))[:, others].reshape(-1, 2, 2)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, others]
    along = ends[:, 1] - ends[:, 0]
    leftward = along[:, 1] * normal[:, 0] - along[:, 0] * normal[:, 1] < 0.0
    return np.where(leftward[:, None, None], ends[:, ::-1], ends)


def _plane(edges: list[Array], points: Array, x: Array, segments: Facets) -> tuple[Array, Array]:
    """(int_solid L_q / area, share of solid) of each cell of a plane, from the segments around the solid."""
    count = int(np.prod([len(edge) - 1 for edge in edges]))
    if not len(segments):
        return np.zeros((count, len(points) ** 2)), np.zeros(count)
    moments = kernels.moments(edges, points, np.ascontiguousarray(x), segments)
    rule = gauss(len(points))[1]
    solid = moments.fraction[:, None] * np.multiply.outer(rule, rule).ravel()
    solid[moments.cells] = moments.solid
    return solid, moments.fraction


class WetFaces:
    """The wet parts of the faces of the box, found once for surfaces that rest."""

    def __init__(self) -> None:
        self._found: dict[tuple[str, int], tuple[Facets, Array, WetFace]] = {}

    def of(self, box: Grid, face: str, points: int, facets: Facets, motion: Motion) -> WetFace:
        """See `wet_face`; points: count of Gauss points in each direction."""
        known = self._found.get((face, points))
        if known is None or not (np.array_equal(known[1], motion.x) and np.array_equal(known[0], facets)):
            known = facets, motion.x, wet_face(box, face, gauss(points)[0], facets, motion)
            self._found[face, points] = known
        return known[2]
