"""A load in halves where Newton fails for all of it, beside friction: slips count from the start of the step."""

import numpy as np
import pytest
from contact_setup import make_body, make_contact
from structure_setup import block, constant

from coupling.elastic import HALVINGS_OF_LOAD, Elastic
from solvers.api import FailureKind, StepFailed
from solvers.contact.law.coulomb import Coulomb
from solvers.contact.surface import Surface
from solvers.structure.elastic_constants import lame
from solvers.structure.loads import Traction
from solvers.structure.materials import StVenantKirchhoff
from solvers.structure.springs import Spring

FRICTION, WEIGHT, STIFFNESS = 0.3, 1.0, 100.0
SHEAR = 0.5, 0.9  #: along the floor, at the end of each step [N]: more than 0.3


def floor(dim):
    ends = np.array([[9.0, 0.0], [-9.0, 0.0]])
    if dim == 2:
        return Surface("floor", ends, np.array([[0, 1]]), "line", None)
    corners = np.array([[-9.0, -9.0, 0.0], [9.0, -9.0, 0.0], [9.0, 9.0, 0.0], [-9.0, 9.0, 0.0]])
    return Surface("floor", corners, np.array([[0, 1, 2, 3]]), "quad", None)


def slide(dim, failures):
    """A block on a floor in two steps, in which Newton's method fails so often: its state, and solutions looked for."""
    pressed = tuple(constant(0.0 if i < dim - 1 else -WEIGHT) for i in range(dim))
    springs = [Spring("bottom", constant(STIFFNESS), (1.0, *[0.0] * (dim - 1)))]
    material = StVenantKirchhoff(*lame(1.0e5, 0.0), 1.0)
    mesh = block("quad" if dim == 2 else "hexahedron", 2)
    body = make_body("block", mesh, material, tractions=[Traction("top", pressed)], springs=springs)
    structure, contact = make_contact([body], [(("block", "bottom"), floor(dim))], law=Coulomb(FRICTION))
    low = np.flatnonzero(mesh.points[:, -1] == mesh.points[:, -1].min())
    load = np.zeros((len(mesh.points), dim))
    load[:, 0] = 1.0 / len(mesh.points)
    solve, calls = structure.solve, []

    def fail_first():
        calls.append(structure.now.surface.copy())
        if len(calls) <= failures:
            structure.now.u[:] = 1e3
            raise StepFailed("structure", FailureKind.NEWTON, "too large a load")
        return solve()

    structure.solve = fail_first
    elastic, counts = Elastic(structure, []), []
    elastic.initialise(0.0, 1.0)
    for t, shear in enumerate(SHEAR):
        calls.clear()
        elastic.begin_step(float(t), 1.0)
        structure.load(shear * load.ravel())
        elastic.solve()
        elastic.end_step()
        counts.append(len(calls))
    return structure, contact, low, counts


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize(("failures", "solutions"), [(0, 1), (1, 3), (2, 5)])
def test_friction_under_halved_loads_is_that_of_the_whole_step(dim, failures, solutions):
    """The block slides until springs carry what friction does not, and friction takes its force times this way."""
    structure, _, low, counts = slide(dim, failures)
    assert counts == [solutions] * 2
    way = (SHEAR[-1] - FRICTION * WEIGHT) / STIFFNESS
    points = structure.bodies[0].points[:dim, : len(structure.now.u) // dim]
    under = points[-1] < 1e-12
    moved = structure.now.u.reshape(-1, dim)[under]
    assert len(moved) == len(low)
    assert moved[:, 0].mean() == pytest.approx(way, rel=0.01)
    assert structure.energy.friction == pytest.approx(FRICTION * WEIGHT * way, rel=0.01)
    whole = slide(dim, 0)[0]
    assert structure.now.u == pytest.approx(whole.now.u, abs=1e-10)
    assert structure.energy.friction == pytest.approx(whole.energy.friction, rel=1e-9)


def test_a_load_that_fails_in_its_smallest_part_fails():
    with pytest.raises(StepFailed, match="too large a load"):
        slide(2, HALVINGS_OF_LOAD + 1)
