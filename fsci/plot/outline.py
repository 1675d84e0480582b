"""The points on the surface of a part of the output: in the plane in their order along the outline."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fsci.plot.render import CORNERS_OF_FACE, Array
from fsci.plot.render_flow import LINE


def surface_points(mesh: Any) -> tuple[NDArray[np.int64], Array | None]:
    """The points of the surface of a mesh; in the plane along its outline, with the first one at its end, and lengths.

    Of several outlines one follows the other.
    """
    marked = mesh.copy(deep=False)
    marked.point_data["number of the point"] = np.arange(mesh.n_points)
    if np.ptp(np.asarray(mesh.points)[:, 2]) > 0.0:
        surface = marked.extract_surface(algorithm="dataset_surface", nonlinear_subdivision=0)
        return np.unique(np.asarray(surface.point_data["number of the point"], dtype=np.int64)), None
    edges = _edges(marked)
    following: dict[int, int] = dict(edges.tolist())
    order: list[int] = []
    while following:
        point = min(following)
        order.append(point)
        while point in following:
            point = following.pop(point)
            order.append(point)
    points = np.array(order)
    steps = np.linalg.norm(np.diff(np.asarray(mesh.points)[points], axis=0), axis=1)
    return points, np.concatenate([[0.0], np.cumsum(steps)])


def _edges(mesh: Any) -> NDArray[np.int64]:
    """(first, last) point of the outer edges of a plane mesh, with the cell on the left."""
    found = []
    for kind, cells in mesh.cells_dict.items():
        if kind == LINE:
            return np.asarray(cells, dtype=np.int64)
        corners = CORNERS_OF_FACE[kind]
        for first in range(corners):
            ends = [cells[:, first], cells[:, (first + 1) % corners]]
            if cells.shape[1] > corners:
                ends.insert(1, cells[:, corners + first])
            found += [np.stack(pair, axis=1) for pair in pairwise(ends)]
    edges = np.concatenate(found)
    _, where, counts = np.unique(np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True)
    return np.asarray(edges[where[counts == 1]], dtype=np.int64)
