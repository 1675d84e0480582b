"""Bodies that overlap or pass through each other are named with depth and place; their twins are not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from solvers.api import FailureKind
from solvers.sentinels.bodies import MovingBody
from solvers.sentinels.overlaps import Meeting, Overlaps

TRIANGLES = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]


def block(dim, size=1.0, cells=4):
    """(points, facets) of a cube, or of a square with so many facets on each side."""
    if dim == 3:
        x = np.array([[x, y, z] for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))], dtype=float)
        return size * x, np.array([t for a, b, c, d in TRIANGLES for t in ((a, b, c), (a, c, d))])
    s = np.arange(cells) / cells
    sides = [np.stack(p, axis=1) for p in ((s, 0 * s), (1 + 0 * s, s), (1 - s, 1 + 0 * s), (0 * s, 1 - s))]
    return size * np.concatenate(sides), ring_facets(4 * cells)


def ring_facets(count):
    return np.stack([np.arange(count), np.roll(np.arange(count), -1)], axis=1)


def circle(count, radius, angle=0.0):
    turn = angle + 2.0 * np.pi * np.arange(count) / count
    return radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)


def moving(name, points, facets, ways, *, free=True):
    """A body that is moved by ways[t] at the times t = 0, 1, ..."""
    return MovingBody(name, facets, lambda t: points + np.asarray(ways[round(t)], dtype=float), free)


def watch(bodies, meetings=None, tied=()):
    sentinel = Overlaps(bodies, meetings or {}, set(tied))
    sentinel.start(0.0)
    return sentinel


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
@pytest.mark.parametrize("origin", [0.0, 1e3])
@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("dim", [2, 3])
def test_overlap_is_named_with_its_depth(dim, scale, origin, order):
    axis = scale * np.eye(dim)[1]
    points, facets = block(dim)
    points = scale * (points + origin)
    still = moving("still", points, facets, [0 * axis] * 2, free=False)
    for depth, seen in ((0.01, True), (-1e-9, False), (0.3, True)):
        other = moving("other", points + 0.3 * scale * np.eye(dim)[0], facets, [1.2 * axis, (1.0 - depth) * axis])
        bodies = [(still, other)[i] for i in order]
        found = watch(bodies).look(1.0, 1.0)
        assert len(found) == seen
        if seen:
            assert found[0].kind == "overlap"
            assert found[0].body == " and ".join(body.name for body in bodies)
            assert found[0].value == pytest.approx(depth * scale, rel=1e-6)
            assert f"{found[0].value:.3g}" in found[0].message
            assert "no pair of contact" in found[0].message
            assert found[0].worthless is (FailureKind.NOT_HELD if depth == 0.3 else None)


def test_rigid_bodies_are_told_another_remedy():
    """They have no pairs."""
    points, facets = block(2)
    still = replace(moving("still", points, facets, [(0.0, 0.0)] * 2, free=False), rigid=True)
    other = moving("other", points, facets, [(0.0, 1.2), (0.0, 0.7)])
    for rigid, words in ((True, "move one of them, or take a smaller 'step'"), (False, "give them a pair")):
        (found,) = watch([still, replace(other, rigid=rigid)]).look(1.0, 1.0)
        assert found.message.endswith(words)


@pytest.mark.parametrize("count", [3, 7])
def test_plates_that_cross_without_a_vertex_in_each_other(count):
    """Two thin plates as an X: their long facets have no vertex near the crossing."""
    x = np.linspace(-1, 1, count)
    plate = np.concatenate([np.stack([x, 0 * x - 0.005], axis=1), np.stack([x[::-1], 0 * x + 0.005], axis=1)])
    facets = ring_facets(2 * count)
    upright = plate[:, ::-1] * np.array([-1.0, 1.0]) + np.array([0.31 / count, 0.0])
    one = moving("one", plate, facets, [(3.0, 0.0), (0.0, 0.0)])
    two = moving("two", upright, facets, [(0.0, 0.0)] * 2)
    assert [finding.kind for finding in watch([one, two]).look(1.0, 1.0)] == ["overlap"]
    assert watch([one, two]).look(0.0, 1.0) == []


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("free", [True, False])
def test_passage_within_a_step(dim, free):
    """A body that is on the other side of a thin wall after one step; beside the wall it may go."""
    points, facets = block(dim)
    wall = moving("wall", points * np.array([0.02, *[1.0] * (dim - 1)]), facets, [np.zeros(dim)] * 3, free=False)
    along, across = np.eye(dim)[:2]
    ball = moving("ball", 0.2 * points + 0.4 * np.ones(dim), facets, [-2 * along, 2 * along], free=True)
    (found,) = watch([wall, ball]).look(1.0, 1.0)
    assert (found.kind, found.worthless) == ("passage", FailureKind.PASSAGE)
    beside = moving("ball", 0.2 * points + 0.4 * np.ones(dim), facets, [5 * across - 2 * along, 5 * across + 2 * along])
    assert watch([wall, beside]).look(1.0, 1.0) == []
    back = moving("ball", 0.2 * points + 0.4 * np.ones(dim), facets, [-2 * along, -0.7 * along], free=free)
    assert watch([wall, back]).look(1.0, 1.0) == []


def test_bodies_that_are_driven_may_overlap():
    points, facets = block(2)
    bodies = [moving(name, points, facets, [(0.0, y)] * 2, free=False) for name, y in (("a", 0.0), ("b", 0.5))]
    assert watch(bodies).look(1.0, 1.0) == []


def test_what_overlaps_at_the_start_may_stay_but_nothing_more():
    """A flag that begins in a cylinder, and then its free end comes back to it."""
    points, facets = block(2, cells=8)
    flag = moving("flag", points * np.array([2.0, 0.1]), facets, [(0.0, 0.45)] * 3)
    cylinder = moving(
        "cylinder", points - np.array([0.9, 0.0]), facets, [(0.0, 0.0), (0.05, 0.0), (0.4, 0.0)], free=False
    )
    sentinel = watch([flag, cylinder])
    assert sentinel.look(0.0, 1.0) == []
    (found,) = sentinel.look(2.0, 1.0)
    assert found.kind == "overlap"


def test_bodies_that_overlap_on_purpose_go_on():
    """Two plates that cross in the plane, such as beams at different depths: new parts meet, and the run goes on."""
    points, facets = block(2, cells=20)
    one = moving("one", points * np.array([2.0, 0.1]), facets, [(0.0, 0.0)] * 2)
    two = moving("two", points * np.array([0.1, 2.0]), facets, [(1.0, -1.0), (1.5, -1.0)])
    (found,) = watch([one, two]).look(1.0, 1.0)
    assert (found.kind, found.worthless) == ("overlap", None)
    apart = moving("two", points * np.array([0.1, 2.0]), facets, [(3.0, -1.0), (1.5, -1.0)])
    assert [finding.worthless for finding in watch([one, apart]).look(1.0, 1.0)] == [FailureKind.NOT_HELD]


def test_a_pair_must_remove_the_overlap_of_its_surfaces():
    points, facets = block(2)
    lower = moving("lower", points, facets, [(0.0, 0.0)] * 2)
    upper = moving("upper", points, facets, [(0.0, 0.7), (0.0, 1.0)])
    on_bottom, on_top = (np.isclose(points[facets][:, :, 1], y).all(axis=1) for y in (0.0, 1.0))
    meeting = {frozenset(("lower", "upper")): Meeting(("p",), "upper", {"upper": on_bottom, "lower": on_top})}
    assert watch([lower, upper], meeting).look(1.0, 1.0) == []
    (found,) = watch([lower, upper], meeting).look(0.0, 1.0)
    assert found.value == pytest.approx(0.3)
    assert found.worthless is FailureKind.PASSAGE
    assert "contact (p) does not hold them apart" in found.message


def test_tied_bodies_are_one():
    points, facets = block(2)
    bodies = [moving("a", points, facets, [(0.0, 0.0)] * 2), moving("b", points, facets, [(0.0, 1.0), (0.0, 0.9)])]
    assert watch(bodies, tied=[frozenset("ab")]).look(1.0, 1.0) == []


@pytest.mark.parametrize("inner", [12, 16, 31])
@pytest.mark.parametrize("outer", [13, 16, 40])
def test_facets_of_a_shaft_that_turns_in_a_bush(inner, outer):
    """Polygons through the same circle overlap by their arcs; a shaft that is larger by more is seen."""
    hole = np.concatenate([circle(outer, 1.0)[::-1], circle(outer, 2.0)])
    facets = np.concatenate([ring_facets(outer), outer + ring_facets(outer)])
    bush = moving("bush", hole, facets, [(0.0, 0.0)] * 10, free=False)
    arcs = (1.0 - np.cos(np.pi / inner)) + (1.0 - np.cos(np.pi / outer))
    for larger in (0.0, 2.0 * arcs):
        shaft = MovingBody(
            "shaft",
            ring_facets(inner),
            lambda t, r=larger: circle(inner, (0.5 if t == 0.0 else 1.0) + r * (t > 0.0), 0.1 * t),
            True,
        )
        found = [finding for t in range(1, 10) for finding in watch([bush, shaft]).look(float(t), 1.0)]
        assert bool(found) == (larger > 0.0)


@pytest.mark.parametrize(
    ("size", "at", "depth"), [(0.2, 0.35, 0.45), (0.2, 0.9, 0.1), (0.2, 1.0, 0.0), (0.2, 1.5, 0.0)]
)
def test_overlap_at_the_start(size, at, depth):
    """Also of a body that is whole in another one, where no surfaces cross."""
    points, facets = block(2)
    large = moving("large", points, facets, [(0.0, 0.0)])
    small = moving("small", size * points, facets, [(at, at)])
    found = list(watch([large, small]).overlapping())
    assert [pair[:2] for pair in found] == [("large", "small")] * (depth > 0.0)
    assert [pair[2] for pair in found] == pytest.approx([depth] * (depth > 0.0), abs=1e-6)


def test_a_resumed_sentinel_sees_the_same():
    points, facets = block(2)
    wall = moving("wall", points * np.array([0.02, 1.0]), facets, [(0.0, 0.0)] * 3, free=False)
    ball = moving("ball", 0.2 * points + 0.4, facets, [(-2.0, 0.0), (-1.0, 0.0), (1.0, 0.0)])
    straight, resumed = watch([wall, ball]), watch([wall, ball])
    assert straight.look(1.0, 1.0) == []
    resumed.restore(straight.save())
    assert resumed.look(2.0, 1.0) == straight.look(2.0, 1.0) != []
