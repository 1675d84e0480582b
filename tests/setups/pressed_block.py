"""A block pressed onto a plate in one step, with linear systems of contact solved in different ways."""

import numpy as np
from contact_setup import make_body, make_contact, solve_step
from structure_setup import constant

from solvers.mesh.mesh import Mesh
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings
from solvers.structure.body import Support
from solvers.structure.elastic_constants import lame
from solvers.structure.materials import NeoHooke

ZERO = constant(0.0)


def press_block(method: str, block: Mesh, plate: Mesh, *, held: str):
    """(structure, contact, info) after one step, in which the top of the block moves down by 0.08.

    method: of `SolverSettings.linear`; held: surface of the plate.
    """
    material = NeoHooke(*lame(1000.0, 0.3))
    down = (ZERO, ZERO, lambda x, t: np.full(x.shape[1], -0.08 * t))
    bodies = [
        make_body("plate", plate, material, supports=[Support(held, (ZERO,) * 3)]),
        make_body("block", block, material, supports=[Support("top", down)]),
    ]
    settings = SolverSettings(Tolerance(residual=1e-10), linear=method)
    structure, contact = make_contact(bodies, [(("block", "bottom"), ("plate", "top"))], settings=settings)
    return structure, contact, solve_step(structure)


def assert_same_results(found, direct, *, displacement: float):
    """As many Newton steps, and the same displacements (up to this part of the largest) and contact force."""
    assert found[2].iterations == direct[2].iterations
    largest = np.abs(direct[0].now.u).max()
    assert np.abs(found[0].now.u - direct[0].now.u).max() < displacement * largest
    force = direct[1].resultant(0)
    assert np.abs(found[1].resultant(0) - force).max() < 1e-6 * np.abs(force).max()
