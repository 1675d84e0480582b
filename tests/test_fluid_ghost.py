"""The ghost penalty in numbers: it must not be a viscosity of its own."""

import numpy as np
import pytest
from fluid_setup import body, circle, field, loop, make_fluid, wall

from solvers.fluid.forms import Penalties
from solvers.fluid.grid import uniform


def energy(dt, **factors):
    """u^T G u of one kinked velocity around a disc, for an ordinary flow of speed 1."""
    swirl = field(lambda x, y, t: np.sin(9 * x), lambda x, y, t: np.cos(7 * x * y))
    disc = body("disc", circle((0.47, 0.53), 0.27, 40), loop(40))
    fluid = make_fluid(
        uniform([0, 0], [1, 1], [12, 12]), [wall(swirl)], [disc], mu=1e-3, dt=dt, initial_velocity=swirl,
        penalties=Penalties(**factors),
    )  # fmt: skip
    fluid.begin_step(0.0, dt)
    fluid.residual()
    ghost = fluid.system._ghost
    u, out = ghost.createVecs()
    u.array[:] = np.where(fluid.velocity_mask, fluid.flow, 0.0)[: fluid.unknowns.owned]
    ghost.mult(u, out)
    return u.dot(out)


def test_ghost_penalty_of_the_velocity_does_not_grow_as_steps_get_smaller():
    """But for its share of the mass, which has a factor of its own."""
    large, small = (energy(dt, ghost_mass=0.0) for dt in (1.0, 1e-3))
    assert 0.0 < small < large


def test_share_of_the_mass():
    """It is proportional to the factor and, for small steps, to 1 / dt."""
    shares = [energy(dt) - energy(dt, ghost_mass=0.0) for dt in (1e-3, 5e-4)]
    assert shares[1] == pytest.approx(2.0 * shares[0], rel=1e-9)
