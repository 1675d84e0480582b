"""The ghost penalty in numbers: it must not be a viscosity of its own."""

import numpy as np
import pytest
from fluid_setup import body, circle, field, loop, make_fluid, wall

from solvers.fluid.grid.box import uniform
from solvers.fluid.settings.penalties import Penalties


def kinked_flow(dt, **factors):
    """A fluid around a disc at the end of its first iterate; the cells' functions have kinks between them."""
    swirl = field(lambda x, y, t: np.sin(9 * x), lambda x, y, t: np.cos(7 * x * y))
    disc = body("disc", circle((0.47, 0.53), 0.27, 40), loop(40))
    fluid = make_fluid(
        uniform([0, 0], [1, 1], [12, 12]), [wall(swirl)], [disc], mu=1e-3, dt=dt, initial_velocity=swirl,
        penalties=Penalties(**factors),
    )  # fmt: skip
    fluid.begin_step(0.0, dt)
    fluid.residual()
    return fluid


def energy(dt, **factors):
    """u^T G u of one kinked velocity around a disc, for an ordinary flow of speed 1."""
    fluid = kinked_flow(dt, **factors)
    ghost = fluid.system.matrix.penalty.matrix
    u, out = ghost.createVecs()
    u.array[:] = fluid.velocity()[: fluid.unknowns.owned]
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


def momentum(fluid):
    return fluid.iterate.rows[fluid.unknowns.velocity_mask[: len(fluid.iterate.rows)]]


@pytest.mark.parametrize("fading", [0.0, 0.1])
def test_share_of_the_mass_is_one_of_the_acceleration(fading):
    """A velocity that does not change feels only how it fades, whatever its kinks; a change does."""
    fluids = [kinked_flow(1e-3, ghost_mass=factor, ghost_fading=fading) for factor in (0.0, 1.0)]
    for growth in (1.0, 1.25):
        for fluid in fluids:
            fluid.flow[fluid.unknowns.velocity_mask] *= growth
            fluid.residual()
        without, with_mass = (momentum(fluid) for fluid in fluids)
        share = np.subtract(*(ghost_rows(fluid) for fluid in reversed(fluids)))
        of_this = 1.0 - 1.0 / (growth * (1.0 + fading))
        np.testing.assert_allclose(with_mass - without, of_this * share, atol=1e-10 * np.abs(share).max())
        assert np.abs(share).max() > 0.0


def test_mass_term_without_an_earlier_velocity():
    """It is one of the velocity then, as if all there had begun at rest."""
    fluids = [kinked_flow(1e-3, ghost_mass=factor) for factor in (0.0, 1.0)]
    rows = []
    for fluid in fluids:
        system = fluid.system
        nothing = np.ones(fluid.unknowns.local, dtype=bool)
        rate = fluid.history.rate(fluid.current.difference)
        system.begin_step(fluid.current, rate, nothing, fluid.velocity())
        fluid.residual()
        rows.append(momentum(fluid))
    shares = [ghost_rows(fluid) for fluid in fluids]
    np.testing.assert_allclose(rows[1] - rows[0], shares[1] - shares[0], atol=1e-10 * np.abs(rows[1]).max())
    assert np.abs(rows[1] - rows[0]).max() > 0.0


def ghost_rows(fluid):
    """The ghost penalty's matrix times the flow, at the rows that `momentum` has."""
    u, out = fluid.system.matrix.penalty.matrix.createVecs()
    u.array[:] = fluid.flow[: fluid.unknowns.owned]
    fluid.system.matrix.penalty.matrix.mult(u, out)
    return np.where(fluid.iterate.held, 0.0, out.array)[fluid.unknowns.velocity_mask[: fluid.unknowns.owned]]
