"""A closed surface of triangles as the mesh of a rigid body, of which no more than the surface is used.

The cells are the cones from the mean of the nodes to the triangles. They may overlap or be inside out: with their signs
they add up to the body, and two of them share each face but the triangle itself, which so is the mesh's boundary.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from solvers.api import EPS
from solvers.mesh.mesh import Mesh
from solvers.mesh.tessellation import area_vectors

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


#: Facets of a part, evenly over it, that are looked for in other parts.
MOST_FACETS_SOUGHT = 200


class BadSurface(ValueError):
    """A surface that encloses no body."""


def split(points: Array, quads: Indices) -> Indices:
    """Two triangles of each quadrilateral, one after the other, so that a concave one is not left: (2 n, 3)."""
    ways = np.array([[[0, 1, 2], [0, 2, 3]], [[1, 2, 3], [1, 3, 0]]])
    first, second = np.moveaxis(area_vectors(points[quads[:, ways[0]]]), 1, 0)
    concave = np.einsum("ni,ni->n", first, second) < 0.0
    return np.where(concave[:, None, None], quads[:, ways[1]], quads[:, ways[0]]).reshape(-1, 3)


def cones(points: Array, triangles: Indices, numbers: Indices, surfaces: Mapping[str, Indices]) -> Mesh:
    """The mesh that a closed surface encloses.

    points: (n, 3) [m], equal ones become one node; triangles: (m, 3); numbers: of their facets in the file, from 1 on;
    surfaces: name -> triangles. Raises BadSurface with the place of a hole, or of a facet that faces the wrong way.
    """
    nodes, same = np.unique(points, axis=0, return_inverse=True)
    triangles = same.ravel()[triangles]
    kept = np.flatnonzero((triangles != np.roll(triangles, 1, axis=1)).all(axis=1))
    place = np.full(len(triangles), -1)
    place[kept] = np.arange(len(kept))
    triangles, numbers = triangles[kept], numbers[kept]
    used, triangles = np.unique(triangles, return_inverse=True)
    nodes, triangles = nodes[used], triangles.reshape(-1, 3).astype(np.int64)
    _require_extent(nodes, triangles, numbers)
    _require_closed(nodes, triangles, numbers)
    triangles, note = _outward(nodes, triangles)

    chosen = {name: place[of][place[of] >= 0] for name, of in surfaces.items()}
    return Mesh(
        np.vstack([nodes, nodes.mean(axis=0)]),
        np.column_stack([np.full(len(triangles), len(nodes)), triangles]),
        "tetra",
        surfaces={name: triangles[np.unique(of)] for name, of in chosen.items() if len(of)},
        numbers=numbers,
        note=note,
        cones=True,
    )


def _require_extent(nodes: Array, triangles: Indices, numbers: Indices) -> None:
    """A triangle has an area. Rounded positions cannot say where a thinner one faces."""
    x = nodes[triangles]
    edges = np.linalg.norm(x - np.roll(x, 1, axis=1), axis=2).max(axis=1)
    height = 2.0 * np.linalg.norm(area_vectors(x), axis=1) / edges
    flat = np.flatnonzero(height <= EPS * np.abs(nodes).max())
    if len(flat):
        where = _facet(nodes, triangles, numbers, int(flat[0]))
        raise BadSurface(f"{where}{_more(flat)} has no area: its corners are on a line; make the surface anew")


def _require_closed(nodes: Array, triangles: Indices, numbers: Indices) -> None:
    """Each edge has as many triangles on one side as on the other one: it is run through both ways."""
    ends = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    edges, number = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True)
    number = number.ravel()
    ways = np.bincount(number, weights=np.where(ends[:, 0] < ends[:, 1], 1.0, -1.0)).astype(int)
    if not ways.any():
        return
    count = np.bincount(number)
    if (count == 1).any():
        raise BadSurface(_hole(nodes, edges[count == 1]))
    if (count % 2).any():
        edge = edges[np.flatnonzero(count % 2)[0]]
        raise BadSurface(
            f"{count[count % 2 == 1][0]} facets meet in the edge at {_at(nodes[edge].mean(axis=0))}, "
            "where those of a closed surface are two: remove walls inside of it"
        )
    facet = number.reshape(-1, 3)
    parts = _joined(facet, (ways == 0) & (count == 2))
    wrong = np.flatnonzero((ways[facet] != 0).any(axis=1))
    size = np.bincount(parts)[parts]
    first = int(wrong[size[wrong].argmin()])
    turned = np.flatnonzero(parts == parts[first])
    raise BadSurface(
        f"{_facet(nodes, triangles, numbers, first)}{_more(turned)} faces the other way than its neighbours: "
        "turn it round"
    )


def _hole(nodes: Array, edges: Indices) -> str:
    """The message of edges that have one facet only."""
    used, local = np.unique(edges, return_inverse=True)
    local = local.reshape(-1, 2)
    ring = _connected(local, len(used))
    count = int(ring.max()) + 1
    first = nodes[edges[ring[local[:, 0]] == 0]].mean(axis=1)
    others = "" if count == 1 else f" and {count - 1} more"
    return (
        f"the surface is open: a hole with {len(first)} edges around {_at(first.mean(axis=0))}{others}; "
        "close it: the facets of a solid enclose it, and share their corners exactly"
    )


def _joined(facet: Indices, through: NDArray[np.bool_]) -> Indices:
    """The part of each triangle, of those that share edges of a mask; facet: edges of the triangles, (m, 3)."""
    owner, edge = np.repeat(np.arange(len(facet)), 3), facet.ravel()
    chosen = through[edge]
    owner, edge = owner[chosen], edge[chosen]
    order = np.argsort(edge, kind="stable")
    owner, edge = owner[order], edge[order]
    same = np.flatnonzero(edge[1:] == edge[:-1])
    return _connected(np.column_stack([owner[same], owner[same + 1]]), len(facet))


def _connected(links: Indices, count: int) -> Indices:
    """Number of the part that each of so many things is in; links: pairs of them, (n, 2)."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    matrix = coo_array((np.ones(len(links)), links.T), (count, count))
    return np.asarray(connected_components(matrix, directed=False)[1])


def _outward(nodes: Array, triangles: Indices) -> tuple[Indices, str]:
    """The triangles seen counterclockwise from outside, with a note to the user if all were turned round.

    Parts that do not touch are bodies, or cavities of one: right are those around which a body is on one side.
    """
    ends = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, number = np.unique(ends, axis=0, return_inverse=True)
    parts = _joined(number.reshape(-1, 3), np.ones(number.max() + 1, dtype=bool))
    x = nodes[triangles] - nodes.mean(axis=0)
    volumes = np.linalg.det(x) / 6.0
    note = ""
    if volumes.sum() < 0.0:
        triangles, volumes = triangles[:, [0, 2, 1]], -volumes
        note = "its facets face inwards: they were turned round"
    _require_apart(nodes, triangles, parts, np.bincount(parts, weights=volumes).astype(float))
    return triangles, note


def _require_apart(nodes: Array, triangles: Indices, parts: Indices, volumes: Array) -> None:
    """Parts that overlap would count twice, and one inside out is a cavity; volumes: of the parts, with signs."""
    x = nodes[triangles]
    boxes = [(x[parts == part].min(axis=(0, 1)), x[parts == part].max(axis=(0, 1))) for part in range(len(volumes))]
    low, high = (np.array(ends) for ends in zip(*boxes, strict=True))
    for part, volume in enumerate(volumes):
        near = ((low <= high[part]) & (high >= low[part])).all(axis=1)
        near[part] = False
        others, own = x[near[parts]], x[parts == part].mean(axis=1)
        for middle in own[:: -(-len(own) // MOST_FACETS_SOUGHT)]:
            around = round(_solid_angle(others - middle) / (4.0 * np.pi))
            if around == (0 if volume > 0.0 else 1):
                continue
            what = "lies in another one" if volume > 0.0 else "faces inwards, but it is no cavity of another one"
            raise BadSurface(f"the part of {len(own)} facets with one at {_at(middle)} {what}: join them, or move it")


def _solid_angle(x: Array) -> float:
    """Solid angle of triangles (n, 3, 3) seen from the origin, in sum.

    A. van Oosterom, J. Strackee, IEEE Trans. Biomed. Eng. 30 (1983) 125-126.
    """
    a, b, c = np.moveaxis(x, 1, 0)
    r, s, t = (np.linalg.norm(one, axis=1) for one in (a, b, c))
    below = r * s * t
    below = below + np.einsum("ni,ni->n", a, b) * t + np.einsum("ni,ni->n", a, c) * s + np.einsum("ni,ni->n", b, c) * r
    return float(2.0 * np.arctan2(np.linalg.det(x), below).sum())


def _facet(nodes: Array, triangles: Indices, numbers: Indices, one: int) -> str:
    return f"facet {numbers[one]} at {_at(nodes[triangles[one]].mean(axis=0))}"


def _more(found: Indices) -> str:
    return f" (and {len(found) - 1:,} more)" if len(found) > 1 else ""


def _at(x: Array) -> str:
    return f"({', '.join(f'{one:.6g}' for one in x)})"
