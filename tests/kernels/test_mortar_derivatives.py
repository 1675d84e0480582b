"""Derivatives of the mortar kernel against central differences, on warped, partly overlapping surfaces."""

import numpy as np
import pytest
from mortar_surfaces import DIM, SECOND_ORDER, TYPES_2D, TYPES_3D, all_pairs, dense, patch, rotation

from solvers.kernels import mortar, nodal_normals

STEP = 1e-6


def difference(function, x):
    """The derivative of a function of an array by central differences, shape (values, x.size)."""
    columns = []
    for i in range(x.size):
        change = np.zeros(x.size)
        change[i] = STEP
        change = change.reshape(x.shape)
        columns.append((function(x + change) - function(x - change)).ravel() / (2 * STEP))
    return np.column_stack(columns)


def assert_derivative(derivative, expected, least=1e-4):
    scale = np.abs(expected).max()
    assert scale > least
    np.testing.assert_allclose(derivative, expected, atol=1e-6 * max(scale, 1e-4))


def deformed(seed, slave, master, *, shift=0.35, size=1.1, warp=0.08):
    """Two warped surfaces that overlap in part, turned at random."""
    rng = np.random.default_rng(seed)
    xs, fs = patch(slave, 2)
    xm, fm = patch(master, 2, turned=True, size=size)
    for x, facet_type in ((xs, slave), (xm, master)):
        amount = warp / 2 if facet_type in SECOND_ORDER else warp
        x += rng.uniform(-amount, amount, x.shape)
    xm = xm + np.array([shift, *[0.6 * shift] * (DIM[slave] - 2), 0.1])
    rotate = rotation(rng, DIM[slave])
    return xs @ rotate.T, fs, xm @ rotate.T, fm, rng


def check(xs, fs, slave, xm, fm, master, z, **settings):
    """All derivatives at fixed normals and with respect to the normals."""
    normals, _ = nodal_normals(xs, fs, slave)
    pairs = all_pairs(fs, fm)
    ns, dim = xs.shape
    n_dofs = xs.size + xm.size

    def quantities(x, n):
        r = mortar(x[:ns], fs, slave, x[ns:], fm, master, n, pairs, z, derivatives=False, **settings)
        return np.concatenate([r.gap, r.D, r.force])

    x = np.vstack([xs, xm])
    r = mortar(xs, fs, slave, xm, fm, master, normals, pairs, z, **settings)
    rows = np.cumsum([ns, ns])
    by_x = np.split(difference(lambda y: quantities(y, normals), x), rows)
    by_n = np.split(difference(lambda n: quantities(x, n), normals), rows)
    for expected, derivative in zip(by_x, (r.dgap, r.dD, r.dforce), strict=True):
        assert_derivative(dense(derivative, len(expected), n_dofs), expected)
    assert_derivative(dense(r.dgap_dn, ns, xs.size), by_n[0])
    for expected, derivative in zip(by_n[1:], (r.dD_dn, r.dforce_dn), strict=True):
        if dim == 2:
            assert_derivative(dense(derivative, len(expected), xs.size), expected, least=-1.0)
        else:
            assert not expected.any()
            assert not len(derivative[0])
    return r


@pytest.mark.parametrize(
    ("slave", "master"),
    [
        ("tri3", "tri3"),
        ("tri3", "quad4"),
        ("quad4", "tri3"),
        ("quad4", "quad4"),
        ("tri6", "tri6"),
        ("quad9", "quad9"),
        ("quad4", "quad9"),
        ("tri6", "quad4"),
        ("line2", "line2"),
        ("line2", "line3"),
        ("line3", "line2"),
        ("line3", "line3"),
    ],
)
@pytest.mark.parametrize("method", ["segments", "elements"])
def test_derivatives_of_gap_diagonal_and_force(slave, master, method):
    xs, fs, xm, fm, rng = deformed(1, slave, master)
    check(xs, fs, slave, xm, fm, master, rng.normal(size=xs.shape), method=method)


@pytest.mark.parametrize("seed", range(8))
def test_derivatives_on_more_warped_quads(seed):
    slave, master = [("quad4", "quad4"), ("quad4", "tri3"), ("tri3", "quad4"), ("line2", "line2")][seed % 4]
    xs, fs, xm, fm, rng = deformed(10 + seed, slave, master, shift=rng_shift(seed), size=0.6 + 0.1 * seed, warp=0.12)
    check(xs, fs, slave, xm, fm, master, rng.normal(size=xs.shape))


def rng_shift(seed):
    return np.random.default_rng(seed).uniform(-0.5, 0.5)


@pytest.mark.parametrize(("slave", "cover"), [("tri3", 5e-3), ("quad4", 5e-3), ("quad9", 0.15), ("line2", 5e-3)])
def test_derivatives_where_the_dual_basis_is_blended(slave, cover):
    dim = DIM[slave]
    master = "line2" if dim == 2 else "quad4"
    rng = np.random.default_rng(20)
    xs, fs = patch(slave, 1)
    xm, fm = patch(master, 1, turned=True)
    xs, xm = xs + rng.uniform(-1e-3, 1e-3, xs.shape), xm + rng.uniform(-1e-3, 1e-3, xm.shape)
    side = cover * (0.5 if slave == "tri3" else 1.0)
    if dim == 3:  # a square in the corner the first facet alone has
        side = np.sqrt(side)
        shift = [1 - side, side - 1, 0.1]
    else:
        shift = [1 - side, 0.1]
    normals, _ = nodal_normals(xs, fs[:1], slave)
    xm = xm + shift
    z = rng.normal(size=xs.shape)
    ns, n_dofs, pairs = len(xs), xs.size + xm.size, all_pairs(fs[:1], fm)

    def force(x):
        r = mortar(x[:ns], fs, slave, x[ns:], fm, master, normals, pairs, z, derivatives=False)
        return np.concatenate([r.gap, r.force]) / r.area.sum()

    r = mortar(xs, fs, slave, xm, fm, master, normals, pairs, z)
    area = r.area.sum()
    assert 0.5 * cover < area / (0.5 if slave == "tri3" else 1.0) < 1.5 * cover
    d_area = dense(r.dD, ns, n_dofs).sum(axis=0)
    derivative = np.vstack([dense(r.dgap, ns, n_dofs), dense(r.dforce, n_dofs, n_dofs)])
    value = np.concatenate([r.gap, r.force])
    expected = difference(force, np.vstack([xs, xm]))
    assert_derivative(derivative / area - np.outer(value, d_area) / area**2, expected)


@pytest.mark.parametrize("facet_type", [*TYPES_2D, *TYPES_3D])
def test_derivatives_of_normals(facet_type):
    rng = np.random.default_rng(30)
    x, facets = patch(facet_type, 2)
    x = x + rng.uniform(-0.08, 0.08, x.shape)
    mask = np.ones_like(x)
    mask[x[:, 0] < -0.4, 0] = 0.0
    for m in (None, mask):
        _, slope = nodal_normals(x, facets, facet_type, m)
        expected = difference(lambda y, m=m: nodal_normals(y, facets, facet_type, m, derivatives=False)[0], x)
        assert_derivative(dense(slope, x.size, x.size), expected)


def test_all_derivatives_together_follow_the_positions():
    # the chain rule as a caller applies it: normals move with the slave
    xs, fs, xm, fm, rng = deformed(40, "quad4", "quad4")
    z = rng.normal(size=xs.shape)
    ns = len(xs)
    pairs = all_pairs(fs, fm)

    def gap(x):
        n, _ = nodal_normals(x[:ns], fs, "quad4", derivatives=False)
        return mortar(x[:ns], fs, "quad4", x[ns:], fm, "quad4", n, pairs, z, derivatives=False).gap

    x = np.vstack([xs, xm])
    n, slope = nodal_normals(xs, fs, "quad4")
    r = mortar(xs, fs, "quad4", xm, fm, "quad4", n, pairs, z)
    total = dense(r.dgap, ns, x.size)
    total[:, : xs.size] += dense(r.dgap_dn, ns, xs.size) @ dense(slope, xs.size, xs.size)
    assert_derivative(total, difference(gap, x))
    rigid = np.tile(np.eye(3), (len(x), 1))  # nothing changes when everything moves along
    np.testing.assert_allclose(total @ rigid, 0.0, atol=1e-12)
    np.testing.assert_allclose(dense(r.dforce, x.size, x.size) @ rigid, 0.0, atol=1e-12)
