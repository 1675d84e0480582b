"""Bodies that pass through walls of the box or leave it are named; those that reach through from the start are not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_sentinel_overlaps import block, circle, moving, ring_facets

from solvers.api import FailureKind
from solvers.sentinels.walls import BoxWalls, Wall

BOX = np.array([-2.0, 0.0]), np.array([2.0, 4.0])
FLOOR = Wall("w", "y-", 0.0)


def watch(bodies, walls=(FLOOR,), box=BOX):
    sentinel = BoxWalls(bodies, walls, box)
    sentinel.start(0.0)
    return sentinel


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("depth", [-1e-9, 0.01, 0.2])
def test_a_body_behind_a_wall(depth, scale):
    points, facets = block(2, cells=10)
    box = scale * BOX[0], scale * BOX[1]
    body = moving("a", scale * points, facets, [(0.0, scale), (0.0, -depth * scale)])
    found = watch([body], box=box).look(1.0, 1.0)
    assert len(found) == (depth > 0.0)
    for finding in found:
        assert (finding.kind, finding.body) == ("wall", "a")
        assert finding.value == pytest.approx(depth * scale)
        assert finding.worthless is (FailureKind.NOT_HELD if depth == 0.2 else None)
        assert finding.message.startswith(
            f"a has passed through the face y- of the box (patch w) by {depth * scale:.3g}"
        )


@pytest.mark.parametrize("face", ["x-", "x+", "y+"])
def test_all_faces(face):
    points, facets = block(2)
    position = {"x-": -2.0, "x+": 2.0, "y+": 4.0}[face]
    way = np.eye(2)["xy".index(face[0])] * (1.0 if face[1] == "+" else -1.0)
    first = np.array([0.0, 1.0])
    body = moving("a", points, facets, [first, first + 2.1 * way if face != "x+" else first + 1.1 * way])
    (found,) = watch([body], [Wall("w", face, position)]).look(1.0, 1.0)
    assert found.value == pytest.approx(0.1)


def test_a_hole_in_the_wall():
    """Only the part of the face that the patch has is a wall."""
    points, facets = block(2, cells=10)
    body = moving("a", points, facets, [(0.0, 1.0), (0.0, -0.5)])
    for within, seen in ((lambda x: x[0] > 1.5, False), (lambda x: x[0] > 0.5, True)):
        assert bool(watch([body], [Wall("w", "y-", 0.0, within)]).look(1.0, 1.0)) == seen


def test_vertices_without_fluid_may_pass():
    """A face of the box holds fluid, and the bodies in it."""
    points, facets = block(2, cells=10)
    low = np.isclose(points[:, 1], points[:, 1].min())
    body = moving("a", points, facets, [(0.0, 1.0), (0.0, -0.5)])
    for dry, seen in ((low, True), (points[:, 1] < 0.7, False)):
        assert bool(watch([replace(body, dry=dry)]).look(1.0, 1.0)) == seen


def test_a_body_that_stands_on_the_wall_and_sinks():
    points, facets = block(2, cells=10)
    foot = np.isclose(points[:, 1], 0.0)
    sinks = np.where(foot[:, None], [0.0, -0.02], 0.0)
    stands, rests = np.zeros_like(points), np.zeros_like(points)
    rests[foot, 0] = 0.01
    sentinel = watch([moving("a", points, facets, [stands, rests, sinks])])
    assert sentinel.look(1.0, 1.0) == []
    assert [finding.value for finding in sentinel.look(2.0, 1.0)] == [pytest.approx(0.02)]


def test_a_body_that_reaches_through_a_face():
    points, facets = block(2)
    tube = moving("a", points, facets, [(0.0, -0.5), (0.0, -0.6)])
    assert watch([tube]).look(1.0, 1.0) == []


@pytest.mark.parametrize("count", [12, 24, 96])
def test_arcs_of_a_disc_on_an_obstacle_at_the_wall(count):
    """The middle of a facet touches the obstacle, so its vertices are behind the wall by the height of the arc."""
    radius = 0.5
    points = circle(count, radius)
    deep = radius * (1.0 - np.cos(np.pi / count))
    body = moving("a", points, ring_facets(count), [(0.0, 2.0), (0.0, radius - deep), (0.0, radius - 3.0 * deep)])
    assert watch([body]).look(1.0, 1.0) == []
    assert [finding.kind for finding in watch([body]).look(2.0, 1.0)] == ["wall"]


def test_a_body_that_leaves_the_box():
    points, facets = block(2)
    body = moving("a", points, facets, [(0.0, 1.0), (1.5, 1.0), (2.1, 1.0)])
    sentinel = watch([body], [])
    assert sentinel.look(1.0, 1.0) == []
    (found,) = sentinel.look(2.0, 1.0)
    assert (found.kind, found.body, found.worthless) == ("outside", "a", None)
    assert watch([moving("a", points, facets, [(5.0, 1.0)] * 2)], []).look(1.0, 1.0) == []


def test_driven_bodies_go_where_they_are_told():
    points, facets = block(2)
    body = moving("a", points, facets, [(0.0, 1.0), (0.0, -3.0)], free=False)
    assert watch([body]).look(1.0, 1.0) == []
