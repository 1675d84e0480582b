"""Bodies that overlap or pass through themselves are named; those that fold, touch, turn and fly are not."""

from __future__ import annotations

import numpy as np
import pytest

from fsci import shapes
from solvers.api import FailureKind
from solvers.mesh.penetration import windings
from solvers.mesh.tessellation import tessellate
from solvers.sentinels.bodies import MovingBody
from solvers.sentinels.self_overlaps import SelfOverlaps

WALL = 0.2
OPENING = 60.0  #: degrees


def clip(dim, base=False):
    """(vertices, facets) of a ring with a slit at the right, in 3D 0.3 high; base: a block is at its back."""
    around = 360.0 - OPENING
    cells, sizes = [24, 2], {"inner_radius": 0.9, "outer_radius": 0.9 + WALL, "angle": around, "start": 0.5 * OPENING}
    mesh = shapes.ring(cells=cells, **sizes) if dim == 2 else shapes.tube(height=0.3, cells=[*cells, 1], **sizes)
    facets, nodes = tessellate(mesh)
    points = mesh.points[nodes]
    if base:
        back = points[:, 0] < -1.05
        points[back, 0] -= 0.8
    return points, facets


def bent(points, by):
    """The ring closed by an angle [degrees] at each of its ends, in proportion to the angle from the back."""
    radius, angle = np.hypot(points[:, 0], points[:, 1]), np.arctan2(points[:, 1], -points[:, 0])
    angle = angle * (1.0 + by / (180.0 - 0.5 * OPENING))
    found = points.copy()
    found[:, 0], found[:, 1] = -radius * np.cos(angle), radius * np.sin(angle)
    return found


def watch(states, facets, pairs=("p",), times=None):
    body = MovingBody("clip", facets, lambda t: states[round(t)], free=True)
    sentinel = SelfOverlaps([body], {"clip": pairs} if pairs else {})
    sentinel.start(0.0)
    return sentinel


def test_windings():
    """A rod that is wound twice around encloses points twice."""
    turns = np.linspace(0, 4 * np.pi, 41)
    inner, outer = ((r * np.cos(turns), r * np.sin(turns)) for r in (0.5, 1.0))
    x = np.concatenate([np.stack(outer, axis=1), np.stack(inner, axis=1)[::-1]])
    corners = x[np.stack([np.arange(len(x)), np.roll(np.arange(len(x)), -1)], axis=1)]
    points = np.array([[0.7, 0.2], [-0.3, 0.65], [0.1, 0.1], [2.0, 0.0]])
    assert windings(points, corners).tolist() == [2, 2, 0, 0]


@pytest.mark.parametrize(("scale", "origin"), [(1.0, 0.0), (1e-3, 0.0), (1.0, 1e3)])
@pytest.mark.parametrize("dim", [2, 3])
def test_ends_that_overlap(dim, scale, origin):
    """The ends of a clip meet after 30 degrees each; with more they are in each other."""
    points, facets = clip(dim)
    for closed, kinds in ((29.0, []), (30.0, []), (33.2 if dim == 2 else 31.9, [None]), (40.0, [FailureKind.PASSAGE])):
        states = [scale * (bent(points, by) + origin) for by in (0.0, closed)]
        found = watch(states, facets).look(1.0, 1.0)
        assert [finding.worthless for finding in found] == kinds, closed
        assert all(finding.kind == "overlap" for finding in found)
        if found:
            assert np.linalg.norm(np.array(found[0].where) / scale - origin - np.eye(dim)[0]) < 0.35
            assert "contact (p) does not hold it apart" in found[0].message


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("base", [False, True])
def test_ends_that_pass_through_each_other(dim, base):
    """In one step, so that nothing overlaps at its ends; by and by their first overlap ends it."""
    points, facets = clip(dim, base)
    along = np.zeros_like(points)
    along[points[:, 1] > 0.0, 1], along[points[:, 1] < 0.0, 1] = -1.0, 1.0
    tips = points[:, 0] > 0.4
    states = [points, points + 1.4 * along * tips[:, None]]
    [found] = watch(states, facets).look(1.0, 1.0)
    assert (found.kind, found.worthless) == ("passage", FailureKind.PASSAGE)
    assert found.message.startswith("clip passes through itself within the step at (")


def test_without_a_pair():
    points, facets = clip(2)
    states = [points, bent(points, 45.0)]
    [found] = watch(states, facets, pairs=()).look(1.0, 1.0)
    assert (found.kind, found.worthless) == ("overlap", FailureKind.NOT_HELD)
    assert "no pair of contact names its surface, so nothing holds it apart; give it a pair 'self'" in found.message
    states = [bent(points, 45.0), bent(points, 45.1)]  # it was so at the start
    assert watch(states, facets, pairs=()).look(1.0, 1.0) == []


@pytest.mark.parametrize("dim", [2, 3])
def test_a_clip_that_turns_and_flies(dim):
    """By 80 degrees and many sizes in a step, bent a little: nothing, and nothing is looked for again."""
    points, facets = clip(dim)
    c, s = np.cos(np.radians(80)), np.sin(np.radians(80))
    turn = np.eye(dim)
    turn[:2, :2] = [[c, -s], [s, c]]
    states = [points, points + 30.0, points @ turn.T + 100.0, bent(points, 2.0) @ turn @ turn]
    sentinel = watch(states, facets)
    assert [sentinel.look(float(t), 1.0) for t in (1, 2, 3)] == [[], [], []]


def test_a_resumed_sentinel_sees_the_same():
    points, facets = clip(2)
    states = [points, bent(points, 28.0), bent(points, 40.0)]
    whole, resumed = watch(states, facets), watch(states, facets)
    assert whole.look(1.0, 1.0) == []
    resumed.restore(whole.save())
    assert whole.look(2.0, 1.0) == resumed.look(2.0, 1.0) != []
