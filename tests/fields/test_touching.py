"""Bodies that just touch, at rest and without force: nothing happens, with and without friction, tied or not."""

import numpy as np
import pytest
from contact_setup import brick, make_body, make_contact, solve_step
from structure_setup import constant

from solvers.contact.law.coulomb import Coulomb
from solvers.contact.law.frictionless import Frictionless
from solvers.contact.law.tied import Tied
from solvers.generalised_alpha import GeneralisedAlpha
from solvers.structure.body import Support
from solvers.structure.dynamics import Dynamics
from solvers.structure.time_scheme import Statics

ZERO = constant(0)
LAWS = {"frictionless": Frictionless(), "coulomb": Coulomb(0.3), "tied": Tied()}


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("moves", [False, True], ids=["static", "dynamic"])
@pytest.mark.parametrize(("lower", "upper"), [("quad", "triangle6"), ("hexahedron", "tetra")])
def test_nothing_happens(lower, upper, moves, law):
    """Heights that have no exact sum: the gap is rounding. Three steps at rest, no force; then it bears a load."""
    dim = 2 if lower == "quad" else 3
    none = (ZERO,) * dim

    def pushed(x, t):
        return -1e-3 * max(t - 3.0, 0.0) + ZERO(x, t)

    sizes = [1.0] * (dim - 1)
    bodies = [
        make_body("lower", brick(lower, 3, [*sizes, 0.1], [0.0] * dim), supports=[Support("bottom", none)]),
        make_body(
            "upper",
            brick(upper, 2, [*sizes, 0.2], [0.0] * (dim - 1) + [0.30000000000000004 - 0.2]),
            supports=[Support("top", (*none[:-1], pushed))],
        ),
    ]
    time = Dynamics(GeneralisedAlpha.from_rho_inf(1.0)) if moves else Statics()
    structure, contact = make_contact(bodies, [(("lower", "top"), ("upper", "bottom"))], law=LAWS[law], time=time)
    for step in range(3):
        info = solve_step(structure, float(step), first=step == 0)
        assert info.iterations <= 2
        assert np.abs(structure.now.u).max() < 1e-15
        assert np.abs(contact.z).max() < 1e-10
        assert np.abs(contact.force()).max() < 1e-12
    solve_step(structure, 3.0, first=False)
    pressed = contact.resultant(0)[-1]
    assert pressed < -1e-1
    assert np.nanmax(np.abs(contact.mean_gap())) < 1e-12
