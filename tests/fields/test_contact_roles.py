"""Who is the slave does not decide whether Newton's method converges, and sets that cycle end by a line search."""

import numpy as np
import pytest
from contact_setup import make_body, make_contact, solve_step
from structure_setup import constant, vector

from fsci import shapes
from solvers.contact.law.coulomb import Coulomb
from solvers.contact.law.frictionless import Frictionless
from solvers.contact.surface import Surface
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings
from solvers.structure.body import Support, Traction
from solvers.structure.elastic_constants import lame
from solvers.structure.materials import NeoHooke

ZERO = constant(0)
SETTINGS = SolverSettings(Tolerance(residual=1e-9, max_iterations=25), linear="direct")


def material(stiffness):
    return NeoHooke(*lame(stiffness, 0.3), 1.0)


def dragged(ratio, slave, law, length=1.0):
    """A block, `ratio` times as stiff as the base, is pressed onto it and dragged: (Newton steps, force on it)."""

    def lowered(x, t):
        return np.full(x.shape[1], -0.05 * length * min(t, 1.0))

    def pulled(x, t):
        return np.full(x.shape[1], 0.02 * length * max(t - 1.0, 0.0))

    base = shapes.rectangle([3 * length, length], [23, 6])
    block = shapes.rectangle([length, 0.6 * length], [7, 5], [0.6 * length, length])
    bodies = [
        make_body("base", base, material(1e3), supports=[Support("bottom", (ZERO, ZERO))]),
        make_body("block", block, material(1e3 * ratio), supports=[Support("top", (pulled, lowered))]),
    ]
    sides = [("block", "bottom"), ("base", "top")]
    structure, contact = make_contact(
        bodies, [tuple(sides if slave == "block" else sides[::-1])], settings=SETTINGS, law=law
    )
    structure.initialise(0.0, 1.0)
    steps = [solve_step(structure, float(k), first=False).iterations for k in range(5)]
    return steps, contact.resultant(0) * (1.0 if slave == "block" else -1.0)


@pytest.mark.parametrize("law", [Frictionless(), Coulomb(0.3)], ids=["frictionless", "coulomb"])
@pytest.mark.parametrize("ratio", [1e-4, 1e-2, 1.0, 1e2, 1e4])
def test_either_side_may_be_the_slave(law, ratio):
    steps = {slave: dragged(ratio, slave, law)[0] for slave in ("block", "base")}
    few, many = sorted(sum(found) for found in steps.values())
    assert many <= 1.5 * few, steps
    assert max(max(found) for found in steps.values()) <= 10, steps


def test_newton_steps_do_not_depend_on_the_unit_of_length():
    assert dragged(1e4, "block", Coulomb(0.3), 1e-3)[0] == dragged(1e4, "block", Coulomb(0.3))[0]


STIFF, OVERLAP = 1e7, 0.002


def press_fit(cells, slave, settings=SETTINGS):
    """Rings of radius 1 to 2 and 2 to 3, the outer one stiff, that overlap: (structure, inner ring)."""

    def ring(name, inside, outside, count, stiffness):
        mesh = shapes.ring(inside, outside, [count, 5], angle=90, order=2)
        held = [Support("start", (None, ZERO)), Support("end", (ZERO, None))]
        return make_body(name, mesh, material(stiffness), supports=held)

    bodies = [
        ring("inner", 1.0, 2.0 + 0.5 * OVERLAP, cells[0], 1e3),
        ring("outer", 2.0 - 0.5 * OVERLAP, 3.0, cells[1], STIFF),
    ]
    sides = [("inner", "outer"), ("outer", "inner")]
    return make_contact(bodies, [tuple(sides if slave == "inner" else sides[::-1])], settings=settings)[0], bodies[0]


@pytest.mark.parametrize("cells", [(12, 17), (17, 12), (12, 24)])
@pytest.mark.parametrize("slave", ["inner", "outer"])
def test_a_press_fit_into_a_stiff_ring(cells, slave):
    """Radius 2 as in the theory of thick rings, whichever ring has more conditions than the other one has nodes."""
    structure, inner = press_fit(cells, slave)
    solve_step(structure)
    u = structure.split(structure.now.u)[0].reshape(-1, 2)
    points = inner.points[:2, : inner.owned].T
    bore = np.abs(np.hypot(*points.T) - 1.0) < 1e-9
    radial = np.einsum("nd,nd->n", u, points)[bore]
    pressure = OVERLAP / 2.0 / ((0.91 / 1e3) * ((1 + 4) / (4 - 1) - 0.3 / 0.7))  # of a ring against a rigid one
    exact = -2.0 * pressure * 4.0 / (4 - 1) * 0.91 / 1e3
    assert radial.mean() == pytest.approx(exact, rel=0.01)


@pytest.mark.parametrize("count", [8, 12])
def test_either_ring_may_be_the_slave_where_the_stiff_one_is_not_finer(count):
    few, many = sorted(solve_step(press_fit((12, count), slave)[0]).iterations for slave in ("inner", "outer"))
    assert many <= 1.5 * few


@pytest.mark.parametrize(("count", "few"), [(8, 17), (24, 25)], ids=["coarse", "fine"])
def test_a_rigid_slave_is_pressed_at_no_more_nodes_than_the_master_has(count, few):
    """Gaps of a rigid slave are functions of the master's 25 nodes: of 49 conditions the others follow and are open.

    Hence pressures of a stiff slave that is finer than its master vary from node to node, and their sum is right. One
    that is coarser has the pressure of thick rings.
    """
    structure, _ = press_fit((12, count), "outer")
    contact = structure.constraint
    solve_step(structure)
    assert contact.active_set.active.sum() == few
    pressures = np.einsum("nd,nd->n", contact.z, contact.terms.normals)
    pressure = OVERLAP / 2.0 / ((0.91 / 1e3) * ((1 + 4) / (4 - 1) - 0.3 / 0.7))
    assert pressures.min() > -1e-9 * pressure
    quarter = 2.0 * np.pi / 2.0  # of the circle of radius 2
    assert contact.terms.D @ pressures == pytest.approx(pressure * quarter, rel=0.005)
    if count == 8:
        assert pressures[contact.active_set.active] == pytest.approx(np.full(few, pressure), rel=0.03)


def strip_on_a_corner(order, edge, settings=SETTINGS):
    """A thin strip, held at both ends, above a rigid step whose corner is at `edge`: (structure, contact)."""
    load = Traction("top", (ZERO, lambda x, t: np.full(x.shape[1], -0.025 * t)))
    strip = make_body(
        "strip",
        shapes.rectangle([2.0, 0.05], [40, 1], [-1.0, 0.0], order=order),
        material(1e3),
        supports=[Support(side, vector(0, 0)) for side in ("left", "right")],
        tractions=[load],
    )
    points = np.array([[edge, -0.58], [edge, -0.08], [edge - 0.5, -0.08]])
    step = Surface("step", points, np.array([[0, 1], [1, 2]]), "line", None)
    return make_contact([strip], [(("strip", "bottom"), step)], settings=settings)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("edge", [-0.5, -0.483, -0.467])
def test_a_strip_on_the_corner_of_a_step(order, edge):
    """A thin strip is far softer in bending than a gap at its surface: whole Newton steps overshoot the corner."""
    structure, contact = strip_on_a_corner(order, edge)
    structure.initialise(0.0, 1.0)
    for k in range(10):
        solve_step(structure, float(k), first=False)
    assert contact.resultant(0)[1] > 0.0
    assert structure.now.u.min() > -1.0
