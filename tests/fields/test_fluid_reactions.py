"""Forces on bodies are what the discrete equations lose to them: action equals reaction to round-off."""

import numpy as np
import pytest
from fluid_setup import (
    block,
    body,
    circle,
    field,
    fluid_rule,
    loop,
    make_fluid,
    sphere,
    step,
    turned,
    values,
    wall,
)

from solvers.fluid.grid.box import uniform

RHO, MU, DT = 1.3, 0.02, 0.03


def scene(dim, element, scheme, *, convection=True):
    """Two bodies, one of them moving, in a box with velocities all round."""
    swirl = field(*[lambda x, y, *zt: 1 + y * (1 - y), lambda x, y, *zt: 0.3 * x, 0.2][:dim])
    if dim == 2:
        disc, brick = (circle((0.3, 0.35), 0.17, 40), loop(40)), block([0.6, 0.55], [0.8, 0.8])
    else:
        disc, brick = sphere((0.3, 0.35, 0.45), 0.22, 2), block([0.6, 0.55, 0.4], [0.85, 0.8, 0.7])
    v = np.array([0.5, 0.2, -0.1])[:dim]
    bodies = [
        body("disc", *disc, motion=lambda x, t: (x + t * v, 0 * x + v)),
        body("brick", turned(brick[0], 0.3, brick[0].mean(axis=0)), brick[1]),
    ]
    return make_fluid(
        uniform([0] * dim, [1] * dim, [12] * dim if dim == 2 else [6] * dim), [wall(swirl)], bodies,
        rho=RHO, mu=MU, element=element, scheme=scheme, convection=convection, dt=DT,
        body_force=field(*[1.0, -2.0, 0.5][:dim]), initial_velocity=swirl,
    )  # fmt: skip


def momentum_rate(fluid):
    """int rho (u_t + u . grad u) - f over the fluid, by a rule of its own."""
    unknowns, difference = fluid.unknowns, fluid.current.difference
    rule = fluid_rule(fluid)
    u, du, _ = values(fluid, rule)
    keep = fluid.flow.copy()
    fluid.flow[:] = fluid.system.history.x.array
    history = values(fluid, rule)[0]
    fluid.flow[:] = keep
    rate = difference.alpha * u - history
    if fluid.settings.convection:
        rate = rate + np.einsum("kqij,kqj->kqi", du, u)
    force = np.array([component(np.zeros((3, 1)), 0.0)[0] for component in fluid.settings.body_force])
    rate = RHO * rate - force
    assert unknowns.dim == len(force)
    return rule, rate


@pytest.mark.parametrize("case", [(2, "q1q1", "bdf2"), (2, "q2q1", "backward_euler"), (3, "q1q1", "bdf2")])
def test_forces_balance_the_momentum_of_the_box(case):
    fluid = scene(*case)
    for number in range(2):
        step(fluid, number * DT, DT)
    rows = fluid.system.residual()[fluid.unknowns.velocity.dofs]
    walls = rows.sum(axis=0)
    on_bodies = sum(force.sum(axis=0) for force in fluid.force().values())
    rule, rate = momentum_rate(fluid)
    inertia = np.einsum("kq,kqi->i", rule.weights, rate)
    assert np.abs(walls - on_bodies - inertia).max() < 1e-12 * np.abs(rows).sum()


@pytest.mark.parametrize("case", [(2, "q1q1", "bdf2"), (3, "q1q1", "backward_euler")])
def test_moments_balance_without_convection(case):
    """Upwinding (SUPG) turns a little; without it a rotation is as good a test function as a translation."""
    fluid = scene(*case, convection=False)
    for number in range(2):
        step(fluid, number * DT, DT)
    nodes = fluid.unknowns.velocity
    rows = fluid.system.residual()[nodes.dofs]
    walls = moment(nodes.points, rows)
    bodies = sum(moment(m.x, force) for m, force in zip(fluid.moving.motions, fluid.force().values(), strict=True))
    rule, rate = momentum_rate(fluid)
    inertia = moment(rule.x.reshape(-1, fluid.dim), (rule.weights[..., None] * rate).reshape(-1, fluid.dim))
    assert np.abs(walls - bodies - inertia).max() < 1e-12 * np.abs(rows).sum()


def moment(x, forces):
    pad = ((0, 0), (0, 3 - x.shape[1]))
    return np.cross(np.pad(x, pad), np.pad(forces, pad)).sum(axis=0)


def test_couette_torque():
    """A disc that turns in a fixed ring: u = A r + B / r, torque 4 pi mu B per depth."""
    inner, outer, omega, mu = 0.2, 0.43, 2.0, 0.7
    B = omega * inner**2 * outer**2 / (outer**2 - inner**2)
    errors = []
    for cells in (20, 40):
        n = 20 * cells
        disc, ring = circle((0.5, 0.5), inner, n), circle((0.5, 0.5), outer, n)[::-1]
        frame = block([-0.2, -0.2], [1.2, 1.2])
        spin = omega * np.stack([0.5 - disc[:, 1], disc[:, 0] - 0.5], axis=1)
        around = np.concatenate([ring, frame[0]])
        bodies = [
            body("disc", disc, loop(n), velocity=spin),
            body("ring", around, np.concatenate([loop(n), n + loop(4)])),
        ]
        fluid = make_fluid(uniform([0, 0], [1, 1], [cells] * 2), [wall(field(0, 0))], bodies, mu=mu, scheme="steady")
        step(fluid, 0.0, 1.0)
        force = fluid.force()
        torque = moment(disc - 0.5, force["disc"])[2], moment(around - 0.5, force["ring"])[2]
        assert sum(torque) == pytest.approx(0.0, abs=1e-3 * abs(torque[0]))
        errors.append(abs(torque[0] / (-4 * np.pi * mu * B) - 1))
    assert errors[1] < 0.01
    assert errors[1] < 0.4 * errors[0]
