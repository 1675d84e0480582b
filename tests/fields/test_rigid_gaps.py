"""Gaps of points to a polyhedron: the nearest facet of all, also where pairs of points and facets are left out."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from solvers.rigid.gaps import feet, gaps

NUMBERS = np.random.default_rng(5)


def polyhedron(count: int) -> np.ndarray:
    """Corners of the facets of a hull around the origin, of all sizes, with normals outwards."""
    points = NUMBERS.normal(size=(count, 3)) * [1.0, 0.4, 0.7]
    hull = ConvexHull(points)
    corners = points[hull.simplices]
    inwards = (
        np.einsum("md,md->m", np.cross(*(corners[:, i] - corners[:, 0] for i in (1, 2))), hull.equations[:, :3]) < 0
    )
    corners[inwards] = corners[inwards][:, ::-1]
    return corners


@pytest.mark.parametrize("scale", [1.0, 1e-3])
@pytest.mark.parametrize("within", [np.inf, 0.5])
def test_gaps_are_distances_from_the_nearest_of_all_facets(scale, within):
    corners, x = scale * polyhedron(60), scale * NUMBERS.normal(size=(200, 3))
    found = gaps(x, corners, within=scale * within)
    everywhere = [np.linalg.norm(x - feet(x, np.broadcast_to(one, (len(x), 3, 3))), axis=1) for one in corners]
    nearest = np.min(everywhere, axis=0)
    near = nearest < scale * within
    n = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inside = (np.einsum("xmd,md->xm", x[:, None] - corners[None, :, 0], n) < 0.0).all(axis=1)
    assert np.array_equal(np.isfinite(found.gap), near)
    assert inside.any()
    assert found.gap[near] == pytest.approx(np.where(inside, -nearest, nearest)[near], rel=1e-9)


def test_a_vertex_that_has_entered_came_through_a_facet_that_faces_it():
    """The body is flat along y: facets that look along it are nearer to points that look along -x."""
    corners = polyhedron(60)
    x = 0.02 * NUMBERS.normal(size=(40, 3))
    outward = np.tile([-1.0, 0.0, 0.0], (len(x), 1))
    found = gaps(x, corners, outward)
    n = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facing = n @ outward[0] < 0.0
    distances = [np.linalg.norm(x - feet(x, np.broadcast_to(one, (len(x), 3, 3))), axis=1) for one in corners[facing]]
    assert found.gap == pytest.approx(-np.min(distances, axis=0), rel=1e-9)
    assert facing[found.facet].all()
