"""Friction: exact derivatives, invariance, homogeneous states known exactly, and the work that it does."""

from dataclasses import replace

import numpy as np
import pytest
from contact_setup import MATERIAL, brick, make_body, make_contact, solve_step
from structure_setup import constant
from test_contact_several import wall
from test_contact_system import Linearisation, compare

from fsci import shapes
from solvers.contact.law import friction, tresca
from solvers.contact.law.coulomb import Coulomb
from solvers.contact.law.friction import trial_traction
from solvers.contact.law.frictionless import Frictionless
from solvers.contact.law.law import OPEN, SLIP, STICK
from solvers.contact.law.tresca import Tresca
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings
from solvers.structure.body import Support
from solvers.structure.elastic_constants import lame
from solvers.structure.materials import StVenantKirchhoff

ZERO = constant(0)
LOOSER = SolverSettings(Tolerance(residual=1e-11, residual_absolute=1e-10, max_iterations=15), linear="direct")
PLANE = ["quad", "quad9", "triangle6"]
SPACE = ["hexahedron", "tetra", "tetra10"]


def dimension(cell_type):
    return 2 if cell_type in PLANE else 3


# --------------------------------------------------------------------------------------------------------- derivatives


def two_blocks(cell_type, law, *, held=False):
    """A smaller block pressed into a larger one; held: its left side cannot move, nodes beside it get its functions."""
    dim = dimension(cell_type)
    lower = brick(cell_type, 2, [*[1.0] * (dim - 1), 0.5], [0.0] * dim, 0.15)
    upper = brick(cell_type, 4 if dim == 2 else 2, [*[0.7] * (dim - 1), 0.5], [0.1] * (dim - 1) + [0.499], 0.15)
    supports = [Support("left", (ZERO,) * dim)] if held else []
    bodies = [make_body("lower", lower), make_body("upper", upper, supports=supports)]
    return make_contact(bodies, [(("upper", "bottom"), ("lower", "top"))], law=law)


def put_at_the_edge(contact, law, distance):
    """Tangential multipliers with |q| = s (1 + distance) or s (1 - distance), in turns."""
    every = np.arange(len(contact.z))
    point = contact.point(every)
    normal = np.einsum("nd,nd->n", contact.z, point.normals)[:, None] * point.normals
    q = trial_traction(point)
    side = 1.0 + distance * np.where(every % 2, 1.0, -1.0)
    wanted = (side * law.radius(point) / np.linalg.norm(q, axis=1))[:, None] * q
    contact.z[:] += np.where(point.covered[:, None], wanted - q, 0.0)
    assert np.abs(np.einsum("nd,nd->n", contact.z - normal, point.normals)).max() < 1e-9


@pytest.mark.parametrize("cell_type", [*PLANE, *SPACE])
@pytest.mark.parametrize("law", [Coulomb(0.3), Tresca(8.0)], ids=["coulomb", "tresca"])
@pytest.mark.parametrize(
    ("edge", "held"), [(None, False), (1e-4, False), (None, True)], ids=["anywhere", "near the edge", "held"]
)
def test_linearisation_is_the_derivative_of_the_residual(cell_type, law, edge, held):
    """At a random state with nodes that stick and nodes that slip; or with all of them close to the cone's edge."""
    structure, contact = two_blocks(cell_type, law, held=held)
    rng = np.random.default_rng(3)
    structure.initialise(0.0, 0.1)
    structure.begin_step(0.0, 0.1)
    structure.now.u[:] = rng.uniform(-0.001, 0.001, structure.layout.size)
    contact.active_set.status[:] = SLIP
    contact.begin_step()  # nodes near rims, which are in contact, have their directions
    structure.residual()
    contact.z[:] = 30.0 * contact.terms.normals + rng.uniform(-12.0, 12.0, contact.z.shape)
    if edge is not None:
        put_at_the_edge(contact, law, edge)
    for _ in range(2):
        structure.residual()
    status = contact.active_set.status[contact.active_set.active]
    assert held or {SLIP, STICK} <= set(status.tolist())
    L = Linearisation(structure, contact)
    u, z = structure.now.u.copy(), contact.z.copy()
    du = rng.uniform(-1, 1, u.shape)
    dz = 1e3 * rng.uniform(-1, 1, (len(L.active), contact.dim))
    tangents = np.eye(contact.dim) - np.einsum("ni,nj->nij", *[contact.terms.normals[L.active]] * 2)
    normals = contact.terms.normals[L.active].copy()
    frozen = contact.point(L.active)  # the factor of the gap is a parameter, and with it the D in it

    def residual(step):
        structure.now.u[:] = u + step * du
        contact.z[:] = z
        contact.z[L.active] += step * dz
        structure.residual()
        assert np.array_equal(contact.active_set.status[L.active], status)
        point = contact.point(L.active)
        point = replace(point, c_n=frozen.c_n * point.D / frozen.D)
        missed = law.residual(point, status, 1.0) / point.D[:, None]  # the rows at fixed factor D
        missed -= np.einsum("nd,nd->n", missed, point.normals)[:, None] * point.normals
        gap = point.stiffness * point.gap
        across = np.einsum("nij,nj->ni", tangents, missed) * frozen.D[:, None]
        return structure.residual_force.copy(), gap[:, None] * normals + across

    step = 4e-7 if edge is None else 5e-9
    near, far = ([a - b for a, b in zip(residual(s), residual(-s), strict=True)] for s in (step, 2 * step))
    balance, rows = [(8.0 * a - b) / (12.0 * step) for a, b in zip(near, far, strict=True)]  # of fourth order
    compare(L.balance_u @ du + L.balance_z @ dz.ravel(), balance, 1e-6)
    found = (L.law_u @ du + L.law_z @ dz.ravel()).reshape(rows.shape)
    for part in set(status.tolist()):
        compare(found[status == part], rows[status == part], 1e-6)
    assert OPEN not in status


# ----------------------------------------------------------------------------------------------------------- invariance


@pytest.mark.parametrize("cell_type", ["quad", "hexahedron", "tetra10"])
def test_a_common_rigid_motion_is_no_slip(cell_type):
    """Both bodies turned by a large angle and moved: the slip is that of before the motion, turned."""
    dim = dimension(cell_type)
    structure, contact = two_blocks(cell_type, Coulomb(0.3))
    structure.initialise(0.0, 1.0)
    structure.begin_step(0.0, 1.0)
    rng = np.random.default_rng(1)
    x = contact.nodes.points + rng.uniform(-0.003, 0.003, contact.nodes.points.shape)
    turn = np.linalg.qr(rng.normal(size=(dim, dim)))[0]
    turn *= np.linalg.det(turn)
    slips = []
    for moved in (x, x @ turn.T + 0.7):
        contact.begin_step()
        contact.evaluate(moved - contact.nodes.points, 1.0)
        contact.x_old = contact.x.copy()
        seen = contact.slip.defined & (contact.terms.D > 0)
        slips.append(contact.slip.values[seen])
        contact.x = contact.nodes.points.copy()
    assert np.abs(slips[0]).max() > 1e-3
    assert slips[1] == pytest.approx(slips[0] @ turn.T, abs=1e-12)


# --------------------------------------------------------------------------------------------------- homogeneous states


def sheared(cell_type, law, shear, *, dim, down=0.02, c_n=1.0):
    """A block of nu = 0 on a rigid plane, pressed down and then moved along by its top: simple shear or sliding."""
    material = StVenantKirchhoff(*lame(1000.0, 0.0), 1.0)

    def along(x, t):
        return np.full(x.shape[1], shear * max(t - 1.0, 0.0))

    support = Support("top", (along, *[ZERO] * (dim - 2), lambda x, t: np.full(x.shape[1], -down * min(t, 1.0))))
    body = make_body("block", brick(cell_type, 2, [1.0] * dim, [0.0] * dim, 0.0), material, supports=[support])
    return make_contact([body], [(("block", "bottom"), wall(dim, dim - 1))], law=law, c_n=c_n, settings=LOOSER)


@pytest.mark.parametrize("cell_type", ["quad", "quad9", "hexahedron", "tetra"])
def test_no_friction_coefficient_is_no_friction(cell_type):
    """mu = 0 equals the frictionless law."""
    dim = dimension(cell_type)
    found = []
    for law in (Frictionless(), Coulomb(0.0)):
        structure, contact = sheared(cell_type, law, 0.05, dim=dim)
        structure.initialise(0.0, 1.0)
        for k in range(2):
            solve_step(structure, float(k), first=False)
        found.append((structure.now.u.copy(), contact.z.copy()))
    assert found[1][0] == pytest.approx(found[0][0], abs=1e-12)
    assert found[1][1] == pytest.approx(found[0][1], abs=1e-9)


@pytest.mark.parametrize("cell_type", ["quad", "quad9", "triangle6", "hexahedron", "hexahedron27"])
@pytest.mark.parametrize(("law", "bound"), [(Coulomb(0.25), None), (Tresca(4.0), 4.0)], ids=["coulomb", "tresca"])
def test_a_dragged_block_slides_at_the_bound(cell_type, law, bound):
    """In the end all nodes slip by the step, forces are the bound, and friction dissipates the work of the support."""
    dim = dimension(cell_type)
    structure, contact = sheared(cell_type, law, 0.02, dim=dim)
    structure.initialise(0.0, 1.0)
    newton = [solve_step(structure, float(k), first=False).iterations for k in range(7)]
    assert max(newton) <= 8, newton
    before = structure.energy.work, structure.energy.friction, structure.now.u.copy()
    newton.append(solve_step(structure, 7.0, first=False).iterations)
    assert (contact.active_set.status[contact.active_set.active] == SLIP).all()
    force = contact.resultant(0)
    if bound is None:
        assert np.hypot(*force[: dim - 1] if dim == 3 else (force[0], 0.0)) == pytest.approx(0.25 * force[-1], rel=1e-8)
    else:
        area = contact.terms.D.sum()
        assert force[0] == pytest.approx(-bound * area, rel=1e-8)
    step = structure.now.u - before[2]
    assert np.abs(step.reshape(-1, dim) - 0.02 * np.eye(dim)[0]).max() < 1e-8  # it moves as a whole
    work, friction = structure.energy.work - before[0], structure.energy.friction - before[1]
    assert friction == pytest.approx(-0.02 * force[0], rel=1e-8)
    assert work == pytest.approx(friction, rel=1e-8)


@pytest.mark.parametrize("edge", [1e-10, 1e-8, 1e-6, 1e-4])
def test_what_slides_goes_on_sliding(edge, monkeypatch):
    """The traction at the beginning of a step is on the rim: all nodes slip from the first iterate on.

    Steady sliding takes one Newton step. If all nodes stuck first, and were sheared by the whole step, it would take
    five. The width of the rim does not matter.
    """
    monkeypatch.setattr(friction, "EDGE_OF_DISC", edge)
    structure, contact = sheared("quad", Coulomb(0.25), 0.02, dim=2)
    structure.initialise(0.0, 1.0)
    newton = [solve_step(structure, float(k), first=False).iterations for k in range(5)]
    assert (contact.active_set.status[contact.active_set.active] == SLIP).all()
    assert newton[2:] == [1, 1, 1], newton


@pytest.mark.parametrize("cell_type", ["quad", "hexahedron"])
def test_a_block_that_sticks_is_sheared(cell_type):
    """Below the bound nothing moves at the plane."""
    dim = dimension(cell_type)
    structure, contact = sheared(cell_type, Coulomb(5.0), 0.001, dim=dim)
    structure.initialise(0.0, 1.0)
    for k in range(3):
        solve_step(structure, float(k), first=False)
    u = structure.now.u.reshape(-1, dim)
    bottom = structure.bodies[0].points[dim - 1, : len(u)] < 1e-12
    assert (contact.active_set.status[contact.active_set.active] == STICK).all()
    assert np.abs(u[bottom, 0] - u[bottom, 0][0]).max() < 1e-10
    assert structure.energy.friction == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("cell_type", ["quad", "hexahedron"])
def test_result_does_not_depend_on_the_complementarity_parameter(cell_type):
    dim = dimension(cell_type)
    found = []
    for c_n in (1e-2, 1.0, 1e2):
        structure, _ = sheared(cell_type, Coulomb(0.25), 0.004, dim=dim, c_n=c_n)
        structure.initialise(0.0, 1.0)
        newton = [solve_step(structure, float(k), first=False).iterations for k in range(3)]
        assert max(newton) <= 8, newton
        found.append(structure.now.u.copy())
    for other in (found[0], found[2]):
        assert np.abs(other - found[1]).max() < 1e-9 * np.abs(found[1]).max()


def test_work_of_a_ring_rolled_over_a_block():
    """Stick, slip and curved surfaces together: what friction dissipates is never negative, Newton stays quick."""
    ring = shapes.ring(0.5, 1.0, [24, 2])
    ring = replace(ring, points=ring.points + np.array([0.0, 1.01]))
    base = shapes.rectangle([2.0, 0.5], [16, 3], [-1.0, -0.5])

    def along(x, t):
        return np.full(x.shape[1], 0.05 * max(t - 1.0, 0.0))

    def down(x, t):
        return np.full(x.shape[1], -0.05 * min(t, 1.0))

    bodies = [
        make_body("ring", ring, MATERIAL, supports=[Support("inner", (along, down))]),
        make_body("base", base, MATERIAL, supports=[Support("bottom", (ZERO, ZERO))]),
    ]
    structure, _ = make_contact(bodies, [(("ring", "outer"), ("base", "top"))], law=Coulomb(0.3))
    structure.initialise(0.0, 1.0)
    work, newton = [0.0], []
    for k in range(5):
        newton.append(solve_step(structure, float(k), first=False).iterations)
        work.append(structure.energy.friction)
    assert np.diff(work).min() >= -1e-12
    assert work[-1] > 0.0
    assert max(newton) <= 8, newton


def test_a_bound_far_below_the_pressure_does_not_depend_on_its_slope(monkeypatch):
    """Tresca's bound is at most a multiple of the pressure, which only matters where a surface opens."""
    forces = []
    for steep in (1e2, 1e3, 1e5):
        monkeypatch.setattr(tresca, "STEEP", Coulomb(steep))
        structure, contact = sheared("quad", Tresca(4.0), 0.02, dim=2)
        structure.initialise(0.0, 1.0)
        for k in range(4):
            solve_step(structure, float(k), first=False)
        forces.append(contact.resultant(0))
    assert forces[1] == pytest.approx(forces[0], rel=1e-9)
    assert forces[2] == pytest.approx(forces[0], rel=1e-9)
