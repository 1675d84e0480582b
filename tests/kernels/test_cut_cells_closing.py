"""The closing length of the table of cut cells: surfaces that touch after a rotation, gaps, wedges, thin bodies."""

import numpy as np
import pytest
from cut_scenes import (
    EVEN,
    FAMILIES,
    FLAP,
    HALF_PLATE,
    Family,
    all_area,
    assert_same,
    between_walls,
    block,
    fluid_volume,
    identity_errors,
    joined,
    mirrored,
    of,
    one_body,
    rotation,
    slight,
    sphere,
    table_of,
    volume,
)
from fluid_setup import loop

from solvers.cut_cells import components_of

UPPER, LOWER = block([-0.3, -7, -7], [0, 7, 0.6]), block([0, -7, -0.7], [0.3, 7, 7])
BLOCKS = block([-0.6, -1, -1], [0, 1, 1]), block([0, -0.5, -1.2], [0.5, 1.3, 0.7])  # touch in 1.5 x 1.7
TOUCHING = {
    "plates": Family(of(UPPER, LOWER), slight, components=2),
    "layers of one body": Family(one_body(UPPER, LOWER), slight, components=2),
    "blocks": Family(of(*BLOCKS)),
    "blocks and a third one": Family(of(*BLOCKS, block([-0.2, 0.9, -0.3], [0.2, 1.2, 0.4]))),
    "layers with facets in common": Family(one_body(FLAP, mirrored(FLAP))),
}
ANY = 1e-9


def posed(family, seed, closing):
    edges, x, facets, body = family.pose(seed)
    return edges, facets, body, table_of(edges, x, facets, body, closing=closing)


def assert_touching(name, seed):
    """Components; sums of cells and faces but for rounding of the ends of zones; the length does not matter."""
    edges, facets, _, table = posed(TOUCHING[name], seed, ANY)
    assert components_of(table).count == TOUCHING[name].components, seed
    assert max(identity_errors(edges, table, facets)) < 2e-13, seed
    assert table.share.min(initial=1.0) > 0.0, seed
    both_sides = table.face_regions.min(axis=1) >= 0
    assert (table.face_area[both_sides] > 0.0).all(), seed
    return table


@pytest.mark.parametrize("name", TOUCHING)
def test_rotated_faces_that_touch_do_not_leak(name):
    for seed in range(20):
        assert_touching(name, seed)


@pytest.mark.slow(seconds=20)
@pytest.mark.parametrize("name", TOUCHING)
def test_many_rotated_faces_do_not_leak(name):
    for seed in range(1000, 2000):
        assert_touching(name, seed)


def test_without_the_length_they_leak():
    counts = [components_of(posed(TOUCHING["plates"], seed, 0.0)[3]).count for seed in range(20)]
    assert len(set(counts)) > 1


@pytest.mark.parametrize("name", ["plates", "layers of one body", "blocks"])
def test_any_length_closes_what_touches(name):
    """Nine decades of it: the same table."""
    for seed in range(6):
        tables = [posed(TOUCHING[name], seed, closing)[3] for closing in (1e-11, 1e-9, 1e-6, 1e-2)]
        for table in tables[1:]:
            assert (tables[0].cell == table.cell).all()
            assert np.abs(tables[0].moments - table.moments).max() < 1e-13
            assert np.abs(tables[0].closed_moments - table.closed_moments).max() < 1e-13


def test_only_cells_that_the_plane_of_contact_crosses_are_dear():
    """A pair of facets that touch is no concern of other cells around them: these need the exact kernel no oftener."""
    for seed in range(12):
        edges, x, facets, body = TOUCHING["plates"].pose(seed)
        at = x[np.flatnonzero(UPPER[0][:, 0] == 0.0)]
        normal = np.cross(at[1] - at[0], at[2] - at[0])
        low, size = (np.stack([c.ravel(order="F") for c in np.meshgrid(*some, indexing="ij")], axis=1) for some in (
            [edge[:-1] for edge in edges], [np.diff(edge) for edge in edges]))  # fmt: skip
        crossed = np.abs((low + 0.5 * size - at[0]) @ normal) < 0.5001 * size @ np.abs(normal)
        without, with_length = (table_of(edges, x, facets, body, closing=closing).exact for closing in (0.0, ANY))
        assert not (with_length & ~without & ~crossed).any(), seed
        assert (with_length & crossed).any(), seed


def test_the_closed_part_is_where_blocks_touch():
    for seed in range(20):
        edges, facets, body, table = posed(TOUCHING["blocks"], seed, ANY)
        closed = table.closed_moments.sum(axis=(1, 2))
        for one in (0, 1):
            assert abs(closed[body[table.closed_facet] == one].sum() - 1.5 * 1.7) < 1e-12
        assert abs(table.piece_area.sum() + closed.sum() - all_area(table.vertices, (None, facets))) < 1e-12
        assert abs(125 - fluid_volume(edges, table) - volume(table.vertices, facets)) < 1e-13


def parted(gap):
    shifted = HALF_PLATE[0] - [gap, 0, 0]
    return Family(of((shifted, HALF_PLATE[1]), mirrored(HALF_PLATE)), slight)


@pytest.mark.parametrize("closing", [1e-10, 1e-6, 1e-3, 0.05])
def test_plates_part(closing):
    """Closed up to the length, then the gap opens as a whole: no region is thinner than the length."""
    for seed in range(8):
        for gap, components in ((0.0, 2), (0.3, 2), (0.999, 2), (1.001, 3), (3.0, 3)):
            edges, facets, _, table = posed(parted(gap * closing), seed, closing)
            assert components_of(table).count == components
            assert (len(table.closed_facet) > 0) == (components == 2)
            error = max(identity_errors(edges, table, facets))
            assert error < 1e-13
            between = between_walls(facets, table)
            thin = between[between < 0.25]  # the plates are as thick as 0.3, the fluid behind them is thicker
            assert (abs(thin - gap * closing) < 1e-13).all()
            assert (len(thin) > 0) == (components == 3)


def wedge(slope):
    """Two blocks; between them is a wedge, 1.6 wide, from y = -0.6 to 0.6."""
    x, facets = block([0, -0.6, -0.8], [0.9, 0.6, 0.8])
    x[x[:, 0] == 0, 0] += slope * (x[x[:, 0] == 0, 1] + 0.6)
    return Family(of(block([-0.3, -0.6, -0.8], [0, 0.6, 0.8]), (x, facets)))


@pytest.mark.parametrize(("slope", "closing"), [(0.5, 0.1), (0.5, 1e-3), (1e-2, 3e-3), (1e-5, 3e-6)])
def test_a_wedge_closes_up_to_the_length(slope, closing):
    """It closes where its sides are closing / sin(angle) from its edge: an isosceles prism."""
    side = closing / np.sin(np.arctan(slope))
    for seed in range(8):
        edges, facets, _, table = posed(wedge(slope), seed, closing)
        closed = 1.6 * 0.5 * side * closing
        gone = 125 - volume(table.vertices, facets) - fluid_volume(edges, table)
        assert abs(gone - closed) < 1e-6 * closed + 1e-13
        assert table.closed_moments.sum() == pytest.approx(2 * 1.6 * side, rel=1e-6)
        assert components_of(table).count == 1
        assert max(identity_errors(edges, table, facets)) < 4 * closing  # the end of the wedge has no pieces
        between = between_walls(facets, table)
        assert between.min() > 0.9999 * closing


@pytest.mark.parametrize(("gap", "closing", "components"), [(1e-6, 1e-5, 1), (1e-3, 2e-3, 1), (1e-3, 9e-4, 2), (0, 1e-9, 1)])  # fmt: skip  # noqa: E501
def test_a_ball_in_a_ball_of_the_same_facets(gap, closing, components):
    """No fluid is left at the edges of a curved gap, though facets bend there."""

    def scene(rng):
        y, facets = sphere((0, 0, 0), 0.9, 2)
        x, all_facets, body = joined((y, facets), (y * (1 + gap / 0.9), facets[:, ::-1]), block([-1.2] * 3, [1.2] * 3))
        return x, all_facets, np.minimum(body, 1)

    for seed in range(4):
        edges, facets, body, table = posed(Family(scene), seed, closing)
        assert components_of(table).count == components
        if components == 1:
            closed = table.closed_moments.sum(axis=(1, 2))
            area = all_area(table.vertices, (None, facets[body == 0]))
            assert closed[body[table.closed_facet] == 0].sum() == pytest.approx(area, rel=1e-12)
            assert abs(fluid_volume(edges, table) - 125 + 2.4**3) < 1e-12


NOT_TOUCHING = ("cube", "ball", "plate of 0.3", "plate of 1e-3", "plate of 1e-7", "plate within", "nested", "hollow", "overlapping cubes")  # fmt: skip  # noqa: E501


@pytest.mark.parametrize("name", NOT_TOUCHING)
def test_no_body_is_closed_by_its_own_thickness(name):
    for seed in range(6):
        one, other = (posed(FAMILIES[name], seed, closing)[3] for closing in (0.0, 0.1))
        assert_same(one, other)
        assert len(other.closed_facet) == 0


@pytest.mark.parametrize("name", FAMILIES)
def test_what_touches_exactly_stays(name):
    """Facets that coincide or lie in planes of the grid: the length adds no more than what is closed."""
    for seed in range(6):
        edges, facets, _, table = posed(FAMILIES[name], seed, ANY)
        assert components_of(table).count == FAMILIES[name].components
        assert max(identity_errors(edges, table, facets)) < 1e-14


@pytest.mark.parametrize("name", ["blocks and a third one", "plates"])
def test_order_scale_and_place_do_not_matter(name):
    """Facets and bodies in another order, a thousandth of the size, and beside something far away."""
    for seed in range(6):
        edges, x, facets, body = TOUCHING[name].pose(seed)
        one = table_of(edges, x, facets, body, closing=1e-4)
        order = np.random.default_rng(seed).permutation(len(facets))
        x_far, more = block([3e6, 0, 0], [3.1e6, 1, 1])
        far = np.concatenate([x, x_far]), np.concatenate([facets, more + len(x)]), np.append(body, 0 * more[:, 0] + 9)
        for other in (
            table_of(edges, x, facets[order], body.max() - body[order], closing=1e-4),
            table_of([1e-3 * edge for edge in edges], 1e-3 * x, facets, body, closing=1e-7),
            table_of(edges, *far, closing=1e-4),
        ):
            assert len(other.cell) == len(one.cell)
            keys = [np.lexsort((table.share.round(9), table.cell)) for table in (one, other)]
            assert np.abs(one.share[keys[0]] - other.share[keys[1]]).max() < 1e-10
            assert components_of(other).count == TOUCHING[name].components
            scale = all_area(other.vertices, (None, facets[:1])) / all_area(one.vertices, (None, facets[:1]))
            if scale < 0.5:
                assert other.closed_moments.sum() / scale == pytest.approx(one.closed_moments.sum(), rel=1e-9)


def test_more_of_random_bodies_closes_with_the_length():
    """Bodies that cross at any angle: regions have no negative volume, the fluid shrinks, its areas do not grow."""
    for seed in range(8):
        rng = np.random.default_rng(seed)
        shapes = block([-0.8, -0.5, -0.1], [0.7, 0.6, 0.1]), sphere((0, 0, 0), 0.7, 1), block([-0.4] * 3, [0.4] * 3)
        bodies = [(x @ rotation(rng).T + 2.5 + rng.uniform(-0.6, 0.6, 3), facets) for x, facets in shapes]
        last = 125.0
        for closing in (0.0, 1e-6, 1e-3, 0.03, 0.3):
            table = table_of(EVEN, *joined(*bodies), closing=closing)
            fluid = fluid_volume(EVEN, table)
            assert table.share.min() > -1e-14
            assert fluid <= last + 1e-13
            last = fluid


def rectangle(low, high):
    (a, b), (c, d) = low, high
    return np.array([[a, b], [c, b], [c, d], [a, d]])


@pytest.mark.parametrize("seed", range(12))
def test_plane(seed):
    """Two rectangles that touch along 1.3 after a rotation, and two that close the box."""
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0, 2 * np.pi)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    facets, body = np.concatenate([loop(4), loop(4) + 4]), np.repeat([0, 1], 4)
    x = np.concatenate([rectangle([-0.6, -1], [0, 0.8]), rectangle([0, -0.5], [0.5, 1.3])]) @ turn.T + 2.5
    table = table_of(EVEN[:2], x, facets, body, closing=1e-6)
    closed = table.closed_moments.sum(axis=(1, 2))
    assert np.abs([closed[body[table.closed_facet] == k].sum() - 1.3 for k in (0, 1)]).max() < 1e-12
    assert abs(25 - fluid_volume(EVEN[:2], table) - 0.6 * 1.8 - 0.5 * 1.8) < 1e-12
    assert max(identity_errors(EVEN[:2], table, facets)) < 2e-13
    x = np.concatenate([rectangle([-0.3, -9], [0, 0.2]), rectangle([0, -0.1], [0.3, 9])]) @ turn.T + 2.5
    assert components_of(table_of(EVEN[:2], x, facets, body, closing=1e-6)).count == 2


@pytest.mark.parametrize("closing", [-1e-3, 0.51, np.nan])
def test_mistakes_in_the_length(closing):
    x, facets = block([1.2] * 3, [3.3] * 3)
    with pytest.raises(ValueError) as error:
        table_of(EVEN, x, facets, np.zeros(12, int), closing=closing)
    assert str(error.value) == "the closing length must be from 0 to half of the smallest cell, 0.5"
