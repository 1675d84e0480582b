"""Facets divided where another surface lies on them: parts that fill the facet, and the covered area."""

from __future__ import annotations

import numpy as np
import pytest

from coupling.divided_facets import divide_facets
from coupling.ties import join_vertices
from solvers.mesh.tessellation import area_vectors, is_closed


def line(xs, y, *, up):
    """(vertices, facets) of a line along x with the solid below or above."""
    x = np.stack([xs, np.full(len(xs), y)], axis=1)
    facets = np.stack([np.arange(1, len(xs)), np.arange(len(xs) - 1)], axis=1)
    return x, facets if up else facets[:, ::-1]


def plate(xs, ys, *, up):
    """(vertices, triangles) of a plate in z = 0 with the solid below or above."""
    x, y = np.meshgrid(xs, ys)
    points = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    n, found = len(xs), []
    for j in range(len(ys) - 1):
        for i in range(n - 1):
            a = j * n + i
            found += [[a, a + 1, a + n + 1], [a, a + n + 1, a + n]]
    facets = np.array(found)
    return points, facets if up else facets[:, ::-1]


def areas(found, x):
    points = x if found.mixture is None else found.mixture @ x
    return points, np.linalg.norm(area_vectors(points[found.facets]), axis=1)


@pytest.mark.parametrize(
    ("one", "other", "covered"),
    [
        (line(np.linspace(0, 1, 5), 0.0, up=True), line(np.linspace(0.31, 0.62, 4), 0.0, up=False), 0.31),
        (line(np.linspace(0, 1, 5), 0.0, up=True), line(np.linspace(0, 1, 8), 1e-3, up=False), 1.0),
        (line(np.linspace(0, 1, 5), 0.0, up=True), line(np.linspace(0, 1, 8), 0.0, up=True), 0.0),
        (line(np.linspace(0, 1, 5), 0.0, up=True), line(np.linspace(0, 1, 8), 0.5, up=False), 0.0),
        (
            plate(np.linspace(0, 1, 4), np.linspace(0, 1, 3), up=True),
            plate(np.linspace(0.21, 0.87, 3), np.linspace(0.1, 0.64, 5), up=False),
            0.66 * 0.54,
        ),
    ],
)
def test_the_covered_area(one, other, covered):
    (x, facets), (y, others) = one, other
    found = divide_facets(x, facets, [(np.ones(len(facets), dtype=bool), y[others])])
    points, area = areas(found, x)
    whole = np.linalg.norm(area_vectors(x[facets]), axis=1)
    assert np.bincount(found.parents, area, len(facets)) == pytest.approx(whole, rel=1e-9)
    assert area[found.tied].sum() == pytest.approx(covered, rel=1e-9, abs=1e-12)
    assert (area_vectors(points[found.facets])[:, -1] > 0.0).all()


def test_a_closed_surface_in_2d_stays_closed():
    x = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    facets = np.array([[0, 1], [1, 2], [2, 3], [3, 0]])
    y, others = line(np.array([0.2, 0.5, 0.7]), 1.0, up=False)
    found = divide_facets(x, facets, [(np.array([False, False, True, False]), y[others])])
    assert is_closed(found.facets)
    assert found.tied.sum() == 2


def brick(n):
    """(vertices, triangles out of the solid) of the unit cube's surface, n x n squares on each side."""
    points, found = [], []
    for axis in range(3):
        for side in (0.0, 1.0):
            x, facets = plate(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1), up=side > 0.0)
            found.append(facets + sum(map(len, points)))
            points.append(np.roll(x + np.array([0.0, 0.0, side]), axis, axis=1))
    unique, number = np.unique(np.concatenate(points).round(12), axis=0, return_inverse=True)
    return unique, number.ravel()[np.concatenate(found)]


@pytest.mark.parametrize("angle", [0.0, 0.3])
@pytest.mark.parametrize("bulge", [0.0, 0.02])
def test_a_closed_surface_in_space_stays_closed(angle, bulge):
    """Facets beside those that are divided are divided at the vertices in their edges, also where a side is bent."""
    x, facets = brick(3)
    x[:, 2] += bulge * np.sin(np.pi * x[:, 0]) * x[:, 2]
    y, others = plate(np.linspace(0.21, 0.87, 3), np.linspace(0.1, 0.64, 5), up=False)
    turn = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    y = y @ turn.T + [0.1, 0.0, 1.0]
    found = divide_facets(x, facets, [((x[facets][:, :, 2] > 0.99).all(axis=1), y[others])])
    assert is_closed(found.facets)
    points, area = areas(found, x)
    whole = np.linalg.norm(area_vectors(x[facets]), axis=1)
    assert np.bincount(found.parents, area, len(facets)) == pytest.approx(whole, rel=1e-9)
    beside = found.parents[(points[found.facets][:, :, 2] < 0.99).any(axis=1)]
    assert len(beside) > len(np.unique(beside)) or angle == 0.0
    moved = np.random.default_rng(1).standard_normal((len(x), 3))
    volume = np.linalg.det((found.mixture @ moved)[found.facets]).sum()
    assert volume == pytest.approx(np.linalg.det(moved[facets]).sum(), rel=1e-9)


def test_both_sides_have_the_same_vertices():
    """Whatever the bodies do, the tied parts of both sides lie on each other."""
    x, facets = line(np.linspace(0, 1, 6), 0.0, up=True)
    y, others = line(np.linspace(0, 1, 7), 0.0, up=False)
    one = divide_facets(x, facets, [(np.ones(len(facets), dtype=bool), y[others])])
    other = divide_facets(y, others, [(np.ones(len(others), dtype=bool), x[facets])])
    assert one.mixture is not None
    assert other.mixture is not None
    points = [one.mixture @ x, other.mixture @ y]
    tied = [np.unique(side.facets[side.tied]) for side in (one, other)]
    rows = join_vertices([(one.mixture, len(x)), (other.mixture, len(y))], points, tied)
    moved = np.random.default_rng(1).standard_normal((len(x) + len(y), 2))
    lines = [
        {tuple(sorted(map(tuple, (row @ moved)[facet].tolist()))) for facet in side.facets}
        for row, side in zip(rows, (one, other), strict=True)
    ]
    assert lines[0] == lines[1]
