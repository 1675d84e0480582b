"""The table of the fluid in cut cells: properties that hold in every pose of a family of bodies."""

import numpy as np
import pytest
from cut_scenes import EVEN, FAMILIES, assert_pose, assert_same, block, joined, table_of

from solvers.cut_cells import ClosedSurfaces, components_of, cut_cells


@pytest.mark.parametrize("name", FAMILIES)
def test_poses(name):
    """Regions close, faces agree, components, volume and area are right; the exact kernel finds the same."""
    for seed in range(12):
        assert_same(assert_pose(FAMILIES[name], seed), assert_pose(FAMILIES[name], seed, only_exact=True))


@pytest.mark.slow(seconds=20)
@pytest.mark.parametrize("name", FAMILIES)
def test_many_poses(name):
    for seed in range(1000, 1300):
        assert_same(assert_pose(FAMILIES[name], seed), assert_pose(FAMILIES[name], seed, only_exact=True))


@pytest.mark.parametrize(("name", "share"), [("ball", 0.9), ("plate of 1e-7", 1.0), ("hollow", 0.9)])
def test_the_fast_kernel_serves_most_cells(name, share):
    tables = [assert_pose(FAMILIES[name], seed) for seed in range(10)]
    cells = np.concatenate([table.exact[table.state == 2] for table in tables])
    assert 1.0 - cells.mean() >= share


def slanted(gap: int) -> tuple:
    """Two bodies across the box with parallel slanted faces, gap multiples of 2^-48 apart along x."""
    x, facets = block([-9, -9, -9], [0, 9, 9])
    y, _ = block([0, -9, -9], [9, 9, 9])
    for points in (x, y):
        points[points[:, 0] == 0, 0] = 2.3125 + (points[points[:, 0] == 0] @ [0, 0.0625, 0.03125])
    y[y[:, 0] < 8, 0] += gap * 2.0**-48
    return joined((x, facets), (y, facets))


@pytest.mark.parametrize(("gap", "components"), [(0, 0), (1, 1), (-1, 0), (64, 1)])
def test_one_step_of_the_lattice(gap, components):
    """Fluid between faces one step of the lattice apart is found, and no fluid where they touch or overlap by that."""
    x, facets, body = slanted(gap)
    table = table_of(EVEN, x, facets, body)
    assert components_of(table).count == components
    assert table.share.sum() * (gap > 0) == pytest.approx(max(gap, 0) * 2.0**-48 * 25, rel=0.2, abs=1e-18)
    expected = (2 * 25 * np.sqrt(1 + 0.0625**2 + 0.03125**2)) * (gap > 0)
    assert table.piece_area.sum() == pytest.approx(expected, rel=1e-13)


def test_numbers_of_bodies_and_facets_do_not_matter():
    """Facets and bodies in another order: the same regions; coincident facets belong to the first body."""
    for seed in range(10):
        edges, x, facets, body = FAMILIES["three bodies, coplanar"].pose(seed)
        order = np.random.default_rng(seed).permutation(len(facets))
        one = table_of(edges, x, facets, body)
        other = table_of(edges, x, facets[order], 2 - body[order])
        assert len(one.cell) == len(other.cell)
        keys = [np.lexsort((table.share.round(12), table.cell)) for table in (one, other)]
        assert np.abs(one.share[keys[0]] - other.share[keys[1]]).max() < 1e-14
        assert one.piece_area.sum() == pytest.approx(other.piece_area.sum(), rel=1e-14)
        assert components_of(one).count == components_of(other).count


def test_scale_and_place_do_not_matter():
    """A thousand times smaller, far from the origin, flat cells: rounding of the input is all that differs."""
    edges, x, facets, body = FAMILIES["overlapping cubes"].pose(3)
    one = table_of(edges, x, facets, body)
    for scale, shift in ((1e-3, 0.0), (1e3, 0.0), (1e-3, 5.0), (np.array([1.0, 1e-3, 1.0]), 0.0)):
        stretched = [edge * s + shift for edge, s in zip(edges, scale * np.ones(3), strict=True)]
        other = table_of(stretched, scale * x + shift, facets, body)
        assert len(one.cell) == len(other.cell)
        assert np.abs(one.share - other.share).max() < 1e-11
        assert np.abs(one.face_area - other.face_area).max() < 1e-11


def test_beside_something_far_away():
    """A body far outside of the box coarsens the lattice, but by no more than its distance demands."""
    edges, x, facets, body = FAMILIES["cube"].pose(4)
    one = table_of(edges, x, facets, body)
    far = block([3e6, 0, 0], [3.1e6, 1, 1])
    other = table_of(edges, *joined((x, facets), far))
    assert one.quantum == 2.0**-48
    assert other.quantum == 2.0**-39
    assert np.abs(one.share - other.share).max() < 1e-10


def test_many_facets_in_a_cell():
    """8,192 facets, 150 in a cell, by the fast kernel; the volume is that of the body."""
    from cut_scenes import sphere, volume

    x, facets = sphere((2.52, 2.47, 2.55), 1.7, 5)
    table = table_of(EVEN, x, facets, 0 * facets[:, 0])
    assert not table.exact[table.state == 2].any()
    solid = 125 - table.share.sum() - (table.state == 0).sum()
    assert solid == pytest.approx(volume(table.vertices, facets), abs=1e-12)


def test_no_bodies():
    none = np.zeros((0, 3), dtype=np.int64)
    table = table_of(EVEN, np.zeros((0, 3)), none, none[:, 0])
    assert (table.state == 0).all()
    assert components_of(table).count == 1


X, FACETS = block([1.2] * 3, [3.3] * 3)


@pytest.mark.parametrize(
    ("facets", "body", "message"),
    [
        (FACETS[1:], np.zeros(11, int), "the surface of body 0 is not closed"),
        (FACETS, np.arange(12) // 6, "the surface of body 0 is not closed"),
        (FACETS[:, :1], np.zeros(12, int), r"facets must have the shape (m, 2) or (m, 3), not (12, 1)"),
        (FACETS, np.zeros(3, int), r"body must have the shape (12,), not (3,)"),
        (-FACETS, np.zeros(12, int), "numbers of vertices and bodies must not be negative"),
        (FACETS * [1, 1, 0] + FACETS[:, :1] * [0, 0, 1], np.zeros(12, int), "facet 0 has a vertex twice"),
    ],
)
def test_mistakes_in_surfaces(facets, body, message):
    with pytest.raises(ValueError) as error:
        ClosedSurfaces(facets, body)
    assert str(error.value) == message


@pytest.mark.parametrize(
    ("edges", "x", "message"),
    [
        (EVEN[:2], X, "3 arrays of grid lines must fit the facets, not 2"),
        (EVEN, X[:, :2], "vertices must have the shape (n, 3), not (8, 2)"),
        (EVEN, np.where(X == 1.2, np.nan, X), "vertex 0 is not finite"),
        (EVEN, X[:4], "facets name vertices that are not there"),
        ((np.array([0.0, 1, 1]), *EVEN[1:]), X, "edges must increase"),
        (EVEN, X * 1e14, "the smallest cell is too small beside the extent of the box and the bodies"),
    ],
)
def test_mistakes_in_grid_and_vertices(edges, x, message):
    with pytest.raises(ValueError) as error:
        cut_cells(edges, np.array([0.2, 0.8]), ClosedSurfaces(FACETS, np.zeros(12, int)), x)
    assert str(error.value) == message
