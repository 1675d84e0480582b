"""Contact where it is hard: over edges, grazing, very unequal facets, held nodes, and where there is none."""

from dataclasses import replace

import numpy as np
import pytest
from contact_setup import brick, make_body, make_contact, pressed, solve_step
from structure_setup import block, constant, vector
from test_contact_patch import check, deformation

import solvers.contact.mortar
import solvers.contact.patch
import solvers.mesh.search
from fsci import shapes
from solvers.contact.surface import Surface
from solvers.generalised_alpha import GeneralisedAlpha
from solvers.structure.body import Support
from solvers.structure.dynamics import Dynamics

ZERO = constant(0)


def steps(structure, count, dt=1.0, t=0.0):
    """Newton steps in each of so many steps of time."""
    structure.initialise(t, dt)
    found = []
    for k in range(count):
        found.append(solve_step(structure, t + k * dt, dt, first=False).iterations)
    return found


# ----------------------------------------------------------------------------------------------------- off an edge


@pytest.mark.parametrize(
    ("cell_type", "slave"),
    [
        *((cell_type, slave) for cell_type in ("quad", "quad9") for slave in ("upper", "lower")),
        ("hexahedron", "upper"),
        pytest.param("hexahedron", "lower", marks=pytest.mark.slow),
    ],
)
def test_sliding_off_an_edge(cell_type, slave):
    """A block is pressed onto another one and pushed over its edge until it is off: never many Newton steps.

    Facets of the slave are covered by every share from all to nothing on the way.
    """
    dim = 2 if cell_type.startswith("quad") else 3
    size = [1.0, 0.6] if dim == 2 else [1.0, 0.5, 0.6]
    lower, upper = brick(cell_type, 3, size, [0.0] * dim, 0.0), brick(cell_type, 4, size, [0.0] * dim, 0.0)
    upper = replace(upper, points=upper.points * ([0.8] + [1.0] * (dim - 1)) + [0.15, *[0.0] * (dim - 2), 0.6])
    count = 22

    def push(x, t):
        return np.full(x.shape[1], 0.9 * max(t - 1, 0) / (count - 1))

    down = constant(-0.02)
    across = [ZERO] * (dim - 2)
    held = [Support("bottom", (ZERO,) * dim)], [Support("top", (push, *across, down))]
    bodies = [
        make_body(name, m, supports=s) for name, m, s in zip(("lower", "upper"), (lower, upper), held, strict=True)
    ]
    sides = [("upper", "bottom"), ("lower", "top")]
    structure, contact = make_contact(bodies, [tuple(sides if slave == "upper" else sides[::-1])])
    structure.initialise(0.0, 1.0)
    newton, force = [], []
    for k in range(count):
        newton.append(solve_step(structure, float(k), first=False).iterations)
        force.append(abs(contact.resultant(0)[-1]))
    assert max(newton) <= 6, newton
    assert sum(newton) <= 5 * count, newton
    assert force[0] > 1.0
    assert force[-1] == 0.0
    # it yields gradually: no step in which much of the force comes or goes
    assert np.abs(np.diff(force)).max() < 0.2 * force[0], force


# --------------------------------------------------------------------------------------------------- unequal facets


@pytest.mark.parametrize("slave", ["upper", "lower"])
@pytest.mark.parametrize(
    ("lower", "upper"), [((2, 2, 1), (20, 20, 1)), ((20, 2, 1), (2, 3, 1)), ((20, 2, 1), (2, 20, 1))]
)
def test_facets_of_very_unequal_size_or_shape(lower, upper, slave):
    """10 to 1 in size, in aspect, and in aspect across each other: the patch test is still exact."""
    F, pressure, _ = pressed(3, 0.95)
    exact = deformation(F)
    meshes = [shapes.box([1, 1, 0.3], cells, [0, 0, z]) for cells, z in ((lower, 0.0), (upper, 0.3))]
    symmetric = [Support("left", (ZERO, None, None)), Support("front", (None, ZERO, None))]
    bodies = [
        make_body(name, mesh, supports=[*symmetric, Support(far, (None, None, exact[2]))])
        for name, mesh, far in zip(("lower", "upper"), meshes, ("bottom", "top"), strict=True)
    ]
    sides = [("upper", "bottom"), ("lower", "top")]
    structure, contact = make_contact(bodies, [tuple(sides if slave == "upper" else sides[::-1])])
    info = solve_step(structure)
    check(structure, contact, exact, pressure, nodes=len(contact.nodes.of_surface[0]))
    assert info.iterations <= 6, info.residuals


# ------------------------------------------------------------------------------------------------- grazing, and nothing


def flying_block(height, speed):
    """A free block that flies along a rigid plane, which it overlaps by -height."""
    mesh = block("hexahedron", 2)
    body = make_body("block", mesh, initial_velocity=vector(*speed))
    points = 4.0 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) - [0, 0, height]
    plane = Surface("plane", points, np.array([[0, 1, 2, 3]]), "quad", None)
    time = Dynamics(GeneralisedAlpha.from_rho_inf(1.0))
    return make_contact([body], [(("block", "bottom"), plane)], time=time)


@pytest.mark.parametrize("length", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize(("gap", "near"), [(0.29, True), (0.31, False)])
def test_facets_take_part_up_to_a_share_of_an_edge(length, gap, near):
    """0.3 edges, in any unit: gaps of farther facets are not computed."""
    mesh = block("quad", 2)
    edge = 0.5 * length
    body = make_body("block", replace(mesh, points=length * mesh.points + [0.0, gap * edge]))
    floor = Surface("floor", length * np.array([[-1.0, 0.0], [2.0, 0.0]]), np.array([[1, 0]]), "line", None)
    _, contact = make_contact([body], [(("block", "bottom"), floor)])
    contact.evaluate(np.zeros_like(contact.nodes.points), 0.0)
    assert contact.near == near


@pytest.mark.parametrize("height", [0.0, 1e-9])
def test_grazing(height):
    """Flying along a plane and touching it with no force: nothing happens, in one Newton step as without the plane."""
    structure, contact = flying_block(height, (1.0, 0.5, 0.0))
    newton = steps(structure, 5, 0.05)
    assert max(newton) <= 1
    v = structure.now.v.reshape(-1, 3)
    assert np.abs(v - [1.0, 0.5, 0.0]).max() < 1e-9
    assert np.abs(contact.resultant(0)).max() < 1e-9


def test_a_slight_touch_turns_the_block_away():
    """Slow normal motion under fast sliding: tangential momentum stays, the normal one turns around."""
    structure, contact = flying_block(0.0005, (5.0, 0.0, -0.02))
    newton = steps(structure, 16, 0.01)
    mass = structure.inertia.assemble_mass()
    x, y = mass.createVecs("right"), mass.createVecs("left")
    x.array[:] = structure.now.v
    mass.mult(x, y)
    momentum = y.array.reshape(-1, 3).sum(axis=0)
    assert momentum[0] == pytest.approx(5.0, rel=1e-10)
    assert abs(momentum[1]) < 1e-10
    assert momentum[2] > 0.005
    assert max(newton) <= 5
    assert structure.energy.kinetic + structure.energy.internal <= structure.energy.initial * (1 + 1e-12)
    assert not contact.active_set.active.any()


def test_a_pair_that_never_meets_costs_nothing(monkeypatch):
    """Neither integrals nor condensation nor trees: only boxes are compared."""
    structure, contact = flying_block(50.0, (1.0, 0.0, 0.0))

    def forbidden(*arguments, **settings):
        raise AssertionError("work for a pair that is far away")

    monkeypatch.setattr(solvers.contact.mortar, "mortar", forbidden)
    monkeypatch.setattr(solvers.contact.patch, "nodal_normals", forbidden)
    monkeypatch.setattr(contact, "condense", forbidden)
    monkeypatch.setattr(solvers.mesh.search, "update", forbidden)
    assert max(steps(structure, 3, 0.1)) <= 1
    assert not contact.near
