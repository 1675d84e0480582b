"""The condensed Newton step is that of the saddle-point system, and that one is the derivative of the residual."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from contact_setup import SETTINGS, brick, make_body, make_contact, turned
from mpi4py import MPI

from coupling.contact_surfaces import contact_surface
from solvers.contact.contact import Contact
from solvers.contact.law.frictionless import Frictionless
from solvers.contact.law.law import SLIP
from solvers.contact.pair import Pair
from solvers.contact.surface import Surface
from solvers.generalised_alpha import GeneralisedAlpha
from solvers.structure.body import Support
from solvers.structure.dynamics import Dynamics
from solvers.structure.field import Structure
from solvers.structure.time_scheme import Statics

OVERLAP = 0.03
MIXED = [
    ("quad", "triangle"),
    ("quad9", "triangle6"),
    ("hexahedron", "hexahedron"),
    ("tetra", "hexahedron"),
    ("tetra10", "tetra10"),
    ("hexahedron27", "tetra10"),
]


def zero(x, t):
    return np.zeros(x.shape[1])


def box(cell_type, cells, size, origin):
    return brick(cell_type, cells, size, origin, irregular=0.15)


def dynamics():
    return Dynamics(GeneralisedAlpha.from_rho_inf(0.6))


def two_bodies(lower, upper, *, slave="upper", time=None, held=False):
    """A smaller block pressed into a larger one, which may be held also where they touch."""
    dim = 2 if lower[:4] in ("quad", "tria") else 3
    one, half = [1.0] * (dim - 1), [0.7] * (dim - 1)
    supports = [Support("left", (zero, *[None] * (dim - 1)))] if held else []
    bodies = [
        make_body("lower", box(lower, 2, [*one, 0.5], [0.0] * dim), supports=supports),
        make_body("upper", box(upper, 2, [*half, 0.5], [0.0] * (dim - 1) + [0.5 - OVERLAP]), supports=supports),
    ]
    near = [("upper", "bottom"), ("lower", "top")]
    return make_contact(bodies, [tuple(near if slave == "upper" else near[::-1])], time=time or dynamics())


def stack(middle_is):
    """Three blocks; the middle one is slave below and master above, or the other way round."""
    names = ("lower", "middle", "upper")
    bodies = [
        make_body(name, box("hexahedron", n, [1, 1, 0.5], [0, 0, i * (0.5 - OVERLAP)]))
        for i, (name, n) in enumerate(zip(names, (2, 3, 2), strict=True))
    ]
    below, above = (("middle", "bottom"), ("lower", "top")), (("upper", "bottom"), ("middle", "top"))
    if middle_is == "master below":
        below, above = below[::-1], above[::-1]
    return make_contact(bodies, [below, above], time=dynamics())


def bridge(left="hexahedron", upper="hexahedron", *, held=False):
    """One block on two others: its lower side is master of the left one and slave on the right one."""
    supports = [Support("front", (None, zero, None))] if held else []
    bodies = [
        make_body("left", box(left, 2, [0.6, 1, 0.5], [-0.1, 0, 0]), supports=supports),
        make_body("right", box("hexahedron", 2, [0.6, 1, 0.5], [0.5, 0, 0]), supports=supports),
        make_body("upper", box(upper, 3, [1, 1, 0.5], [0, 0, 0.5 - OVERLAP]), supports=supports),
    ]
    pairs = [(("left", "top"), ("upper", "bottom")), (("upper", "bottom"), ("right", "top"))]
    return make_contact(bodies, pairs, time=dynamics())


def on_obstacle(cell_type):
    """A block on a rigid moving plane, static: only contact and the support on top hold it."""
    mesh = box(cell_type, 2, [1, 1, 0.5], [0, 0, -OVERLAP])
    body = make_body("block", mesh, supports=[Support("top", (zero, zero, zero))])
    points = np.array([[-0.3, -0.3, 0], [1.3, -0.3, 0], [1.3, 1.3, 0], [-0.3, 1.3, 0]])
    plane = Surface(
        "plane", points, np.array([[0, 1, 2, 3]]), "quad", None, motion=lambda t: points + 0.1 * t * np.eye(3)[2]
    )
    return make_contact([body], [(("block", "bottom"), plane)], time=Statics())


def corner(cell_type, law=Frictionless()):
    """A block whose corner (3D: an edge) points at another one: both sides of it see that one."""
    dim = 2 if cell_type == "quad" else 3
    turn = np.eye(dim)
    turn[np.ix_([0, -1], [0, -1])] = [[np.cos(0.7), -np.sin(0.7)], [np.sin(0.7), np.cos(0.7)]]
    tip = [0.5] * (dim - 1) + [0.5 - OVERLAP]
    upper = turned(brick(cell_type, 2, [0.7] * dim, [0.0] * dim, 0.0), turn)
    bodies = [
        make_body("lower", box(cell_type, 2, [1.0] * (dim - 1) + [0.5], [0.0] * dim)),
        make_body("upper", replace(upper, points=upper.points + tip)),
    ]
    slave = contact_surface(bodies, "upper", "left", "bottom")
    contact = Contact([Pair(slave, contact_surface(bodies, "lower", "top"), law=law)], comm=MPI.COMM_SELF)
    return Structure(bodies, dynamics(), SETTINGS, contact=contact), contact


STATES = {
    **{f"corner-{cell_type}": (lambda cell_type=cell_type: corner(cell_type)) for cell_type in ("quad", "hexahedron")},
    **{f"{a}-{b}-{s}": (lambda a=a, b=b, s=s: two_bodies(a, b, slave=s)) for a, b in MIXED for s in ("upper", "lower")},
    "held": lambda: two_bodies("hexahedron", "hexahedron", held=True),
    "held-tri6": lambda: two_bodies("hexahedron27", "tetra10", held=True),
    "middle slave below": lambda: stack("slave below"),
    "middle master below": lambda: stack("master below"),
    "slave and master at once": bridge,
    "slave and master at once, held": lambda: bridge(held=True),
    "slave and master at once, tri6": lambda: bridge(left="tetra10"),
    "slave and master at once, tri6 master": lambda: bridge(upper="tetra10"),
    "obstacle": lambda: on_obstacle("hexahedron"),
    "obstacle-tri6": lambda: on_obstacle("tetra10"),
}


def prepare(make, seed=5):
    """A random state in the middle of a step, with oblique multipliers. (structure, contact, random numbers)"""
    structure, contact = make()
    rng = np.random.default_rng(seed)
    structure.initialise(0.0, 0.1)
    structure.begin_step(0.0, 0.1)
    structure.now.u[:] = rng.uniform(-0.01, 0.01, structure.layout.size)
    structure.now.u = structure.held.free_part(structure.now.u) + structure.target
    contact.active_set.status[:] = SLIP
    contact.begin_step()  # nodes near rims, which are in contact, have their directions
    structure.residual()
    pressure = rng.uniform(25.0, 35.0, len(contact.z))
    contact.z[:] = pressure[:, None] * contact.terms.normals
    for _ in range(2):  # the first one takes the multipliers of inactive nodes away
        structure.residual()
    assert contact.active_set.active.sum() >= (1 if contact.merged.any() else 3)
    return structure, contact, rng


def dense(matrix):
    indptr, indices, data = matrix.getValuesCSR()
    return sp.csr_matrix((data, indices, indptr), shape=matrix.size).toarray()


def added(structure):
    """The part of the tangent that the matrix lacks: that of the inertia of rigid motion."""
    factor, size = structure.time.rigid_factor(structure.current.dt), structure.layout.size
    if structure.inertia.find_rigid() is None or structure.inertia.frame is None:
        return np.zeros((size, size))
    product = structure.inertia.find_rigid().product(structure.inertia.frame)
    return factor * np.stack([product(column) for column in np.eye(size)], axis=1)


class Linearisation:
    """Dense derivatives of balance and law with respect to displacements and what multipliers can change (zeta)."""

    def __init__(self, structure, contact):
        parts = contact.in_contact()
        terms = contact.linearised(parts, structure.time.force_weight)
        dofs = contact.nodes.dofs.ravel()
        place = np.zeros((len(dofs), structure.layout.size))
        place[np.flatnonzero(dofs >= 0), dofs[dofs >= 0]] = 1.0
        on_balance = -terms.weight * place.T
        force = on_balance @ terms.force.toarray()
        self.active = np.concatenate([part.which for part in parts])
        self.basis = terms.basis.toarray()
        self.balance_u = dense(structure.tangent()) + on_balance @ terms.dforce.toarray() @ place
        self.balance_u += force @ terms.turning.toarray() @ place
        self.balance_z = force @ self.basis
        self.law_u, self.law_z = terms.by_displacement.toarray() @ place, terms.by_multiplier.toarray()
        self.law, self.place, self.turning = terms.residual, place, terms.turning.toarray()


def compare(found, wanted, tolerance):
    error = np.abs(found - wanted).max() / np.abs(wanted).max()
    assert error < tolerance, f"{error:.2e}"


@pytest.mark.parametrize("name", STATES)
def test_condensed_step_is_that_of_the_saddle_point_system(name):
    structure, contact, _ = prepare(STATES[name])
    assert contact.merged.any() == name.startswith("corner")
    if name.startswith("slave and master"):
        touched = contact.multipliers.node[contact.active_set.active]
        assert contact.terms.M.toarray()[contact.active_set.active][:, touched].any()
    L = Linearisation(structure, contact)
    size = structure.layout.size
    force = np.zeros(size)
    dofs = contact.nodes.dofs.ravel()
    np.add.at(force, dofs[dofs >= 0], contact.force().ravel()[dofs >= 0])
    without = structure.residual_force + structure.time.force_weight * force

    matrix = np.block([[L.balance_u + added(structure), L.balance_z], [L.law_u, L.law_z]])
    right = np.concatenate([-without, -L.law])
    held = structure.held.dofs
    matrix[held] = 0.0
    matrix[held, held] = 1.0
    right[held] = (structure.target - structure.now.u)[held]
    # rows and columns of equal size, so that the dense solution is accurate
    columns = 1.0 / np.abs(matrix).max(axis=0)
    rows = 1.0 / np.abs(matrix * columns).max(axis=1)
    solution = columns * np.linalg.solve(rows[:, None] * matrix * columns, rows * right)

    structure.advance()
    compare(structure.increment, solution[:size], 1e-10)
    z = L.basis @ solution[size:] + L.turning @ L.place @ solution[:size]
    compare(contact.z[L.active].ravel(), z, 1e-10)


@pytest.mark.parametrize("name", STATES)
def test_linearisation_is_the_derivative_of_the_residual(name):
    """Multipliers are pressures times normals here, and turn with them."""
    structure, contact, rng = prepare(STATES[name])
    L = Linearisation(structure, contact)
    u = structure.now.u.copy()
    pressure = np.einsum("nd,nd->n", contact.z, contact.terms.normals)[L.active]
    du, dp = rng.uniform(-1, 1, u.shape), 1e3 * rng.uniform(-1, 1, len(L.active))

    def residual(step):
        structure.now.u[:] = u + step * du
        structure.residual()
        contact.z[L.active] = (pressure + step * dp)[:, None] * contact.terms.normals[L.active]
        structure.residual()
        (part,) = contact.in_contact()
        assert np.array_equal(part.which, L.active)
        law = L.basis.T @ part.law.residual(part.point, part.status, structure.time.force_weight).ravel()
        # the inertia of rigid motion has a test of its own (test_rigid_inertia.py)
        moves_mass = structure.inertia.moves_mass()
        rigid = (1.0 - structure.time.scheme.alpha_m) * structure.now.rigid if moves_mass else 0.0
        return structure.residual_force - rigid, law

    step = 1e-6
    ahead, behind = residual(step), residual(-step)
    difference = [(a - b) / (2 * step) for a, b in zip(ahead, behind, strict=True)]
    compare(L.balance_u @ du + L.balance_z @ dp, difference[0], 1e-6)
    compare(L.law_u @ du + L.law_z @ dp, difference[1], 1e-6)
    # the contact part alone: it must not hide behind the stiffness of the bodies
    contact_part = L.balance_z @ dp
    assert np.abs(contact_part).max() > 1e-4 * np.abs(difference[0]).max()
