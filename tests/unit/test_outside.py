"""What closes the solid around tubes and membranes in 3D: it winds once around every point that is not fluid."""

import numpy as np
import pytest

from fsci.builder.dry_side import Closing, DrySideError
from fsci.builder.outside import find_rims, meets, surround
from solvers.fluid.surfaces.inside import winding
from solvers.fluid.surfaces.surface import Motion

BOX = np.zeros(3), np.array([1.0, 1.0, 1.5])


def sheet(x, around, *, closed):
    """Triangles on a grid of points, shape (along, around, 3); closed: in the second direction."""
    along = len(x)
    number = np.arange(along * around).reshape(along, around)
    number = np.concatenate([number, number[:, :1]], axis=1) if closed else number
    a, b, c, d = number[:-1, :-1].ravel(), number[:-1, 1:].ravel(), number[1:, 1:].ravel(), number[1:, :-1].ravel()
    return x.reshape(-1, 3), np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def tube(path, radius, around=12):
    """(points, facets) of a tube around path(s), s from 0 to 1, with the solid outside; radius(s) [m]."""
    s = np.linspace(0, 1, 13)
    middle = np.array([path(value)[0] for value in s])
    across = np.array([np.cross(path(value)[1], [0, 1, 0]) for value in s])
    angles = 2 * np.pi * np.arange(around) / around
    turn = np.cos(angles)[:, None] * across[:, None] + np.sin(angles)[:, None] * np.array([0, 1.0, 0])
    points, facets = sheet(
        middle[:, None] + np.array([radius(v) for v in s])[:, None, None] * turn, around, closed=True
    )
    return points, facets


def straight(s):
    return np.array([0.45, 0.52, 1.5 * s]), np.array([0.0, 0.0, 1.0])


def bend(s):
    """A quarter of a circle, from the face x- to the face z-."""
    angle = 0.5 * np.pi * s
    return 0.5 * np.array([np.sin(angle), 1.0, np.cos(angle)]), np.array([np.cos(angle), 0.0, -np.sin(angle)])


def longer(s):
    return np.array([0.45, 0.52, 2.5 * s - 0.5]), np.array([0.0, 0.0, 1.0])


TUBES = {
    "straight": (straight, lambda s: 0.3),
    "bulging": (straight, lambda s: 0.2 + 0.15 * np.sin(np.pi * s)),
    "bent": (bend, lambda s: 0.2),
    "longer than the box": (longer, lambda s: 0.3),
}


def turns(points, facets, closing, x):
    vertices, around = closing.together(points, facets)
    return winding(np.asarray(x), Motion(vertices, 0.0 * vertices), around)


@pytest.mark.parametrize("flipped", [False, True], ids=["fluid inside", "fluid around"])
@pytest.mark.parametrize("name", TUBES)
def test_tubes(name, flipped):
    path, radius = TUBES[name]
    points, facets = tube(path, radius)
    if flipped:
        facets = facets[:, ::-1]
    wall = np.array([path(v)[0] for v in np.linspace(0.2, 0.8, 7)])
    solid = wall if flipped else wall + np.array([0.0, radius(0.5) + 0.02, 0.0])
    closing = surround(points, facets, solid, BOX)
    assert len(closing.ends) == 24
    rng = np.random.default_rng(1)
    curve = np.array([path(v)[0] for v in np.linspace(0, 1, 400)])
    widths = np.array([radius(v) for v in np.linspace(0, 1, 400)])
    for x in rng.uniform(BOX[0], BOX[1], (200, 3)):
        off = (np.linalg.norm(curve - x, axis=1) / widths).min()
        if 0.9 < off < 1.1:
            continue  # chords
        assert abs(turns(points, facets, closing, x) - ((off < 1) == flipped)) < 1e-9, (x, off)


@pytest.mark.parametrize("up", [False, True])
def test_membrane(up):
    """Over the whole box, with its rim on four faces: the solid is below or above it, where the body is."""
    grid = np.linspace(0, 1, 9)
    x, y = np.meshgrid(grid, grid, indexing="ij")
    z = 0.6 + 0.3 * np.sin(np.pi * x) * np.sin(np.pi * y)
    points, facets = sheet(np.stack([x, y, z], axis=2), 9, closed=False)
    facets = facets if up else facets[:, ::-1]
    inside = np.array([[0.4, 0.5, 1.2 if up else 0.3]] * 3)
    closing = surround(points, facets, inside, BOX)
    for x in np.random.default_rng(2).uniform(BOX[0], BOX[1], (200, 3)):
        height = x[2] - 0.6 - 0.3 * np.sin(np.pi * x[0]) * np.sin(np.pi * x[1])
        if abs(height) > 0.03:
            assert abs(turns(points, facets, closing, x) - ((height > 0) == up)) < 1e-9, x


def test_what_cannot_be_closed():
    points, facets = tube(straight, lambda s: 0.3)
    solid = np.array([[0.45, 0.9, 0.7]] * 3)
    with pytest.raises(DrySideError, match="closed or ends on faces of the box"):
        surround(points * [1, 1, 0.9], facets, solid, BOX)
    for inside in ([[0.45, 0.52, 0.7]] * 3, [[0.45, 0.52, 0.7], [0.45, 0.5, 0.7], [0.45, 0.9, 0.7]]):
        with pytest.raises(DrySideError, match="the body around it"):
            surround(points, np.concatenate([facets, facets + 0]), np.array(inside), BOX)
    with pytest.raises(DrySideError, match="do not touch"):
        find_rims(np.array([[0, 1, 2], [0, 3, 4]]))


def test_rims():
    _, facets = tube(straight, lambda s: 0.3)
    rims = find_rims(facets)
    assert sorted(map(sorted, rims)) == [list(range(12)), list(range(144, 156))]
    edges = set(map(tuple, np.concatenate([facets[:, [k, (k + 1) % 3]] for k in range(3)]).tolist()))
    for rim in rims:
        around = list(zip(rim.tolist(), np.roll(rim, -1).tolist(), strict=True))
        assert all(edge[::-1] in edges and edge not in edges for edge in around)


def test_triangles_and_a_box():
    """Against points of the triangles; those that only touch the box are outside."""
    rng = np.random.default_rng(3)
    triangles = rng.uniform(-1.5, 2.5, (400, 3, 3))
    shares = rng.dirichlet(np.ones(3), 4000)
    x = np.einsum("pv,tvk->tpk", shares, triangles)
    found = ((x > BOX[0]) & (x < BOX[1])).all(axis=2).any(axis=1)
    said = meets(triangles, BOX)
    assert (said >= found).all()
    assert (said != found).sum() <= 4
    assert 50 < found.sum() < 350
    touching = np.array([[[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[1, 0.5, 0.5], [2, 0, 0], [2, 1, 1]]], dtype=float)
    assert not meets(touching, BOX).any()


def test_two_closings_are_one():
    one = Closing(np.array([4]), np.ones((2, 3)), np.array([[0, 1, 2]]))
    two = Closing(np.array([7, 5]), np.zeros((1, 3)), np.array([[1, 0, 2]]))
    both = one.joined(two)
    assert both.ends.tolist() == [4, 7, 5]
    assert both.facets.tolist() == [[0, 3, 4], [2, 1, 5]]
    _, facets = both.together(np.zeros((8, 3)), np.array([[0, 1, 2]]))
    assert facets.tolist() == [[0, 1, 2], [4, 8, 9], [5, 7, 10]]
