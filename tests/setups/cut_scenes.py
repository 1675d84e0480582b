"""Scenes of bodies in a box of 5^3 cells, random poses of them, and what every table of the fluid must satisfy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from fluid_setup import block, sphere

from solvers.cut_cells import CellState, ClosedSurfaces, CutTable, components_of, cut_cells
from solvers.mesh.gauss import gauss

N = 5
EVEN = (np.arange(N + 1.0),) * 3
STEPS = np.array([1.0, 0.8, 1.1, 0.9, 1.2])  # as long as EVEN
UNEVEN = tuple(np.append(0.0, np.cumsum(np.roll(STEPS, axis))) for axis in range(3))
MIDDLE = np.full(3, N / 2)
POINTS = gauss(2)[0]
EPS = np.finfo(float).eps

#: (vertices, triangles, body of each triangle)
Scene = tuple[np.ndarray, np.ndarray, np.ndarray]
Shape = tuple[np.ndarray, np.ndarray]


def rotation(rng) -> np.ndarray:
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q * np.linalg.det(q)


def slight(rng) -> np.ndarray:
    """A rotation after which a plate is still across the box."""
    (a, b), eye = rng.uniform(-0.45, 0.45, 2), np.eye(3)
    about_z, about_y = eye.copy(), eye.copy()
    about_z[:2, :2] = [[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]
    about_y[::2, ::2] = [[np.cos(b), np.sin(b)], [-np.sin(b), np.cos(b)]]
    return about_z @ about_y


def right(rng) -> np.ndarray:
    """A rotation by right angles: exact."""
    found = np.zeros((3, 3))
    found[np.arange(3), rng.permutation(3)] = rng.choice([-1, 1], 3)
    found[0] *= np.linalg.det(found)
    return np.round(found)


def anywhere(rng) -> np.ndarray:
    return rng.uniform(-0.3, 0.3, 3)


def on_grid(rng) -> np.ndarray:
    return rng.integers(-2, 3, 3) * 0.5


def joined(*bodies: Shape) -> Scene:
    first = np.cumsum([0] + [len(x) for x, _ in bodies])
    facets = np.concatenate([f + k for (_, f), k in zip(bodies, first, strict=False)])
    return (
        np.concatenate([x for x, _ in bodies]),
        facets,
        np.repeat(np.arange(len(bodies)), [len(f) for _, f in bodies]),
    )


def mirrored(shape: Shape) -> Shape:
    return shape[0] * [-1, 1, 1], shape[1][:, ::-1]


def volume(x, facets) -> float:
    return float(np.linalg.det(x[facets]).sum() / 6)


def area(x, facets) -> float:
    return 0.5 * float(np.linalg.norm(np.cross(x[facets[:, 1]] - x[facets[:, 0]], x[facets[:, 2]] - x[facets[:, 0]]), axis=1).sum())  # fmt: skip  # noqa: E501


@dataclass(frozen=True)
class Family:
    """Poses of a scene, and what is known of all of them."""

    scene: Callable[[np.random.Generator], Scene]
    turn: Callable = rotation
    shift: Callable = anywhere
    components: int = 1  #: of the fluid
    volume: Callable[[np.ndarray, Scene], float] | None = None  #: of the union within the box, from rounded vertices
    area: Callable[[np.ndarray, Scene], float] | None = None  #: of its surface

    def pose(self, seed: int):
        """(grid lines, vertices, triangles, bodies); lines at steps of one where bodies lie in planes of the grid."""
        rng = np.random.default_rng(seed)
        x, facets, body = self.scene(rng)
        edges = UNEVEN if self.shift is anywhere and seed % 2 else EVEN
        return edges, x @ self.turn(rng).T + MIDDLE + self.shift(rng), facets, body


def of(*bodies: Shape):
    return lambda rng: joined(*bodies)


def whole(x, scene) -> float:
    return volume(x, scene[1])


def first_volume(x, scene) -> float:
    return volume(x, scene[1][scene[2] == 0])


def first_area(x, scene) -> float:
    return area(x, scene[1][scene[2] == 0])


def all_area(x, scene) -> float:
    return area(x, scene[1])


def uncommon_area(x, scene) -> float:
    """Of facets that two bodies do not have in common."""
    keys = [tuple(sorted(map(tuple, x[facet]))) for facet in scene[1]]
    return area(x, scene[1][[keys.count(key) == 1 for key in keys]])


INNER = block([-0.7, -0.5, -0.6], [0.4, 0.8, 0.3])
OUTER = block([-1.2] * 3, [1.2] * 3)
HALF_PLATE = block([-0.3, -7, -7], [0, 7, 7])
FLAP = block([-0.3, -1.1, -1.1], [0, 1.1, 1.1])
CORNER = block([-1.0] * 3, [0.0] * 3)


def hollow(rng) -> Scene:
    x, facets, body = joined(OUTER, (INNER[0], INNER[1][:, ::-1]))
    return x, facets, 0 * body


def one_body(*bodies: Shape):
    """Layers of one body that touch."""

    def scene(rng) -> Scene:
        x, facets, body = joined(*bodies)
        return x, facets, 0 * body

    return scene


def grid_block(rng) -> Scene:
    return joined(block(-rng.integers(1, 3, 3) * 0.5, rng.integers(1, 3, 3) * 0.5))


def grid_plate(rng) -> Scene:
    return joined(block([0, -9, -9], [rng.choice([0.5, 0.25, 1.0, 1e-3]), 9, 9]))


def at_an_edge(rng) -> Scene:
    """Blocks that have an edge, a part of one, or a vertex in common."""
    return joined(CORNER, block([0, 0, rng.choice([0, -1, -0.5])], [1, 1, 1]))


def plate(thickness: float):
    return of(block([-thickness / 2, -7, -7], [thickness / 2, 7, 7]))


THREE = of(CORNER, block([0, -0.7, -0.6], [1, 0.4, 0]), block([-0.5, -0.5, -0.25], [0.75, 0.25, 0.75]))
FAMILIES = {
    "cube": Family(of(block([-0.9] * 3, [0.9] * 3)), volume=whole, area=all_area),
    "ball": Family(of(sphere((0, 0, 0), 1.4, 2)), volume=whole, area=all_area),
    "small ball": Family(of(sphere((0, 0, 0), 0.3, 1)), volume=whole, area=all_area),
    "plate of 0.3": Family(plate(0.3), slight, components=2),
    "plate of 1e-3": Family(plate(1e-3), slight, components=2),
    "plate of 1e-7": Family(plate(1e-7), slight, components=2),
    "plate within": Family(of(block([-0.005, -1.1, -1.2], [0.005, 1.1, 1.2])), volume=whole, area=all_area),
    "identical faces": Family(of(HALF_PLATE, mirrored(HALF_PLATE)), slight, components=2),
    "flap of two bodies": Family(of(FLAP, mirrored(FLAP)), volume=whole, area=uncommon_area),
    "flap of two layers": Family(one_body(FLAP, mirrored(FLAP)), volume=whole, area=uncommon_area),
    "layers beside each other": Family(
        one_body(block([-0.3, -7, -7], [0, 7, 0.6]), block([0, -7, -0.7], [0.3, 7, 7])), right, on_grid, components=2
    ),
    "plates beside each other": Family(
        of(block([-0.3, -7, -7], [0, 7, 0.6]), block([0, -7, -0.7], [0.3, 7, 7])), right, on_grid, components=2
    ),
    "overlapping plates": Family(
        of(block([-0.3, -7, -7], [0.05, 7, 0.6]), block([0, -7, -0.7], [0.3, 7, 7])), slight, components=2
    ),
    "filled box": Family(
        of(block([-9, -9, -9], [0.1, 9, 9]), block([-0.1, -9, -9], [9, 9, 9])), slight, components=0
    ),  # in most cells the surfaces are apart
    "nested": Family(of(OUTER, INNER), volume=first_volume, area=first_area),
    "hollow": Family(hollow, components=2, volume=whole, area=all_area),
    "overlapping cubes": Family(
        of(block([-1.2, -1, -0.9], [0.3, 0.6, 0.8]), block([-0.2, -0.4, -0.5], [1.1, 1.2, 1.0])),
        volume=lambda x, scene: 1.5 * 1.6 * 1.7 + 1.3 * 1.6 * 1.5 - 0.5 * 1.0 * 1.3,
    ),
    "cube in grid planes": Family(grid_block, right, on_grid, volume=whole, area=all_area),
    "plate in grid planes": Family(grid_plate, right, lambda rng: rng.integers(-1, 2, 3) * 0.5, components=2),
    "edge on edge": Family(at_an_edge, right, on_grid, volume=whole, area=all_area),
    "edge on edge, rotated": Family(at_an_edge),
    "three bodies, coplanar": Family(
        THREE, right, on_grid,
        volume=lambda x, scene: 1 + 1 * 1.1 * 0.6 + 1.25 * 0.75 * 1 - 0.5 * 0.5 * 0.25 - 0.75 * 0.75 * 0.25,
    ),
}  # fmt: skip


def table_of(edges, x, facets, body, *, closing=0.0, only_exact: bool = False, points=POINTS) -> CutTable:
    return cut_cells(edges, points, ClosedSurfaces(facets, np.asarray(body)), x, closing=closing, only_exact=only_exact)


def fluid_volume(edges, table: CutTable) -> float:
    index = np.unravel_index(np.arange(table.state.size), table.shape, order="F")
    cells = np.prod([np.diff(edge)[i] for edge, i in zip(edges, index, strict=True)], axis=0)
    return float(cells[table.state == CellState.FLUID].sum() + (table.share * cells[table.cell]).sum())


def sizes(edges, table: CutTable) -> np.ndarray:
    """Edge lengths of the cell of each region, shape (R, dim)."""
    index = np.unravel_index(table.cell, table.shape, order="F")
    return np.stack([np.diff(edge)[i] for edge, i in zip(edges, index, strict=True)], axis=1)


def normals(table: CutTable, facets) -> np.ndarray:
    x = table.vertices[facets]
    if facets.shape[1] == 2:
        way = x[:, 1] - x[:, 0]
        n = np.stack([way[:, 1], -way[:, 0]], axis=1)
    else:
        n = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
    length = np.linalg.norm(n, axis=1, keepdims=True)
    return n / np.where(length == 0, 1, length)


def identity_errors(edges, table: CutTable, facets, points=POINTS) -> tuple[float, float]:
    """(int n over the boundary of each region: it must vanish; its share by int x_d n_d of each direction: all equal).

    They see a piece of surface or a part of a face that is missing, counted twice or given to another region.
    """
    dim, regions = len(edges), len(table.cell)
    size = sizes(edges, table)
    face = size.prod(axis=1, keepdims=True) / size  # areas of the cell's faces
    n = normals(table, facets)[table.piece_facet]
    into, first = np.zeros((regions, dim)), np.zeros((regions, dim))
    np.add.at(into, table.piece_region, table.piece_area[:, None] * n)
    tensor = np.stack(np.meshgrid(*[points] * dim, indexing="ij"), axis=-1).reshape(-1, dim)[:, ::-1]
    at = np.einsum("pqv,qd->pd", table.piece_moments, tensor)
    np.add.at(first, table.piece_region, -at * n)
    out, shares = np.zeros((regions, dim)), first / face
    for side, sign in ((0, 1), (1, -1)):
        some = table.face_regions[:, side] >= 0
        where = table.face_regions[some, side], table.face_axis[some]
        np.add.at(out, where, sign * table.face_area[some])
        if side == 0:
            np.add.at(shares, where, table.face_area[some])
    closure = np.abs(into / face - out).max(initial=0.0)
    return float(closure), float(np.abs(shares - table.share[:, None]).max(initial=0.0))


def assert_pose(family: Family, seed: int, *, only_exact: bool = False) -> CutTable:
    """Everything that is known of a pose: sums of cells and faces, components, volume and area."""
    edges, x, facets, body = family.pose(seed)
    table = table_of(edges, x, facets, body, only_exact=only_exact)
    assert max(identity_errors(edges, table, facets)) < 1e-14, seed
    assert table.share.min(initial=1.0) > -1e-14, seed
    assert components_of(table).count == family.components, seed
    scene = x, facets, body
    if family.volume:
        assert abs(N**3 - fluid_volume(edges, table) - family.volume(table.vertices, scene)) < 1e-13, seed
    if family.area:
        assert abs(table.piece_area.sum() - family.area(table.vertices, scene)) < 1e-13, seed
    assert (np.isin(np.flatnonzero(table.state == CellState.CUT), table.cell)).all()
    return table


def assert_same(one: CutTable, other: CutTable) -> None:
    """Tables of the two kernels: the same regions, pieces and parts of faces."""
    assert (one.state == other.state).all()
    for name in ("cell", "piece_region", "piece_facet", "piece_body"):
        assert (getattr(one, name) == getattr(other, name)).all()
    assert np.abs(one.moments - other.moments).max(initial=0.0) < 1e-14
    assert np.abs(one.piece_moments - other.piece_moments).max(initial=0.0) < 1e-14
    rows = [np.column_stack([table.face_axis, table.face_cells, table.face_regions]) for table in (one, other)]
    orders = [np.lexsort(row.T) for row in rows]
    assert (rows[0][orders[0]] == rows[1][orders[1]]).all()
    assert np.abs(one.face_moments[orders[0]] - other.face_moments[orders[1]]).max(initial=0.0) < 1e-14


FACING = -0.5  # cosine of the normals of walls that face each other, as for the closing length


def between_walls(facets, table):
    """Smallest gap [m] of each region from the middle of a wall's piece to one that it faces and is over, shape (R,).

    Infinite without walls that face each other. The middle of a piece that is not convex may be beside it, and the gap
    too small.
    """
    regions, walls, region = len(table.cell), table.vertices[facets][table.piece_facet], table.piece_region
    mean = table.piece_moments.sum(axis=1)
    middle = np.einsum("pv,pvd->pd", mean, walls) / mean.sum(axis=1, keepdims=True)
    ways = walls[:, 1:] - walls[:, :1]
    normal = np.cross(ways[:, 0], ways[:, 1]) if len(table.shape) == 3 else ways[:, 0, ::-1] * [1.0, -1.0]
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    count = np.bincount(region, minlength=regions)
    first = np.cumsum(count) - count
    repeats = count[region]  # each piece meets all pieces of its region
    one = np.repeat(np.arange(len(region)), repeats)
    other = np.arange(len(one)) - np.repeat(np.cumsum(repeats) - repeats, repeats) + np.repeat(first[region], repeats)
    facing = np.einsum("pd,pd->p", normal[one], normal[other]) < FACING
    one, other = one[facing], other[facing]
    way = middle[one] - walls[other, 0]
    gap = np.einsum("pd,pd->p", way, normal[other])
    gram = np.einsum("pid,pjd->pij", ways[other], ways[other])
    at = np.linalg.solve(gram, np.einsum("pid,pd->pi", ways[other], way)[..., None])[..., 0]
    inside = (gap >= 0.0) & (at >= 0.0).all(axis=1) & (at.sum(axis=1) <= 1.0)
    between = np.full(regions, np.inf)
    np.minimum.at(between, region[one[inside]], gap[inside])
    return between
