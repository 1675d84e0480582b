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
from solvers.structure.elastic_constants import lame
from solvers.structure.materials import StVenantKirchhoff

E, NU, RADIUS, MU = 1000.0, 0.3, 200.0, 0.4
HALF, EQUAL = 12.0, 1.3  # half the size of a block; cells are equal up to here


def graded(count, first, end, growth=1.25):
    """Distances from 0 to `end`: `count` equal cells of size `first`, then growing ones."""
    found = list(first * np.arange(count + 1))
    while found[-1] < end:
        found.append(found[-1] + growth * (found[-1] - found[-2]))
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

    nodes, _ = contact.interface.multipliers_of(contact.pairs[0].slave)
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


def half_block(h, side):
    """The half y > 0 of a block below (side -1) or above (1) the plane z = 0; the upper one is a ball's cap."""
    y, z = graded(round(1.1 / h), h, HALF / 2.0, 1.6), graded(2, h, HALF / 2.0, 1.6)
    x = np.concatenate([-y[:0:-1], y])
    counts = np.array([len(x) - 1, len(y) - 1, len(z) - 1])
    mesh = shapes.box([1.0, 1.0, 1.0], counts.tolist())
    i, j, k = np.rint(mesh.points * counts).astype(int).T
    k = k if side > 0 else counts[2] - k
    points = np.stack([x[i], y[j], side * z[k]], axis=1)
    if side > 0:
        low = (points[:, 0] ** 2 + points[:, 1] ** 2) / (2.0 * RADIUS)
        points[:, 2] += low * (1.0 - points[:, 2] / points[:, 2].max())
    return replace(mesh, points=points)


@pytest.mark.slow
def test_stick_zone_and_shear_in_space():
    """Two balls, half of each, a / h = 12: radius of the stick zone and largest shear within 3 %.

    With nu = 0 nothing slips across the load, and the solution is exact: of the share Q / (mu P) of the force that
    would slide, (c / a)^3 = 1 - Q / (mu P), and the shear is mu p less that of a pressure of radius c.
    """
    h, nu, zero = 1.0 / 12.0, 0.0, constant(0)
    material = StVenantKirchhoff(*lame(E, nu), 1.0)

    def down(x, t):
        return np.full(x.shape[1], -0.00475 * min(t, 1.0))

    def along(x, t):
        return np.full(x.shape[1], 0.0009 * max(t - 1.0, 0.0))

    middle = Support("front", (None, zero, None))
    ends = [Support("bottom", (zero, zero, zero)), Support("top", (along, zero, down))]
    lower, upper = (
        make_body(name, half_block(h, side), material, supports=[middle, end])
        for name, side, end in (("lower", -1, ends[0]), ("upper", 1, ends[1]))
    )
    settings = SolverSettings(Tolerance(residual=1e-8), linear="ilu")
    pair = ("upper", "bottom"), ("lower", "top")
    structure, contact = make_contact([lower, upper], [pair], law=Coulomb(MU), settings=settings)
    structure.initialise(0.0, 1.0)
    assert max(solve_step(structure, float(k), first=False).iterations for k in range(2)) <= 8

    force = 2.0 * np.abs(contact.resultant(0))
    a = (0.75 * force[2] * RADIUS * 2.0 * (1.0 - nu**2) / E) ** (1.0 / 3.0)
    assert a >= 12.0 * h
    assert 0.3 < force[0] / (MU * force[2]) < 0.8
    c = a * (1.0 - force[0] / (MU * force[2])) ** (1.0 / 3.0)

    nodes, _ = contact.interface.multipliers_of(contact.pairs[0].slave)
    z, normals, area = contact.z[nodes], contact.terms.normals[nodes], contact.terms.D[nodes]
    pressure = np.einsum("nd,nd->n", z, normals)
    shear = np.linalg.norm(z - pressure[:, None] * normals, axis=1)
    sticking = 2.0 * area[contact.active_set.status[nodes] == STICK].sum()
    largest = 1.5 * force[2] / (np.pi * a**2)
    assert np.sqrt(sticking / np.pi) == pytest.approx(c, rel=0.03)
    assert pressure.max() == pytest.approx(largest, rel=0.01)
    assert shear.max() == pytest.approx(MU * largest * np.sqrt(1.0 - (c / a) ** 2), rel=0.03)

    x = contact.x[nodes, :2]
    x[:, 0] -= np.average(x[:, 0], weights=area * pressure)
    r = np.linalg.norm(x, axis=1)
    exact = MU * largest / a * (np.sqrt(np.maximum(a**2 - r**2, 0.0)) - np.sqrt(np.maximum(c**2 - r**2, 0.0)))
    inside = r < 0.9 * a
    assert np.sqrt(np.mean((shear - exact)[inside] ** 2)) < 0.03 * exact.max()
