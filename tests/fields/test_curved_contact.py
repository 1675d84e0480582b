"""Contact over a curved interface: two rings, one in the other, of which the inner one is widened.

Together they are one thick ring, for there is no friction and all is radial: r(R) solves dP_R/dR = (P_T - P_R) / R with
the nominal stresses P = (mu (s^2 - 1) + lambda ln J) / s of a neo-Hookean body at the stretches s = dr/dR and r / R.
"""

from functools import cache

import numpy as np
import pytest
import ufl
from contact_setup import MATERIAL, make_body, make_contact, pressures, solve_step
from mpi4py import MPI
from scipy.integrate import solve_bvp
from structure_setup import constant

from fsci import shapes
from solvers import fem
from solvers.structure.body import Support

INNER, MIDDLE, OUTER, WIDENED = 1.0, 1.5, 2.0, 0.15
ZERO = constant(0)


def nominal(radial, hoop):
    """(along the radius, around) at two stretches; plane strain."""
    log = MATERIAL.lmbda * np.log(radial * hoop)
    return [(MATERIAL.mu * (s**2 - 1.0) + log) / s for s in (radial, hoop)]


@cache
def exact():
    """(coefficients of the displacement in powers of 2 (R - MIDDLE), pressure at MIDDLE)."""
    mu, lmbda = MATERIAL.mu, MATERIAL.lmbda

    def slopes(R, y):
        r, s = y
        radial, around = nominal(s, r / R)
        by_s = (mu * (s**2 + 1.0) + lmbda * (1.0 - np.log(s * r / R))) / s**2
        by_r = lmbda / (s * r)
        return np.array([s, ((around - radial) / R - by_r * (s - r / R)) / by_s])

    def ends(a, b):
        return np.array([a[0] - INNER - WIDENED, nominal(b[1], b[0] / OUTER)[0]])

    R = np.linspace(INNER, OUTER, 200)
    found = solve_bvp(slopes, ends, R, np.array([R + WIDENED, np.ones_like(R)]), tol=1e-11, max_nodes=100000)
    assert found.success
    fine = MIDDLE + 0.5 * np.cos(np.linspace(0.0, np.pi, 400))
    displacement = np.polynomial.polynomial.polyfit(2.0 * (fine - MIDDLE), found.sol(fine)[0] - fine, 13)
    r, s = found.sol(MIDDLE)
    return displacement, -nominal(s, r / MIDDLE)[0] / (r / MIDDLE)


def widen(order, cell, n):
    """(unknowns, relative errors of displacements in H1 and L2 and of nodal pressures, Newton steps)."""
    coefficients, pressure = exact()
    supports = [Support("start", (None, ZERO)), Support("end", (ZERO, None))]
    moved = tuple(lambda x, t, i=i: WIDENED * x[i] / np.hypot(x[0], x[1]) for i in range(2))
    bodies = []
    for name, low, high, around in (("inside", INNER, MIDDLE, 2 * n), ("outside", MIDDLE, OUTER, 3 * n)):
        mesh = shapes.ring(low, high, [around, n], 90, 0, order=order, cell=cell)
        own = supports + ([Support("inner", moved)] if name == "inside" else [])
        bodies.append(make_body(name, mesh, supports=own))
    structure, contact = make_contact(bodies, [(("inside", "outer"), ("outside", "inner"))])
    info = solve_step(structure)
    squares = np.zeros(4)
    for body, owned in zip(bodies, structure.split(structure.now.u), strict=True):
        body.set_displacement(owned)
        x = ufl.SpatialCoordinate(body.domain.mesh)
        r = ufl.sqrt(ufl.dot(x, x))
        s = 2.0 * (r - MIDDLE)
        u = sum(float(c) * s**k for k, c in enumerate(coefficients)) * x / r
        dx = fem.volume_measure(body.domain, 6)
        parts = [ufl.inner(ufl.grad(v), ufl.grad(v)) for v in (body.u - u, u)] + [(body.u - u) ** 2, u**2]
        squares += [fem.assemble_scalar(fem.compile_form(part * dx), MPI.COMM_SELF) for part in parts]
    found = pressures(contact)
    assert len(found) == 2 * n * order + 1
    errors = np.sqrt(squares[[0, 2]] / squares[[1, 3]])
    return structure.layout.size, *errors, np.sqrt(np.mean((found / pressure - 1.0) ** 2)), info.iterations


KINDS = [
    (1, "quad"),
    pytest.param(1, "tri", marks=pytest.mark.slow),
    pytest.param(2, "quad", marks=pytest.mark.slow),
    pytest.param(2, "tri", marks=pytest.mark.slow),
]


@pytest.mark.parametrize(("order", "cell"), KINDS)
def test_orders(order, cell):
    """First order: 1 in H1, 2 in L2; second order one more of each; pressures at nodes: at least 1."""
    found = np.array([widen(order, cell, n) for n in (4, 8, 16)])
    orders = -np.diff(np.log2(found[:, 1:4]), axis=0)[-1]
    assert orders[0] > order - 0.15, (found, orders)
    assert orders[1] > order + 1 - 0.25, (found, orders)
    assert orders[2] > 1.0, (found, orders)
    assert found[:, 4].max() <= 8


def test_second_order_needs_fewer_unknowns():
    """For the same error."""
    first, second = widen(1, "quad", 16), widen(2, "quad", 4)
    assert second[0] < 0.3 * first[0]
    assert all(a < b for a, b in zip(second[1:4], first[1:4], strict=True))
