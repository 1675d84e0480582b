"""Contact goes on when pairs are added to it between two steps."""

from __future__ import annotations

import numpy as np
import pytest
from contact_setup import make_body, make_contact
from mpi4py import MPI
from structure_setup import block

from coupling.contact_surfaces import contact_surface
from solvers.contact.carry_over import carry_over
from solvers.contact.contact import Contact
from solvers.contact.law.coulomb import Coulomb
from solvers.contact.pair import Pair
from solvers.contact.surface import Surface
from solvers.structure.body import Support

#: Below the unit square, and a wall at its right that nothing reaches.
GROUND = Surface("ground", np.array([[3.0, 0.0], [-3.0, 0.0]]), np.array([[0, 1]]), "line", None)
WALL = Surface("wall", np.array([[5.0, -3.0], [5.0, 3.0]]), np.array([[0, 1]]), "line", None)


def pushed():
    """A block that is pressed on the ground and dragged, with friction; it slips in the later steps."""

    def along(x, t):
        return 0.01 * t**2 + 0.0 * x[0]

    def down(x, t):
        return -0.02 + 0.0 * x[0]

    body = make_body("body", block("quad", 3), supports=[Support("top", (along, down))])
    return make_contact([body], [(("body", "bottom"), GROUND, Coulomb(0.3))])


def step(structure, number):
    structure.begin_step(float(number), 1.0)
    structure.solve()
    structure.end_step()


@pytest.mark.parametrize("more", [["right"], ["right", "left", "top", "bottom"]])
def test_friction_goes_on(more):
    """Also where the slave of the new pair has the facets of the old one."""
    (one, alone), (other, before) = pushed(), pushed()
    for structure in (one, other):
        structure.initialise(0.0, 1.0)
        for number in range(3):
            step(structure, number)
    slave = contact_surface(other.bodies, "body", *more)
    after = Contact([*before.pairs, Pair(slave, WALL, law=Coulomb(0.3))], comm=MPI.COMM_SELF)
    other.constrain(after, exchanges_mass=False)
    other.start_constraint()
    carry_over(before, after, after.positions(other.at_constraint(other.now.u), 3.0))
    assert before.friction_work > 0.0
    assert after.friction_work == before.friction_work
    assert after.active().sum() == before.active().sum()
    for number in (3, 4):
        step(one, number)
        step(other, number)
    np.testing.assert_allclose(other.now.u, one.now.u, rtol=0.0, atol=1e-10)  # Newton stops at 1e-11
    np.testing.assert_allclose(after.resultant(0), alone.resultant(0), rtol=1e-9)
    np.testing.assert_allclose(after.resultant(1), 0.0, atol=1e-12)
    assert after.friction_work == pytest.approx(alone.friction_work, rel=1e-9)
