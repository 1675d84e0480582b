"""Partial slip under a cylinder pressed onto a half-space and dragged: Cattaneo (1938), Mindlin (1949)."""

from dataclasses import replace

import numpy as np
import pytest
from contact_setup import make_body, make_contact, solve_step
from structure_setup import constant

from fsci import shapes
from solvers.contact.law.coulomb import Coulomb
from solvers.contact.law.law import STICK
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings
from solvers.structure.body import Support
from solvers.structure.materials import StVenantKirchhoff, lame

E, NU, RADIUS, MU = 1000.0, 0.3, 200.0, 0.4
HALF, EQUAL = 12.0, 1.3  # half the size of a block; cells are equal up to here


def graded(count, first, end):
    """Distances from 0 to `end`: `count` equal cells of size `first`, then growing by a quarter each."""
    found = list(first * np.arange(count + 1))
    while found[-1] < end:
        found.append(found[-1] + 1.25 * (found[-1] - found[-2]))
    return np.array(found)


def block(h, side):
    """A block below (side -1) or above (1) the line y = 0, fine near the origin; the upper one is a cylinder's cap."""
    x = graded(int(EQUAL / h), h, HALF)
    x = np.concatenate([-x[:0:-1], x])
    y = graded(4, h, HALF)
    mesh = shapes.rectangle([1.0, 1.0], [len(x) - 1, len(y) - 1])
    i, j = (np.rint(mesh.points[:, k] * (n - 1)).astype(int) for k, n in ((0, len(x)), (1, len(y))))
    if side < 0:
        j = len(y) - 1 - j
    points = np.stack([x[i], side * y[j]], axis=1)
    if side > 0:
        points[:, 1] += points[:, 0] ** 2 / (2.0 * RADIUS) * (1.0 - points[:, 1] / points[:, 1].max())
    return replace(mesh, points=points)


@pytest.mark.slow
def test_stick_zone_and_shear():
    """a / h = 20: half width of the stick zone and largest shear within 3 % of the exact solution."""
    h = 1.0 / 20.0
    effective = E / (2.0 * (1.0 - NU**2))
    load = np.pi * effective / (4.0 * RADIUS)  # the one that gives a = 1
    material = StVenantKirchhoff(*lame(E, NU), 1.0)

    def down(x, t):
        return np.full(x.shape[1], -0.0108 * min(t, 1.0))

    def along(x, t):
        return np.full(x.shape[1], 0.0046 * max(t - 1.0, 0.0) / 4.0)

    bodies = [
        make_body("lower", block(h, -1), material, supports=[Support("bottom", (constant(0), constant(0)))]),
        make_body("upper", block(h, 1), material, supports=[Support("top", (along, down))]),
    ]
    settings = SolverSettings(Tolerance(residual=1e-9, residual_absolute=1e-10, max_iterations=15), linear="direct")
    structure, contact = make_contact(
        bodies, [(("upper", "bottom"), ("lower", "top"))], law=Coulomb(MU), settings=settings
    )
    structure.initialise(0.0, 1.0)
    newton = [solve_step(structure, float(k), first=False).iterations for k in range(5)]
    assert max(newton) <= 10, newton

    force = np.abs(contact.resultant(0))
    a = 2.0 * np.sqrt(force[1] * RADIUS / (np.pi * effective))
    assert a == pytest.approx(1.0, rel=0.3), f"load {force[1]} of {load}"
    largest = 2.0 * force[1] / (np.pi * a)
    assert 0.3 < force[0] / (MU * force[1]) < 0.8
    c = a * np.sqrt(1.0 - force[0] / (MU * force[1]))

    nodes = contact.interface.multipliers_of(contact.pairs[0].slave)
    order = np.argsort(contact.x[nodes, 0])
    nodes = nodes[order]
    x, status = contact.x[nodes, 0], contact.active_set.status[nodes]
    z, normals = contact.z[nodes], contact.terms.normals[nodes]
    pressure = np.einsum("nd,nd->n", z, normals)
    shear = np.linalg.norm(z - pressure[:, None] * normals, axis=1)
    middle = x[pressure > 0].mean()
    sticking = x[status == STICK]
    assert 0.5 * (np.ptp(sticking) + h) == pytest.approx(c, rel=0.03)
    assert pressure.max() == pytest.approx(largest, rel=0.02)
    assert shear.max() == pytest.approx(MU * largest * np.sqrt(1.0 - (c / a) ** 2), rel=0.03)

    s = np.abs(x - middle)
    exact = MU * largest / a * np.sqrt(np.maximum(a**2 - s**2, 0.0))
    exact -= MU * largest / a * np.sqrt(np.maximum(c**2 - s**2, 0.0))
    inside = s < 0.9 * a
    assert np.sqrt(np.mean((shear - exact)[inside] ** 2)) < 0.03 * exact.max()
