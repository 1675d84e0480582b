"""The tree of k-DOPs finds what brute force finds, misses nothing near, and costs n log n."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from fsci.bench.search import measure_search, wavy_sheet
from solvers.api import StepFailed
from solvers.kernels import KdopTree2, KdopTree3
from solvers.mesh import search as search_module
from solvers.mesh.search import REBUILD_ABOVE, Search

TYPES = {"line2": (2, 2), "line3": (2, 3), "tri3": (3, 3), "quad4": (3, 4), "tri6": (3, 6), "quad9": (3, 9)}


def bernstein(kind: str, s: np.ndarray) -> np.ndarray:
    """Bernstein functions at s (n, 2) in the unit square or triangle, VTK order; shape (n, nodes)."""
    x, y = s.T
    quadratic = [lambda r: (1 - r) ** 2, lambda r: r**2, lambda r: 2 * r * (1 - r)]
    linear = [lambda r: 1 - r, lambda r: r]
    third = 1 - x - y
    ring = [(0, 0), (1, 0), (1, 1), (0, 1)]
    if kind == "line2":
        functions = [f(x) for f in linear]
    elif kind == "line3":
        functions = [f(x) for f in quadratic]
    elif kind == "tri3":
        functions = [third, x, y]
    elif kind == "tri6":
        functions = [third**2, x**2, y**2, 2 * third * x, 2 * x * y, 2 * y * third]
    elif kind == "quad4":
        functions = [linear[i](x) * linear[j](y) for i, j in ring]
    else:
        functions = [quadratic[i](x) * quadratic[j](y) for i, j in [*ring, (2, 0), (1, 2), (2, 1), (0, 2), (2, 2)]]
    return np.stack(functions, axis=-1)


NODES = {
    "line": np.array([[0, 0], [1, 0], [0.5, 0]]),
    "tri": np.array([[0, 0], [1, 0], [0, 1], [0.5, 0], [0.5, 0.5], [0, 0.5]]),
    "quad": np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0.5, 0], [1, 0.5], [0.5, 1], [0, 0.5], [0.5, 0.5]]),
}


def control_points(kind: str, nodes: np.ndarray) -> np.ndarray:
    """Bezier control points (k, nodes, dim) of facets given by their nodes, by interpolation."""
    at_nodes = bernstein(kind, NODES[kind[:-1]][: int(kind[-1])])
    return np.linalg.solve(at_nodes, nodes)


def points_on(kind: str, nodes: np.ndarray, rng: np.random.Generator, count: int) -> np.ndarray:
    """Random points of every facet, shape (k, count, dim)."""
    s = rng.random((count, 2))
    if kind.startswith("tri"):
        s[s.sum(axis=1) > 1] = 1 - s[s.sum(axis=1) > 1]
    return bernstein(kind, s) @ control_points(kind, nodes)


def brute_force(kind: str, slave: list[np.ndarray], master: list[np.ndarray], radius) -> np.ndarray:
    """Pairs of overlapping k-DOPs, all against all; a surface: one or two arrays (k, nodes, dim)."""
    dim = TYPES[kind][0]
    diagonals = [
        np.eye(dim)[i] + sign * np.eye(dim)[j] for i, j in itertools.combinations(range(dim), 2) for sign in (1, -1)
    ]
    directions = np.array([*np.eye(dim), *diagonals])

    def slabs(configurations, r):
        values = np.concatenate([control_points(kind, nodes) for nodes in configurations], axis=1) @ directions.T
        grow = np.multiply.outer(r, np.linalg.norm(directions, axis=1))
        return values.min(axis=1) - grow, values.max(axis=1) + grow

    (low_s, high_s), (low_m, high_m) = slabs(slave, radius), slabs(master, 0.0)
    meet = (low_s[:, None] <= high_m[None]) & (low_m[None] <= high_s[:, None])
    return np.argwhere(meet.all(axis=2))


def scattered(kind: str, rng: np.random.Generator, facets: int) -> tuple[np.ndarray, np.ndarray]:
    """Randomly shaped facets, 2 % to 20 % of the unit cube they lie in, nodes shuffled and some unused."""
    dim, nodes = TYPES[kind]
    size = 10 ** rng.uniform(-2.0, -0.7, (facets, 1, 1))
    x = rng.random((facets, 1, dim)) + size * rng.uniform(-1, 1, (facets, nodes, dim))
    number = rng.permutation(facets * nodes + 7).astype(np.int64)
    points = np.full((facets * nodes + 7, dim), 1e3)  # nodes of no facet, far away, must not matter
    points[number[: facets * nodes]] = x.reshape(-1, dim)
    return points, number[: facets * nodes].reshape(facets, nodes)


@pytest.mark.parametrize("motion", [False, True], ids=["one", "two"])
@pytest.mark.parametrize("radius", ["none", "global", "per_facet"])
@pytest.mark.parametrize("kind", TYPES)
def test_equals_brute_force(kind, radius, motion):
    rng = np.random.default_rng([list(TYPES).index(kind), len(radius), motion])
    (xs, slave), (xm, master) = scattered(kind, rng, 400), scattered(kind, rng, 300)
    inflation = {"none": 0.0, "global": 0.02, "per_facet": rng.uniform(0, 0.05, len(slave))}[radius]
    previous = [x + 0.05 * rng.standard_normal(x.shape) if motion else None for x in (xs, xm)]

    found = Search(slave, master).pairs(xs, xm, inflation, *previous)
    ways = [
        [x[f] for x in (now, before) if x is not None]
        for f, now, before in ((slave, xs, previous[0]), (master, xm, previous[1]))
    ]
    expected = brute_force(kind, *ways, np.broadcast_to(inflation, len(slave)))

    assert found.dtype == np.int32
    assert 50 < len(expected) < 0.5 * len(slave) * len(master)
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("kind", TYPES)
def test_every_close_pair_is_found(kind):
    """Distances are measured between points on the facets, curved as they are, not between nodes."""
    rng = np.random.default_rng(1)
    (xs, slave), (xm, master) = scattered(kind, rng, 60), scattered(kind, rng, 50)
    radius = rng.uniform(0, 0.2, len(slave))
    a, b = points_on(kind, xs[slave], rng, 60), points_on(kind, xm[master], rng, 60)
    distance = np.array([[np.linalg.norm(p[:, None] - q[None], axis=2).min() for q in b] for p in a])
    close = np.argwhere(distance <= radius[:, None])

    found = Search(slave, master).pairs(xs, xm, radius)

    assert len(close) > 40
    assert {tuple(pair) for pair in close} <= {tuple(pair) for pair in found}


@pytest.mark.parametrize("kind", ["line3", "tri6", "quad9"])
def test_a_curved_facet_is_found_where_it_leaves_the_hull_of_its_nodes(kind):
    rng = np.random.default_rng(2)
    dim, nodes = TYPES[kind]
    x = rng.random((200, nodes, dim))
    points = points_on(kind, x, rng, 20)
    outside = (points < x.min(axis=1)[:, None]) | (points > x.max(axis=1)[:, None])
    assert outside.any(axis=2).sum() > 100

    specks = np.repeat(points.reshape(-1, 1, dim), nodes, axis=1)  # facets shrunk to these points
    slave, master = (np.arange(y.shape[0] * nodes).reshape(-1, nodes) for y in (x, specks))
    found = Search(slave, master).pairs(x.reshape(-1, dim), specks.reshape(-1, dim), 1e-12)

    own = np.stack([np.repeat(np.arange(200), 20), np.arange(4000)], axis=1)
    assert {tuple(pair) for pair in own} <= {tuple(pair) for pair in found}


def test_flat_quadratic_facets_cost_no_margin():
    """A straight line3 at y = 0 and one just above a gap do not meet, one just below do."""
    flat = np.array([[0.0, 0.0], [1.0, 0.0], [0.5, 0.0]])
    facet = np.array([[0, 1, 2]])
    assert len(Search(facet, facet).pairs(flat, flat + np.array([0, 0.1]), 0.1 + 1e-9)) == 1
    assert len(Search(facet, facet).pairs(flat, flat + np.array([0, 0.1]), 0.1 - 1e-9)) == 0


def test_a_step_cannot_jump_through_the_other_surface():
    (xs, slave), (xm, master) = wavy_sheet(6, 1.0), wavy_sheet(5)
    search = Search(slave, master)
    below = xs - np.array([0, 0, 2.0])
    assert len(search.pairs(xs, xm, 0.01)) == 0
    assert len(search.pairs(below, xm, 0.01)) == 0
    through = search.pairs(below, xm, 0.01, xs)
    assert set(through[:, 0]) == set(range(36))
    assert set(through[:, 1]) == set(range(25))
    np.testing.assert_array_equal(search.pairs(below, xm, 0.01, xs_previous=xs, xm_previous=xm), through)
    passing = search.pairs(xs, xm + np.array([0, 0, 2.0]), 0.01, xm_previous=xm)  # the master moves instead
    assert set(passing[:, 0]) == set(range(36))


def test_surfaces_that_never_meet_touch_no_tree(monkeypatch):
    (xs, slave), (xm, master) = wavy_sheet(10, 5.0), wavy_sheet(10)
    search = Search(slave, master)

    def forbidden(*_):
        raise AssertionError("tree touched")

    with monkeypatch.context() as patch:
        patch.setattr(search_module, "update", forbidden)
        for inflation in (0.0, 1.0, np.full(100, 4.7)):
            found = search.pairs(xs, xm, inflation, xs + 0.01, xm)
            assert found.shape == (0, 2)
            assert found.dtype == np.int32
        with pytest.raises(AssertionError, match="tree touched"):
            search.pairs(xs, xm, 5.0)
    assert len(search.pairs(xs, xm, 5.0)) > 0


def loose_sheet(cells: int) -> tuple[np.ndarray, np.ndarray]:
    """A sheet whose facets share no nodes; positions (k, 4, 3), facets (k, 4)."""
    x, facets = wavy_sheet(cells)
    return x[facets], np.arange(facets.size).reshape(-1, 4)


def swap_places(x: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Every facet keeps its shape but goes to the place of another."""
    centres = x.mean(axis=1, keepdims=True)
    return x - centres + rng.permutation(centres)


def test_earlier_calls_do_not_change_results():
    """Refitted, degraded and rebuilt trees give what a fresh search gives; degraded ones are rebuilt."""
    rng = np.random.default_rng(3)
    (start, slave), (xm, master) = loose_sheet(20), wavy_sheet(23, 0.01)
    swapped = swap_places(start, rng)
    search = Search(slave, master)
    for step in range(8):
        xs = (start if step < 4 else swapped) + 0.02 * step * np.sin(9 * start[..., ::-1])
        now, before = xs.reshape(-1, 3), start.reshape(-1, 3) if step % 2 else None
        found = search.pairs(now, xm, 0.005 * step, before)
        assert len(found) > 0
        np.testing.assert_array_equal(found, Search(slave, master).pairs(now, xm, 0.005 * step, before))
        assert search.trees is not None
        assert max(tree.quality() for tree in search.trees) <= REBUILD_ABOVE


def test_quality_tells_when_to_rebuild():
    rng = np.random.default_rng(4)
    x, facets = wavy_sheet(40)
    none = np.zeros(len(facets))
    tree, other = KdopTree3(facets), KdopTree3(facets)
    assert tree.quality() == np.inf
    tree.build(x, none)
    other.build(x, none)
    assert tree.quality() == 1.0

    rotation = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    for harmless in (3 * x, x + 5.0, x @ rotation, x + 0.05 * np.sin(3 * x[:, ::-1])):
        tree.refit(harmless, none)
        assert 0.7 < tree.quality() < 1.4

    apart, nodes = loose_sheet(40)
    swapped = swap_places(apart, rng).reshape(-1, 3)
    tree, new = KdopTree3(nodes), KdopTree3(nodes)
    tree.build(apart.reshape(-1, 3), none)
    tree.refit(swapped, none)
    new.build(swapped, none)
    assert tree.quality() > REBUILD_ABOVE
    np.testing.assert_array_equal(tree.candidates(other)[0], new.candidates(other)[0])
    other.refit(x + np.array([0, 0, 0.05]), none)
    assert tree.candidates(other)[1] > 10 * new.candidates(other)[1]


def test_cost_grows_like_n_log_n():
    """Counted, not timed: k-DOP tests per facet, which all against all would multiply by 64."""
    small, large = measure_search(500), measure_search(32_000)
    assert large["pairs"] / large["facets"] == pytest.approx(small["pairs"] / small["facets"], rel=0.3)
    growth = (large["tests"] / large["facets"]) / (small["tests"] / small["facets"])
    assert growth < np.log(32_000) / np.log(500)


@pytest.mark.parametrize("ratio", [0.5, 0.99])
def test_graded_meshes_keep_the_tree_shallow(ratio):
    """Facets shrinking geometrically towards a corner: cutting at the middle alone would give a chain."""
    count = 1000
    x = np.stack([ratio ** np.arange(count + 1.0), np.zeros(count + 1)], axis=1)
    facets = np.stack([np.arange(count), np.arange(1, count + 1)], axis=1)
    tree, speck = KdopTree2(facets), KdopTree2(np.array([[0, 1]]))
    tree.build(x, np.zeros(count))
    for facet in range(0, count, 50):
        speck.build(x[[facet, facet]] * [1 - 1e-9, 1], np.zeros(1))
        pairs, tests = speck.candidates(tree)
        assert [0, facet] in pairs.tolist() or ratio**facet < 1e-12
        assert tests < 20 * np.log2(count) + 2 * len(pairs)


def test_coinciding_facets_and_single_facets():
    x = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 1.0]])
    same, one = np.tile([[0, 1]], (50, 1)), np.array([[1, 2]])
    assert len(Search(same, same).pairs(x, x, 0.0)) == 2500
    np.testing.assert_array_equal(Search(one, one).pairs(x, x, 0.0), [[0, 0]])
    np.testing.assert_array_equal(Search(one, same).pairs(x, x, 0.0)[:, 1], np.arange(50))  # touching counts


@pytest.mark.parametrize(
    ("message", "arguments"),
    [
        ("a facet in 3D has 3, 4, 6 or 9 nodes, not 5", {"slave": np.zeros((2, 5), int)}),
        ("at least one facet", {"master": np.empty((0, 4), int)}),
        ("node index -1", {"slave": np.array([[0, 1, 2, -1]])}),
        (r"positions must have shape \(n >= 100, 3\), not \(9, 3\)", {"slave": np.array([[0, 1, 2, 99]])}),
        (r"positions must have shape .* not \(9, 2\)", {"xm": np.zeros((9, 2))}),
        ("inflation must be finite and not negative", {"inflation": -0.1}),
        ("broadcast", {"inflation": np.ones(3)}),
    ],
)
def test_wrong_arguments_are_named(message, arguments):
    x, facets = wavy_sheet(2)
    search = Search(arguments.get("slave", facets), arguments.get("master", facets))
    with pytest.raises(ValueError, match=message):
        search.pairs(x, arguments.get("xm", x), arguments.get("inflation", 0.0))


def test_lost_positions_fail_the_step():
    x, facets = wavy_sheet(2)
    lost = x.copy()
    lost[3, 1] = np.nan
    for arguments in ((lost, x, 0.1), (x, x, 0.1, None, lost)):
        with pytest.raises(StepFailed, match="not finite"):
            Search(facets, facets).pairs(*arguments)


def test_an_unbuilt_tree_finds_nothing():
    x, facets = wavy_sheet(2)
    built, unbuilt = KdopTree3(facets), KdopTree3(facets)
    built.build(x, np.zeros(4))
    with pytest.raises(ValueError, match="must be built"):
        built.candidates(unbuilt)
