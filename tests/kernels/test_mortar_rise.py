"""The derivative of weighted gaps with respect to a translation of the masters, and its own derivatives."""

import numpy as np
import pytest
from mortar_surfaces import DIM, all_pairs, dense, patch, rotation
from test_mortar_derivatives import check, deformed

from solvers.kernels import mortar, nodal_normals

TYPES = [
    ("tri3", "tri3"),
    ("quad4", "quad4"),
    ("tri3", "quad9"),
    ("quad9", "tri6"),
    ("line2", "line2"),
    ("line3", "line2"),
    ("line2", "line3"),
]


@pytest.mark.parametrize(("slave", "master"), TYPES)
@pytest.mark.parametrize("method", ["segments", "elements"])
def test_it_has_exact_derivatives(slave, master, method):
    xs, fs, xm, fm, rng = deformed(50, slave, master)
    e = rng.normal(size=DIM[slave])
    z = rng.normal(size=xs.shape)
    check(xs, fs, slave, xm, fm, master, z, method=method, along=e / np.linalg.norm(e), rise=True)


@pytest.mark.parametrize(("slave", "master"), TYPES)
def test_it_is_the_derivative_of_the_gap(slave, master):
    """Flat slaves below larger masters with bumps, where only the gaps change as the masters move."""
    rng, dim = np.random.default_rng(51), DIM[slave]
    xs, fs = patch(slave, 2)
    xm, fm = patch(master, 3, size=2.0, turned=True)
    xm[:, -1] += rng.uniform(-0.03, 0.03, len(xm))
    turn = rotation(rng, dim)
    xs, xm = xs @ turn.T, (xm + np.array([0.1, 0.07, 0.2])[-dim:]) @ turn.T
    normals, pairs = nodal_normals(xs, fs, slave)[0], all_pairs(fs, fm)
    r = mortar(xs, fs, slave, xm, fm, master, normals, pairs)
    by_masters = dense(r.dgap, len(xs), xs.size + xm.size)[:, xs.size :].reshape(len(xs), -1, dim).sum(axis=1)
    found = [mortar(xs, fs, slave, xm, fm, master, normals, pairs, along=e, rise=True).gap for e in np.eye(dim)]
    np.testing.assert_allclose(np.column_stack(found), by_masters, atol=1e-4 * np.abs(by_masters).max())


def test_a_rise_needs_a_direction():
    xs, fs = patch("line2", 1)
    xm, fm = patch("line2", 1, turned=True)
    with pytest.raises(ValueError, match="rise needs along"):
        mortar(xs, fs, "line2", xm, fm, "line2", nodal_normals(xs, fs, "line2")[0], all_pairs(fs, fm), rise=True)
