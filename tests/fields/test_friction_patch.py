"""Patch tests of friction: two bodies whose meshes do not match stick or slide in homogeneous states."""

from dataclasses import replace

import numpy as np
import pytest
from contact_setup import brick, displacement_error, line_integrals, make_body, make_contact, solve_step
from structure_setup import constant, distort

from solvers.contact.law.coulomb import Coulomb
from solvers.contact.law.law import SLIP, STICK
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings
from solvers.structure.body import Support
from solvers.structure.elastic_constants import lame
from solvers.structure.loads import Traction
from solvers.structure.materials import StVenantKirchhoff

SETTINGS = SolverSettings(Tolerance(residual=1e-11, residual_absolute=1e-10, max_iterations=15), linear="direct")
MATERIAL = StVenantKirchhoff(*lame(1000.0, 0.3), 1.0)
STRAIN = {2: [[0.005, 0.02], [0.01, -0.03]], 3: [[0.005, 0.002, 0.02], [-0.003, 0.004, 0.01], [0.01, 0.005, -0.03]]}
SIDES = [("left", 0, -1), ("right", 0, 1), ("front", 1, -1), ("back", 1, 1)]
MESHES = [("quad", "quad"), ("quad", "triangle6"), ("hexahedron", "tetra"), ("hexahedron27", "hexahedron")]
FIRST, WIDTH, SHIFT = 0.16, 0.71, 0.02  #: where the narrow body begins, how wide it is, how far it slides


def dimension(cell_type):
    return 2 if cell_type in ("quad", "quad9", "triangle6") else 3


def nominal_stress(F):
    E = 0.5 * (F.T @ F - np.eye(len(F)))
    return F @ (MATERIAL.lmbda * np.trace(E) * np.eye(len(F)) + 2.0 * MATERIAL.mu * E)


def traction_on_upper(F):
    """True traction on the lower face of the upper body and the outward unit normal there."""
    area = np.linalg.det(F) * np.linalg.inv(F).T[:, -1]
    return -nominal_stress(F)[:, -1] / np.linalg.norm(area), -area / np.linalg.norm(area)


def split(traction, normal):
    """(pressure, part along the surface)."""
    across = traction @ normal
    return -across, traction - across * normal


@pytest.mark.parametrize("slave", ["lower", "upper"])
@pytest.mark.parametrize(("lower", "upper"), MESHES)
def test_patch_that_sticks(lower, upper, slave):
    """Two blocks with shear across the contact: the homogeneous state of one block, to 1e-8."""
    dim = dimension(lower)
    F = np.eye(dim) + np.array(STRAIN[dim])
    P = nominal_stress(F)
    exact = [lambda x, t, row=row: np.einsum("d,dn->n", row, x[:dim]) for row in F - np.eye(dim)]
    tractions = [
        Traction(name, tuple(constant(sign * c) for c in P[:, axis])) for name, axis, sign in SIDES[: 2 * (dim - 1)]
    ]
    bodies = []
    for name, cell_type, cells, far, start in (("lower", lower, 3, "bottom", 0.0), ("upper", upper, 2, "top", 0.5)):
        irregular = 0.0 if upper == "tetra" else 0.15  # integrals over irregular quads are not exact in 3D
        mesh = brick(cell_type, cells, [*[1.0] * (dim - 1), 0.5], [0.0] * (dim - 1) + [start], irregular)
        bodies.append(make_body(name, mesh, MATERIAL, supports=[Support(far, tuple(exact))], tractions=tractions))
    near = [("upper", "bottom"), ("lower", "top")]
    pair = tuple(near if slave == "upper" else near[::-1])
    structure, contact = make_contact(bodies, [pair], law=Coulomb(2.0), settings=SETTINGS)
    solve_step(structure)
    on_slave = contact.multipliers.areas > 0.0
    assert (contact.active_set.status[on_slave] == STICK).all()
    assert displacement_error(structure, exact) < 1e-8
    traction = traction_on_upper(F)[0] * (1.0 if slave == "upper" else -1.0)
    assert np.abs(contact.z[on_slave] + traction).max() < 1e-8 * np.abs(traction).max()


@pytest.mark.parametrize("slave", ["lower", "upper"])
@pytest.mark.parametrize(("lower", "upper"), [*MESHES, ("quad9", "quad")])
def test_patch_that_slides(lower, upper, slave):
    """A narrow block on a wide one: pressed and sheared until it nearly slides, then it slides by SHIFT, to 1e-8.

    Both have the same deformation gradient; mu is the ratio of its tractions at the end. The upper one slides against
    the traction on it. What it does not cover bears the same load.
    """
    dim = dimension(lower)
    H = np.array(STRAIN[dim])
    less = H.copy()
    less[:-1, -1] *= 0.5  # less shear across the contact in the first step
    gradients = [np.eye(dim) + less, np.eye(dim) + H]
    pressure, along = split(*traction_on_upper(gradients[1]))
    mu = np.linalg.norm(along) / pressure
    before = split(*traction_on_upper(gradients[0]))
    assert np.linalg.norm(before[1]) < 0.9 * mu * before[0]
    slip = -SHIFT * along / np.linalg.norm(along)

    def at(t):
        """(displacement gradient, motion of the upper body) at the times 0, 1, 2."""
        return (gradients[int(t) - 1] - np.eye(dim), slip * (t > 1.5)) if t > 0.5 else (np.zeros((dim, dim)), 0 * slip)

    def displacement(i, moves):
        return lambda x, t: at(t)[0][i] @ x[:dim] + moves * at(t)[1][i]

    def load(axis, sign):
        def component(i):
            return lambda x, t: np.full(x.shape[1], sign * nominal_stress(np.eye(dim) + at(t)[0])[i, axis])

        return tuple(component(i) for i in range(dim))

    bodies, exact = [], []
    tractions = [Traction(name, load(axis, sign)) for name, axis, sign in SIDES[: 2 * (dim - 1)]]
    for moves, cell_type, cells, first, width in ((0, lower, 4, 0.0, 1.0), (1, upper, 3, FIRST, WIDTH)):
        unit = distort(brick(cell_type, cells, [1.0] * dim, [0.0] * dim, 0.0), 0.1 / cells)
        size, origin = [width] * (dim - 1) + [0.5], [first] * (dim - 1) + [0.5 * moves]
        mesh = replace(unit, points=unit.points * size + origin)
        exact.append([displacement(i, moves) for i in range(dim)])
        support = Support("top" if moves else "bottom", tuple(exact[-1]))
        name = "upper" if moves else "lower"
        bodies.append(make_body(name, mesh, MATERIAL, supports=[support], tractions=tractions))
    near = [("upper", "bottom"), ("lower", "top")]
    pair = tuple(near if slave == "upper" else near[::-1])
    structure, contact = make_contact(bodies, [pair], law=Coulomb(mu), settings=SETTINGS)
    structure.initialise(0.0, 1.0)
    for t, wanted in ((1.0, STICK), (2.0, SLIP)):
        structure.begin_step(t - 1.0, 1.0)
        F, motion = np.eye(dim) + at(t)[0], at(t)[1]
        bodies[0].external_force(t)  # evaluates the loads of this time, once
        bodies[0].dead_load += uncovered(bodies[0], nominal_stress(F)[:, -1], FIRST + np.linalg.solve(F, motion)[:-1])
        info = structure.solve()
        structure.end_step()
        assert info.iterations <= 8, info.residuals
        assert (contact.active_set.status[contact.active_set.active] == wanted).all()
        check(structure, contact, exact, F, t, 1.0 if slave == "upper" else -1.0)
    area = WIDTH ** (dim - 1) * np.linalg.norm(np.linalg.det(F) * np.linalg.inv(F).T[:, -1])
    assert structure.energy.friction == pytest.approx(np.linalg.norm(along) * area * SHIFT, rel=1e-8)


def uncovered(body, stress, first):
    """Nodal forces of a nominal stress on the part of the top that the narrow body, which begins there, leaves free."""
    dim = body.dim
    top = np.flatnonzero(np.abs(body.points[dim - 1, : body.owned] - 0.5) < 1e-12)
    order = 2 if body.domain.cell_type in ("quad9", "hexahedron27") else 1
    whole, covered = np.ones(len(top)), np.ones(len(top))
    for axis in range(dim - 1):
        s = body.points[axis, top]
        lines = np.unique(s.round(12))
        index = np.searchsorted(lines, s - 1e-9)
        begin, end = (line_integrals(lines, order, x) for x in (first[axis], first[axis] + WIDTH))
        whole *= line_integrals(lines, order, 1.0)[index]
        covered *= (end - begin)[index]
    force = np.zeros((body.owned, dim))
    force[top] = (whole - covered)[:, None] * stress
    return force.ravel()


def check(structure, contact, exact, F, t, side):
    dim = len(F)
    errors = []
    for body, wanted, u in zip(structure.bodies, exact, structure.split(structure.now.u), strict=True):
        errors.append(np.abs(u.reshape(-1, dim) - np.stack([c(body.points, t) for c in wanted], axis=1)).max())
    assert max(errors) < 1e-8 * SHIFT, errors
    traction = side * traction_on_upper(F)[0]
    missed = np.abs(contact.z[contact.active_set.active] + traction).max()
    assert missed < 1e-8 * np.abs(traction).max(), missed / np.abs(traction).max()
