"""Mortar integrals against what mathematics says about them."""

import itertools

import numpy as np
import pytest
from mortar_surfaces import DIM, NODES, TYPES_2D, TYPES_3D, all_pairs, dense, jittered, patch, rotation
from scipy.sparse import csr_matrix
from scipy.spatial import ConvexHull

from solvers.kernels import basis_transformation, mortar, nodal_normals

MIXES = [*itertools.product(TYPES_3D, TYPES_3D), *itertools.product(TYPES_2D, TYPES_2D)]
METHODS = ("segments", "elements")


def integrate(xs, fs, slave, xm, fm, master, z=None, **settings):
    """The mortar integrals over all pairs, and M as an array."""
    normals, _ = nodal_normals(xs, fs, slave, derivatives=False)
    result = mortar(xs, fs, slave, xm, fm, master, normals, all_pairs(fs, fm), z, **settings)
    return result, dense(result.M, len(xs), len(xm))


def flattened(x):
    x = x.copy()
    x[:, -1] = 0.0
    return x


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("slave", "master"), MIXES)
def test_momentum_partition_of_unity_and_sums(slave, master, method):
    rng = np.random.default_rng(1)
    xs, fs = jittered(rng, slave, 2, 0.1)
    xm, fm = jittered(rng, master, 3, 0.1, turned=True, size=0.9)
    xm = xm + np.array([0.3] * (DIM[slave] - 1) + [0.1])
    z = rng.normal(size=xs.shape)
    result, M = integrate(xs, fs, slave, xm, fm, master, z, method=method)
    assert result.D.sum() > 0.2
    np.testing.assert_allclose(M.sum(axis=1), result.D, atol=1e-13)
    np.testing.assert_allclose(result.area.sum(), result.D.sum(), rtol=1e-13)
    force = result.force.reshape(-1, DIM[slave])
    np.testing.assert_allclose(force[: len(xs)], -result.D[:, None] * z, atol=1e-13)
    np.testing.assert_allclose(force[len(xs) :], M.T @ z, atol=1e-13)
    np.testing.assert_allclose(force.sum(axis=0), 0.0, atol=1e-13)


def overlap_area(a, b):
    """Area of the overlap of two convex polygons (counter-clockwise): hull of the line crossings inside both."""

    def lines(p):
        along = np.roll(p, -1, axis=0) - p
        normal = np.column_stack([-along[:, 1], along[:, 0]]) / np.linalg.norm(along, axis=1)[:, None]
        return normal, np.sum(normal * p, axis=1)

    (na, oa), (nb, ob) = lines(a), lines(b)
    normals, offsets = np.vstack([na, nb]), np.concatenate([oa, ob])
    found = []
    for i, j in itertools.combinations(range(len(normals)), 2):
        pair = normals[[i, j]]
        if abs(np.linalg.det(pair)) > 1e-12:
            x = np.linalg.solve(pair, offsets[[i, j]])
            if np.all(normals @ x >= offsets - 1e-12):
                found.append(x)
    return ConvexHull(found).volume if len(found) > 2 else 0.0


@pytest.mark.parametrize(("slave", "master"), [*itertools.product(("tri3", "quad4"), repeat=2)])
def test_overlap_area_of_random_polygons(slave, master):
    rng = np.random.default_rng(2)
    reference = {"tri3": [[0, 0], [1, 0], [0, 1]], "quad4": [[-1, -1], [1, -1], [1, 1], [-1, 1]]}
    for _ in range(60):
        plane = []
        for facet_type in (slave, master):
            angle = rng.uniform(0, 2 * np.pi)
            turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
            stretch = np.diag(rng.uniform(0.3, 3.0, 2))
            plane.append(np.array(reference[facet_type]) @ stretch @ turn.T + rng.uniform(-1, 1, 2))
        rotate, move = rotation(rng, 3), rng.uniform(-5, 5, 3)
        xs = np.column_stack([plane[0], np.zeros(len(plane[0]))]) @ rotate.T + move
        xm = np.column_stack([plane[1], np.full(len(plane[1]), rng.uniform(-1, 1))]) @ rotate.T + move
        fs, fm = np.arange(len(xs))[None], np.arange(len(xm))[None, ::-1].copy()
        result, _ = integrate(xs, fs, slave, xm, fm, master)
        assert result.area[0] == pytest.approx(overlap_area(*plane), abs=1e-12)


def quadratic(x):
    """A polynomial of degree two of the position in the plane."""
    p = x[:, :-1]
    return 1.0 + p @ [0.7, -0.4][: p.shape[1]] + (p**2) @ [0.5, 0.3][: p.shape[1]] + 0.2 * p.prod(axis=1)


def linear(x):
    return 1.0 + x[:, :-1] @ [0.7, -0.4][: x.shape[1] - 1]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("slave", "master"), MIXES)
def test_linear_functions_are_transferred_exactly(slave, master, method):
    # On flat surfaces D^-1 M u = u for every u in both spaces: biorthogonality on the cells integrated, whatever
    # part of the facets they cover. tri6: for the coefficients of the transformed basis.
    rng = np.random.default_rng(3)
    xs, fs = patch(slave, 3)
    xm, fm = patch(master, 4, turned=True, size=1.1)
    if not {slave, master} & {"tri6", "quad9", "line3"}:  # these stay straight: mid-nodes in the middle
        xs, xm = (flattened(x + rng.uniform(-0.05, 0.05, x.shape)) for x in (xs, xm))
    xm = xm + np.array([0.33] * (DIM[slave] - 1) + [0.2])
    plane = "quad4" if DIM[slave] == 3 else "line2"
    result, M = integrate(xs, fs, slave, xm, fm, master, method=method)
    transformation = csr_matrix(basis_transformation(fs, slave, len(xs))[1], shape=(len(xs),) * 2)
    whole, _ = integrate(xs, fs, slave, *patch(plane, 1, size=9.0, turned=True), plane)
    share = result.area / whole.area  # where it is small the dual basis is given up on purpose
    covered = np.ones(len(xs), bool)
    covered[fs[share < 0.3]] = False
    assert 2 <= covered.sum() < len(xs)
    second_order = {slave, master} <= {"tri6", "quad9", "line3"}
    for u in [linear, quadratic] if second_order else [linear]:
        expected = result.D * (transformation @ u(xs))
        np.testing.assert_allclose((M @ u(xm))[covered], expected[covered], atol=1e-13)


@pytest.mark.parametrize(("facet_type", "amount"), [("line2", 0.2), ("tri3", 0.2), ("quad4", 0.2), ("line3", 0.05)])
def test_coincident_surfaces_have_diagonal_coupling(facet_type, amount):
    rng = np.random.default_rng(4)
    xs, fs = jittered(rng, facet_type, 3, amount)
    xs = flattened(xs)
    turned = patch(facet_type, 3, turned=True)[1]
    result, M = integrate(xs, fs, facet_type, xs, turned, facet_type)
    np.testing.assert_allclose(M, np.diag(result.D), atol=1e-13)
    np.testing.assert_allclose(result.gap, 0.0, atol=1e-14)


@pytest.mark.parametrize(
    ("facet_type", "shares"),
    [
        ("line2", [1 / 2] * 2),
        ("line3", [1 / 6, 1 / 6, 4 / 6]),
        ("tri3", [1 / 3] * 3),
        ("tri6", [2 / 15] * 3 + [1 / 5] * 3),
        ("quad4", [1 / 4] * 4),
        ("quad9", [1 / 36] * 4 + [4 / 36] * 4 + [16 / 36]),
    ],
)
def test_diagonal_of_one_covered_facet(facet_type, shares):
    xs, fs = patch(facet_type, 1)
    master = "quad4" if DIM[facet_type] == 3 else "line2"
    xm, fm = patch(master, 2, size=3.0, turned=True)
    result, _ = integrate(xs, fs[:1], facet_type, xm, fm, master)
    area = 0.5 if facet_type.startswith("tri") else 1.0
    np.testing.assert_allclose(result.area, area, rtol=1e-13)
    np.testing.assert_allclose(result.D[fs[0]], area * np.array(shares), rtol=1e-12)


def test_diagonal_of_a_partly_covered_quadratic_facet():
    # the part x < c of a quad9 facet: integrals of the Lagrange functions along x, Simpson's weights along y
    c = 0.3
    xs, fs = patch("quad9", 1, size=2.0)
    xm, fm = patch("quad4", 1, size=4.0, turned=True)
    xm[:, 0] += c - 2.0
    result, _ = integrate(xs, fs, "quad9", xm, fm, "quad4")
    s = np.polynomial.polynomial.Polynomial([0.0, 1.0])
    lines = {-1.0: s * (s - 1) / 2, 0.0: (1 - s) * (1 + s), 1.0: s * (s + 1) / 2}
    simpson = {-1.0: 1 / 3, 0.0: 4 / 3, 1.0: 1 / 3}
    expected = [(lines[x].integ()(c) - lines[x].integ()(-1.0)) * simpson[y] for x, y, _ in xs]
    np.testing.assert_allclose(result.D, expected, atol=1e-13)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("slave", "master"), MIXES)
def test_gap_of_planes(slave, master, method):
    rng = np.random.default_rng(5)
    dim = DIM[slave]
    xs, fs = patch(slave, 2)
    xm, fm = patch(master, 3, turned=True, size=1.5)
    slope = np.array([0.2, -0.1][: dim - 1])
    xm[:, -1] = 0.3 + xm[:, :-1] @ slope
    rotate, move = rotation(rng, dim), rng.normal(size=dim)
    result, _ = integrate(xs @ rotate.T + move, fs, slave, xm @ rotate.T + move, fm, master, method=method)
    inverse = csr_matrix(basis_transformation(fs, slave, len(xs))[1], shape=(len(xs),) * 2)
    np.testing.assert_allclose(result.gap, result.D * (inverse @ (0.3 + xs[:, :-1] @ slope)), atol=1e-13)


def test_gap_is_negative_where_bodies_overlap():
    xs, fs = patch("quad4", 2)
    xm, fm = patch("quad4", 2, turned=True)
    result, _ = integrate(xs, fs, "quad4", xm - [0, 0, 0.01], fm, "quad4")
    np.testing.assert_allclose(result.gap, -0.01 * result.D, atol=1e-15)


@pytest.mark.parametrize("shift", [0.0, 1e-16, 1e-14, 1e-13, 1e-12, 3e-12, 1e-10, 1e-8])
@pytest.mark.parametrize(("slave", "master"), MIXES)
def test_coincident_and_aligned_meshes_lose_nothing(slave, master, shift):
    rng = np.random.default_rng(6)
    dim = DIM[slave]
    z = np.array([0.0] * (dim - 1) + [1.0])
    for n, rotate in [(2, np.eye(dim)), (4, np.eye(dim)), (2, rotation(rng, dim)), (4, rotation(rng, dim))]:
        xs, fs = patch(slave, 2)
        xm, fm = patch(master, n, turned=True)
        xm = xm + shift * np.array([1.0, 0.7, 0.0] if dim == 3 else [1.0, 0.0])
        xs, xm = xs @ rotate.T + 3.0, xm @ rotate.T + 3.0
        result, M = integrate(xs, fs, slave, xm, fm, master, np.tile(rotate @ z, (len(xs), 1)))
        expected = (1 - shift) * (1 - 0.7 * shift) if dim == 3 else 1 - shift
        assert result.area.sum() == pytest.approx(expected, abs=1e-12 if shift == 0.0 else 2e-11)
        np.testing.assert_allclose(M.sum(axis=1), result.D, atol=1e-13)
        np.testing.assert_allclose(result.gap, 0.0, atol=1e-12)
        for derivative in (result.dD, result.dgap, result.dforce):
            assert np.abs(derivative[0]).max() < 10.0


@pytest.mark.parametrize("facet_type", ["line2", "line3", "tri3", "quad4"])
def test_a_covered_facet_stays_covered_however_the_master_moves(facet_type):
    # coincident meshes are a kink of each single overlap, but not of their sum
    xs, fs = patch(facet_type, 3)
    xm, fm = patch(facet_type, 3, turned=True)
    result, _ = integrate(xs, fs, facet_type, xm, fm, facet_type)
    dD = dense(result.dD, len(xs), xs.size + xm.size)
    np.testing.assert_allclose(dD[:, xs.size :], 0.0, atol=1e-12)


@pytest.mark.parametrize(("slave", "master"), MIXES)
def test_slivers_do_no_harm(slave, master):
    rng = np.random.default_rng(7)
    dim = DIM[slave]
    xs, fs = patch(slave, 1)
    xm, fm = patch(master, 1, turned=True)
    last = 1.0
    for overlap in [0.3, 0.1, 0.05, 1e-2, 5e-3, 1e-3, 1e-5, 1e-8, 1e-11, 1e-13, 0.0, -1e-13, -1e-8]:
        for both in [False, True] if dim == 3 else [False]:  # a strip along an edge, a piece in a corner
            shift = np.array([1.0 - overlap, *[(1.0 - overlap) * both] * (dim - 2), 0.1])
            result, M = integrate(xs, fs, slave, xm + shift, fm, master, rng.normal(size=xs.shape))
            scale = max(result.area.sum(), 1e-300)
            np.testing.assert_allclose(result.gap, 0.1 * result.D, atol=1e-13 * scale)
            np.testing.assert_allclose(M.sum(axis=1), result.D, atol=1e-11 * scale)
            assert np.abs(M).max(initial=0.0) <= 40.0 * scale
            for derivative in (result.dD, result.dgap, result.dforce):
                assert np.abs(derivative[0]).max(initial=0.0) < 1e3
        assert scale <= last
        last = scale
    assert not result.D.any()


@pytest.mark.parametrize("method", METHODS)
def test_facets_that_do_not_meet_give_nothing(method):
    xs, fs = patch("quad4", 2)
    xm, fm = patch("tri3", 2, turned=True)
    xm[:, 2] += 0.2
    far, high = xm + np.array([5.0, 0, 0]), xm + np.array([0, 0, 9.0])

    def nothing(result, _):
        return not (result.D.any() or result.gap.any() or result.area.any() or len(result.M[0]) or len(result.dgap[0]))

    assert nothing(*integrate(xs, fs, "quad4", far, fm, "tri3", method=method))
    assert nothing(*integrate(xs, fs, "quad4", xm, patch("tri3", 2)[1], "tri3", method=method))  # same way round
    assert nothing(*integrate(xs, fs, "quad4", high, fm, "tri3", method=method, reach=1.0))
    assert not nothing(*integrate(xs, fs, "quad4", xm, fm, "tri3", method=method, reach=0.3))
    normals, _ = nodal_normals(xs, fs, "quad4")
    assert nothing(mortar(xs, fs, "quad4", xm, fm, "tri3", normals, np.zeros((0, 2), np.int32)), None)


@pytest.mark.parametrize("master", ["quad4", "line3"])
def test_parts_add_up_and_values_need_no_derivatives(master):
    rng = np.random.default_rng(8)
    slave = "line2" if master == "line3" else "quad4"
    xs, fs = jittered(rng, slave, 4, 0.1)
    xm, fm = jittered(rng, master, 3, 0.1, turned=True)
    z = rng.normal(size=xs.shape)
    normals, _ = nodal_normals(xs, fs, slave)
    pairs = all_pairs(fs, fm)
    arguments = (xs, fs, slave, xm, fm, master, normals)
    whole = mortar(*arguments, pairs, z)
    parts = [mortar(*arguments, pairs[pick], z) for pick in (pairs[:, 0] < 2, pairs[:, 0] >= 2)]
    values = mortar(*arguments, pairs, z, derivatives=False)
    assert values.dgap is values.dD is values.dforce is None
    for name in ("D", "gap", "area", "force"):
        np.testing.assert_allclose(sum(getattr(p, name) for p in parts), getattr(whole, name), atol=1e-15)
        np.testing.assert_allclose(getattr(values, name), getattr(whole, name), atol=1e-14)
    n_dofs = xs.size + xm.size
    for name, rows in (("dgap", len(xs)), ("dD", len(xs)), ("dforce", n_dofs)):
        total = sum(dense(getattr(p, name), rows, n_dofs) for p in parts)
        np.testing.assert_allclose(total, dense(getattr(whole, name), rows, n_dofs), atol=1e-13)


def test_tri6_transformation():
    _, facets = patch("tri6", 2)
    n = facets.max() + 1
    forward, backward = (dense(t, n, n) for t in basis_transformation(facets, "tri6", n))
    np.testing.assert_allclose(forward @ backward, np.eye(n), atol=1e-15)
    np.testing.assert_allclose(forward.sum(axis=1), 1.0)
    identity, _ = basis_transformation(patch("quad9", 1)[1], "quad9", 9)
    np.testing.assert_array_equal(dense(identity, 9, 9), np.eye(9))


def test_bad_input_is_refused_with_the_reason():
    xs, fs = patch("quad4", 2)
    xm, fm = patch("quad4", 2, turned=True)
    normals, _ = nodal_normals(xs, fs, "quad4")
    pairs = all_pairs(fs, fm)
    good = {"xs": xs, "fs": fs, "facet_type_s": "quad4", "xm": xm, "fm": fm, "facet_type_m": "quad4"}
    good |= {"normals": normals, "pairs": pairs}
    mortar(**good)
    for change, message in [
        ({"facet_type_s": "quad8"}, "no facet type 'quad8' in 3D"),
        ({"facet_type_m": "line2"}, "no facet type 'line2' in 3D"),
        ({"facet_type_m": "tri3"}, "master facets have 4 nodes, their type has 3"),
        ({"fm": fm + 1}, "master facets name node 9, there are 9"),
        ({"pairs": pairs[::-1].copy()}, "sorted by slave facet"),
        ({"pairs": pairs + 1}, "names a facet that does not exist"),
        ({"normals": normals[1:]}, "normals must have the shape of the positions"),
        ({"z": normals[1:]}, "z must have the shape of the positions"),
        ({"method": "points"}, "method must be"),
    ]:
        with pytest.raises(ValueError, match=message):
            mortar(**(good | change))
    assert NODES["quad4"] == fs.shape[1]


@pytest.mark.parametrize(
    ("slave", "master"), [("quad4", "tri3"), ("tri3", "quad4"), ("quad9", "tri6"), ("line2", "line2")]
)
def test_only_slave_facets_near_the_master_take_part(slave, master):
    """Those with a mean gap to some facet up to `near`; gaps and normals vary from facet to facet."""
    rng = np.random.default_rng(12)
    xs, fs = jittered(rng, slave, 4, 0.15)
    xm, fm = jittered(rng, master, 5, 0.15, turned=True)
    xm[:, -1] += 0.1 + 0.8 * xm[:, 0]
    normals, _ = nodal_normals(xs, fs, slave)
    normals += rng.uniform(-0.3, 0.3, normals.shape)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    gaps = {}
    for pair in all_pairs(fs, fm):
        alone = mortar(xs, fs, slave, xm, fm, master, normals, pair[None], derivatives=False)
        if alone.used[0]:
            gaps[tuple(pair)] = alone.gap.sum() / alone.D.sum()
    least = np.sort(
        [min(gap for pair, gap in gaps.items() if pair[0] == facet) for facet in {pair[0] for pair in gaps}]
    )
    limits = 0.5 * (least[1:] + least[:-1])
    assert len(limits) > 2
    for near in limits:
        expected = {facet for (facet, _), gap in gaps.items() if gap <= near}
        result = mortar(xs, fs, slave, xm, fm, master, normals, all_pairs(fs, fm), near=near)
        found = set(all_pairs(fs, fm)[result.used.astype(bool), 0].tolist())
        assert found == expected


@pytest.mark.parametrize("facet_type", TYPES_3D)
def test_near_is_measured_along_the_normals(facet_type):
    """A plane at a height h over another one with inclined normals n: the gap is h n_z everywhere."""
    (xs, fs), (xm, fm) = patch(facet_type, 2), patch(facet_type, 3, turned=True)
    xs, xm = flattened(xs), flattened(xm) + np.array([0.0, 0.0, 0.5])
    normals = np.tile([0.0, 0.6, 0.8], (len(xs), 1))
    for near, all_of_them in ((0.5 * 0.8 - 1e-6, False), (0.5 * 0.8 + 1e-6, True)):
        result = mortar(xs, fs, facet_type, xm, fm, facet_type, normals, all_pairs(fs, fm), near=near)
        assert (result.area > 0.0).all() == (result.area > 0.0).any() == all_of_them
