"""The table of the fluid in cut cells against voxels and the moments kernel."""

import numpy as np
import pytest
from cut_scenes import FAMILIES, STEPS, block, joined, table_of
from fluid_setup import circle, loop
from scipy import ndimage

from solvers import kernels
from solvers.cut_cells import CellState, components_of
from solvers.fluid.grid.box import Grid
from solvers.mesh.gauss import gauss

POINTS, WEIGHTS = gauss(3)
FINE = 4  #: voxels in a cell, in each direction


def random_blocks(seed: int):
    """Blocks with corners on quarters of cells, many of them in planes of the grid or in common, and their voxels."""
    rng = np.random.default_rng(seed)
    solid, bodies = np.zeros((3 * FINE + 2,) * 3, dtype=bool), []  # with those just outside of the box
    for _ in range(rng.integers(1, 5)):
        low = rng.integers(-1, 3 * FINE - 1, 3)
        high = low + rng.integers(1, 7, 3)
        if rng.random() < 0.5:
            axis = rng.integers(3)
            low[axis] = FINE * rng.integers(0, 3)
        high = np.maximum(high, low + 1)
        inside = tuple(slice(a + 1, b + 1) for a, b in zip(low, high, strict=True))
        solid[inside] = True
        bodies.append(block(low / FINE, high / FINE))
    return joined(*bodies), solid


def regions_of_voxels(solid):
    """(number of the region of each voxel, -1: solid; cell and share of regions, sorted by cell)."""
    found, cells, shares = np.full(solid.shape, -1), [], []
    for cell in range(27):
        i, j, k = np.unravel_index(cell, (3, 3, 3), order="F")
        inside = tuple(slice(FINE * n, FINE * n + FINE) for n in (i, j, k))
        label, count = ndimage.label(~solid[inside])
        found[inside] = np.where(label > 0, label - 1 + len(cells), -1)
        cells += count * [cell]
        shares += [float((label == n + 1).sum() / FINE**3) for n in range(count)]
    return found, np.array(cells), np.array(shares)


def links_of_voxels(region):
    """Sorted rows (axis, region below, region above, area of their common face)."""
    rows = {}
    for axis in range(3):
        for plane in (FINE, 2 * FINE):
            below, above = (np.take(region, at, axis).ravel() for at in (plane - 1, plane))
            for pair in zip(below[(below >= 0) & (above >= 0)], above[(below >= 0) & (above >= 0)], strict=True):
                rows[axis, *pair] = rows.get((axis, *pair), 0) + FINE**-2
    return rows


@pytest.mark.parametrize("first", [0, pytest.param(1000, marks=pytest.mark.slow(seconds=60))])
def test_blocks_against_voxels(first):
    """Regions, faces, components, the surface: of blocks that touch, overlap and lie in planes of the grid."""
    edges = (np.arange(4.0),) * 3
    for seed in range(first, first + (60 if first == 0 else 3000)):
        (x, facets, body), with_outside = random_blocks(seed)
        solid = with_outside[1:-1, 1:-1, 1:-1]
        table = table_of(edges, x, facets, body)
        region, cells, shares = regions_of_voxels(solid)
        whole = ~np.isin(np.arange(27), table.cell) & (table.state != CellState.SOLID)
        mine = np.concatenate([table.cell, np.flatnonzero(whole)])
        assert (np.sort(mine) == cells).all(), seed
        order = np.lexsort((np.concatenate([table.share, np.ones(whole.sum())]), mine))
        assert np.abs(np.concatenate([table.share, np.ones(whole.sum())])[order] - shares[np.lexsort((shares, cells))]).max(initial=0) < 1e-14, seed  # fmt: skip  # noqa: E501
        assert components_of(table).count == ndimage.label(~solid)[1], seed
        links = links_of_voxels(region)
        cut = table.state == CellState.CUT
        wanted = sorted((*key[:1], *cells[list(key[1:])], size) for key, size in links.items() if cut[cells[list(key[1:])]].any())  # fmt: skip  # noqa: E501
        inside = (table.face_cells >= 0).all(axis=1)
        found = sorted(zip(table.face_axis[inside], *table.face_cells[inside].T, table.face_area[inside].round(12), strict=True))  # fmt: skip  # noqa: E501
        assert np.abs(np.array(wanted) - np.array(found)).max(initial=0.0) < 1e-11, seed
        beside = [np.roll(with_outside, step, axis)[1:-1, 1:-1, 1:-1] for axis in range(3) for step in (-1, 1)]
        surface = sum(float((~solid & there).sum()) for there in beside) / FINE**2
        assert table.piece_area.sum() == pytest.approx(surface, abs=1e-12), seed


ONE_BODY = ("cube", "ball", "plate of 0.3", "plate of 1e-3", "plate of 1e-7", "plate within", "hollow")


@pytest.mark.parametrize("name", ONE_BODY)
def test_one_body_against_the_moments_kernel(name):
    """int L_q over the fluid of each cell, and int L_q lambda_v over each piece."""
    for seed in range(6):
        edges, x, facets, body = FAMILIES[name].pose(seed)
        table = table_of(edges, x, facets, body, points=POINTS)
        moments = kernels.moments(edges, POINTS, table.vertices, facets)
        weights = np.multiply.outer(np.multiply.outer(WEIGHTS, WEIGHTS), WEIGHTS).ravel()
        total = np.zeros((table.state.size, len(weights)))
        np.add.at(total, table.cell, table.moments)
        assert np.abs(total[moments.cells] - weights + moments.solid).max() < 1e-14
        keys = table.cell[table.piece_region] * len(facets) + table.piece_facet
        order = np.argsort(keys)
        assert (keys[order] == moments.cells[moments.piece_cell] * len(facets) + moments.piece_facet).all()
        assert np.abs(table.piece_moments[order] - moments.piece_moments).max() < 1e-14


# -------------------------------------------------------------------------------------------------------------- 2D

SQUARE_GRIDS = [(np.arange(6.0),) * 2, tuple(np.append(0.0, np.cumsum(np.roll(STEPS, k))) for k in range(2))]


def box(low, high):
    (a, b), (c, d) = low, high
    return np.array([[a, b], [c, b], [c, d], [a, d]])


def plane_scene(seed: int, kind: str):
    """(vertices, segments, body of each) of discs, thin plates, or a ring, at random."""
    rng = np.random.default_rng(seed)
    shift, angle = 2.5 + rng.uniform(-0.3, 0.3, 2), rng.uniform(-0.4, 0.4)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    shapes = {
        "disc": [circle((0, 0), 1.6, 40)],
        "plate": [box([-0.005, -9], [0.005, 9])],
        "leaf": [box([-0.001, -1.3], [0.001, 1.2])],
        "two plates": [box([-0.105, -9], [-0.1, 9]), box([0.1, -9], [0.11, 9])],
        "ring": [circle((0, 0), 1.6, 40), circle((0, 0), 1.55, 40)[::-1]],
    }[kind]
    bodies = np.zeros(len(shapes), int) if kind == "ring" else np.arange(len(shapes))
    first = np.cumsum([0] + [len(x) for x in shapes])
    facets = np.concatenate([loop(len(x)) + k for x, k in zip(shapes, first, strict=False)])
    body = np.repeat(bodies, [len(x) for x in shapes])
    return np.concatenate(shapes) @ turn.T + shift, facets, body


KINDS = ("disc", "plate", "leaf", "two plates", "ring")


@pytest.mark.parametrize("kind", KINDS)
def test_plane_against_the_moments_kernel(kind):
    """int L_q over the fluid and over pieces."""
    for seed in range(8):
        edges = SQUARE_GRIDS[seed % 2]
        x, facets, body = plane_scene(seed, kind)
        table, grid = table_of(edges, x, facets, body, points=POINTS), Grid(edges)
        moments = kernels.moments(edges, POINTS, table.vertices, facets, np.ones(grid.size, dtype=bool))
        total = np.zeros((grid.size, 9))
        np.add.at(total, table.cell, table.moments)
        weights = np.outer(WEIGHTS, WEIGHTS).ravel()
        assert np.abs(total[moments.cells] - weights + moments.solid).max() < 1e-14
        pieces = np.zeros((grid.size, len(facets), 9, 2))
        np.add.at(pieces, (table.cell[table.piece_region], table.piece_facet), table.piece_moments)
        there = moments.cells[moments.piece_cell], moments.piece_facet
        # where a segment crosses a grid line at a small angle is known to the rounding error divided by it
        assert np.abs(pieces[there] - moments.piece_moments).max() < 1e-12
        pieces[there] = 0.0
        assert not pieces.any()


@pytest.mark.parametrize("kind", KINDS)
def test_plane_against_three_layers_of_space(kind):
    """Each layer of walls that stand across three layers has the regions, pieces and faces of the plane."""
    from solvers.cut_cells.layer import wall_vertices, walls

    for seed in range(5):
        edges = SQUARE_GRIDS[seed % 2]
        x, facets, body = plane_scene(seed, kind)
        plane = table_of(edges, x, facets, body)
        (triangles, of_triangle), vertices = walls(facets, body), wall_vertices(x, 3.0)
        layers = np.array([0.0, 0.9, 2.0, 3.0])
        space = table_of((*edges, layers), vertices, triangles, of_triangle)
        for layer in range(3):
            mine = space.cell // len(plane.state) == layer
            assert (space.cell[mine] % len(plane.state) == plane.cell).all()
            assert np.abs(space.share[mine] - plane.share).max() < 1e-14
            area = np.zeros(len(space.cell))
            np.add.at(area, space.piece_region, space.piece_area)
            length = np.zeros(len(plane.cell))
            np.add.at(length, plane.piece_region, plane.piece_area)
            assert np.abs(area[mine] / np.diff(layers)[layer] - length).max() < 1e-13
            sides = (space.face_axis < 2) & (space.face_cells.max(axis=1) // len(plane.state) == layer)
            assert np.abs(np.sort(space.face_area[sides]) - np.sort(plane.face_area)).max() < 1e-14
        assert components_of(space).count == components_of(plane).count


def test_three_crossing_bodies_in_the_plane():
    """Crossing bands: the solid of each cell is that of exact unions of blocks of pixels."""
    for seed in range(40):
        rng = np.random.default_rng(seed)
        solid, shapes = np.zeros((40, 40), dtype=bool), []
        for _ in range(3):
            low = rng.integers(0, 30, 2)
            high = low + rng.integers(2, 20, 2)
            solid[low[0] : high[0], low[1] : high[1]] = True
            shapes.append(box(low / 8.0, high / 8.0))
        facets = np.concatenate([loop(4) + 4 * k for k in range(3)])
        table = table_of(SQUARE_GRIDS[0], np.concatenate(shapes), facets, np.repeat(np.arange(3), 4))
        fluid = np.where(table.state == CellState.SOLID, 0.0, 1.0)
        fluid[table.state == CellState.CUT] = 0.0
        np.add.at(fluid, table.cell, table.share)
        expected = 1.0 - solid.reshape(5, 8, 5, 8).mean(axis=(1, 3))
        assert np.abs(fluid - expected.ravel(order="F")).max() < 1e-14, seed
        assert components_of(table).count == ndimage.label(~solid)[1], seed
