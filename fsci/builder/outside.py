"""What closes the solid outside of a wetted surface that encloses the fluid, alone or with faces of the box."""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from fsci.builder.dry_side import Closing, DrySideError
from solvers.fluid.surfaces.inside import winding
from solvers.fluid.surfaces.surface import Motion

Array = NDArray[np.float64]
Facets = NDArray[np.int64]

#: Points of the body that are tested for lying in the solid.
SAMPLED_POINTS = 64


def surround(points: Array, facets: Facets, inside: Array, box: tuple[Array, Array]) -> Closing:
    """What closes the solid behind a wetted surface: surfaces outside of the fluid's box, whose corners are given.

    `inside`: points in the body that the surface belongs to, which says where the solid is. In 3D the surface may have
    openings with rims on faces of the box, like a tube. Each is closed by a surface that leads away from the box
    (`_lid`). If the body is outside of the space so enclosed, a box around the fluid's box closes the solid.
    Raises DrySideError.
    """
    low, high = box
    closing = Closing(np.empty(0, dtype=np.int64), np.empty((0, len(low))), np.empty((0, len(low)), dtype=np.int64))
    rims = find_rims(facets)
    if not rims and ((points[facets] < low) | (points[facets] > high)).any():
        raise DrySideError("'outside' needs a wetted surface within the box")
    for rim in rims:
        closing = closing.joined(_lid(points, rim, box))
    seen = inside[((inside > low) & (inside < high)).all(axis=1)]
    turns = _turns(seen[:: 1 + len(seen) // SAMPLED_POINTS], points, facets, closing)
    if turns == 0:
        unit, around = _UNIT_BOX[len(low)]
        margin: Array = 0.1 * (high - low)
        corners = low - margin + np.array(unit, dtype=np.float64) * (high - low + 2.0 * margin)
        return closing.joined(Closing(closing.ends[:0], corners, np.array(around, dtype=np.int64)))
    if turns != 1 or not rims:
        raise DrySideError("'outside' needs a wetted surface with the body around it")
    return closing


def find_rims(facets: Facets) -> list[Facets]:
    """Vertices of the rims of triangles, each in the order that closes the surface; none if it is closed.

    Raises DrySideError.
    """
    dim = facets.shape[1]
    if dim == 2:
        if np.array_equal(np.sort(facets[:, 0]), np.sort(facets[:, 1])):
            return []
        raise DrySideError("'outside' needs a wetted surface that is closed")
    edges = {tuple(edge) for k in range(3) for edge in facets[:, [k, (k + 1) % 3]].tolist()}
    open_edges = [(b, a) for a, b in edges if (b, a) not in edges]
    following = dict(sorted(open_edges))
    if len(following) < len(open_edges):
        raise DrySideError("'outside' needs a wetted surface whose openings do not touch each other")
    rims = []
    while following:
        rim = [next(iter(following))]
        while (vertex := following.pop(rim[-1])) != rim[0]:
            rim.append(vertex)
        rims.append(np.array(rim, dtype=np.int64))
    return rims


def _lid(points: Array, rim: Facets, box: tuple[Array, Array]) -> Closing:
    """A surface without a part in the box that closes an opening. Raises DrySideError.

    A strip leads from the rim, which must be on faces of the box, straight away from the middle of the box; then come
    triangles to a point far away. The rim may move on its faces: each piece of the strip stays behind one face.
    """
    low, high = box
    middle, size = 0.5 * (low + high), float(np.linalg.norm(high - low))
    n = len(rim)
    near, far = np.arange(n), n + np.arange(n)
    near_next, far_next = np.roll(near, -1), np.roll(far, -1)
    x = np.concatenate([points[rim], middle + 2.0 * (points[rim] - middle)])
    strip = np.concatenate([np.stack([near, near_next, far_next], axis=1), np.stack([near, far_next, far], axis=1)])
    if meets(x[strip], box).any():
        raise DrySideError("'outside' needs a wetted surface that is closed or ends on faces of the box")
    fan = np.stack([far, far_next, np.full(n, 2 * n)], axis=1)
    ways = sorted(product((-1, 0, 1), repeat=3), key=lambda way: -np.dot(way, (points[rim] - middle).mean(axis=0)))
    for way in (np.array(way) for way in ways if any(way)):
        lid = np.concatenate([x, [middle + 10.0 * size * way / np.linalg.norm(way)]])
        if not meets(lid[fan], box).any():
            return Closing(rim, lid[n:], np.concatenate([strip, fan]))
    raise DrySideError("'outside' needs a wetted surface whose openings can be closed outside of the box")


def meets(triangles: Array, box: tuple[Array, Array]) -> NDArray[np.bool_]:
    """Which triangles, shape (n, 3, 3), have a part in the box, its boundary left out.

    They have none if one of 13 axes separates both: normals of the box, of the triangle, products of their edges.
    Source: T. Akenine-Moller, J. Graphics Tools 6 (2001) 29-33.
    """
    low, high = box
    x = triangles - 0.5 * (low + high)
    half = 0.5 * (high - low)
    edges = np.roll(x, -1, axis=1) - x
    normals = np.cross(edges[:, :1], edges[:, 1:2])
    crossed = np.cross(edges[:, :, None, :], np.eye(3)).reshape(len(x), 9, 3)
    axes = np.concatenate([np.broadcast_to(np.eye(3), (len(x), 3, 3)), normals, crossed], axis=1)
    along = np.einsum("nak,nvk->nav", axes, x)
    reach = np.abs(axes) @ half
    margin = 1e-9 * np.linalg.norm(axes, axis=2) * float((high - low).max())
    apart = (along.min(axis=2) >= reach - margin) | (along.max(axis=2) <= margin - reach)
    return np.asarray(~(apart & (reach > 0.0)).any(axis=1))


def _turns(inside: Array, points: Array, facets: Facets, closing: Closing) -> int:
    """How often the closed surface winds around a body, most of its points."""
    x, around = closing.together(points, facets)
    motion = Motion(x, np.zeros_like(x))
    return int(np.round(np.median([winding(point, motion, around) for point in inside])))


#: Corners and facets of the unit square and cube, with the solid inside.
_UNIT_BOX = {
    2: ([[0, 0], [1, 0], [1, 1], [0, 1]], [[0, 1], [1, 2], [2, 3], [3, 0]]),
    3: (
        [[x, y, z] for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))],
        [[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7]]
        + [triangle for a, b in ((0, 1), (1, 2), (2, 3), (3, 0)) for triangle in ([a, b, b + 4], [a, b + 4, a + 4])],
    ),
}
