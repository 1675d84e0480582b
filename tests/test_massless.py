"""Mass moved from a surface to the nodes behind it, and a bar that hits a wall against the exact solution."""

import numpy as np
import pytest
from contact_setup import make_body, make_contact
from structure_setup import CELL_TYPES, block, constant

from fsci import shapes
from solvers.contact.surface import Surface
from solvers.structure.body import Support
from solvers.structure.massless import move_mass_inwards
from solvers.structure.materials import StVenantKirchhoff
from solvers.structure.time import Damping, Dynamics
from solvers.time import GeneralisedAlpha

TRAPEZOIDAL = GeneralisedAlpha.from_rho_inf(1.0)


def dense(matrix):
    return matrix.convert("dense").getDenseArray()


@pytest.mark.parametrize("cell_type", CELL_TYPES)
def test_mass_and_momentum_stay(cell_type):
    body = make_body("block", block(cell_type, 3))
    before = dense(body.mass())
    at_left = np.repeat(body.points[0, : body.owned] < 1e-9, body.dim)
    matrix, massless = move_mass_inwards(body.mass(), np.flatnonzero(at_left))
    after = dense(matrix)
    assert np.array_equal(massless, np.flatnonzero(at_left))
    assert not after[at_left].any()
    assert not after[:, at_left].any()
    assert np.abs(after - after.T).max() < 1e-15
    assert np.linalg.eigvalsh(after[~at_left][:, ~at_left]).min() > 0
    for axis in range(body.dim):
        translation = np.tile(np.eye(body.dim)[axis], body.owned)
        assert translation @ after @ translation == pytest.approx(translation @ before @ translation, rel=1e-13)
    # the centre of mass moves inwards by less than the part of a cell that was moved
    x = body.points[0, : body.owned]
    first = [(mass[:: body.dim, :: body.dim] @ x).sum() for mass in (before, after)]
    assert 0 < first[1] - first[0] < 1 / 3 / 3


def test_nodes_with_nothing_behind_them_keep_their_mass():
    body = make_body("cell", block("quad", 1))
    everything = np.arange(body.size)
    matrix, massless = move_mass_inwards(body.mass(), everything)
    assert len(massless) == 0
    assert np.array_equal(dense(matrix), dense(body.mass()))


# ----------------------------------------------------------------------------------------------- a bar and a wall

SIZE = 1e-3  #: of the displacement, so small that the problem is linear


def bar(cells, dt, *, end=3.0, damping=Damping(), **contact):
    """Columns time, displacement of the tip, force on the wall, energy; all over SIZE (energy: over its square).

    E = rho = 1, held at x = 1, pressed to u = (1 - x) / 2 and let go; the wall is at x = 0. The tip touches from t = 1
    to t = 2 with the pressure 1/2, and at t = 3 all is as at the start (GetFEM, demo_dynamic_contact_1D).
    """
    zero = constant(0)
    held = [Support("right", (zero, zero)), Support("bottom", (None, zero)), Support("top", (None, zero))]
    pressed = (lambda x, t: 0.5 * SIZE * (1.0 - x[0]), zero)
    body = make_body(
        "bar",
        shapes.rectangle([1, 0.1], [cells, 1]),
        StVenantKirchhoff(mu=0.5, lmbda=0.0, density=1.0),
        supports=held,
        initial_displacement=pressed,
    )
    wall = Surface("wall", np.array([[0.0, -1.0], [0.0, 2.0]]), np.array([[0, 1]]), "line", None)
    time = Dynamics(TRAPEZOIDAL, damping=damping, **contact)
    structure, touching = make_contact([body], [(("bar", "left"), wall)], time=time)
    tip = 2 * np.flatnonzero(body.points[0, : body.owned] < 1e-9)
    structure.initialise(0.0, dt)
    rows = []
    weight = time.constraint_weight
    for step in range(round(end / dt)):
        structure.begin_step(step * dt, dt)
        structure.solve()
        structure.end_step()
        now, old = structure.now, structure.old
        force = (weight * now.constraint + (1 - weight) * old.constraint)[tip].sum() / 0.1
        energy = (structure.energy.kinetic + structure.energy.internal) / 0.1
        rows.append([(step + 1) * dt, now.u[tip].mean() / SIZE, force / SIZE, energy / SIZE**2])
    return np.array(rows).T, structure, touching


def exact_tip(t):
    return np.interp(t, [0, 1, 2, 3], [0.5, 0, 0, 0.5])


@pytest.mark.parametrize(("contact", "ringing"), [({"massless": True, "constraint_at": "mid"}, 0.05), ({}, 0.35)])
def test_bar_impact(contact, ringing):
    """The pressure is 1/2 throughout; its deviation (standard) is 0.03 without mass, 0.28 with it."""
    (t, tip, force, energy), structure, _ = bar(40, 0.01, **contact)
    body, touching = structure.bodies[0], (t > 1.1) & (t < 1.9)
    u = structure.now.u.reshape(-1, 2)[:, 0] / SIZE
    assert np.abs(tip - exact_tip(t)).max() < 0.03
    assert np.abs(u - 0.5 * (1 - body.points[0, : body.owned])).max() < 0.03
    assert force[touching].mean() == pytest.approx(0.5, abs=0.005)
    assert force[touching].std() < ringing
    assert not force[(t < 0.9) | (t > 2.1)].any()
    # the stress at the free end is relieved in the first step, and nothing is gained afterwards
    assert energy.max() < 0.125 * (1 + 1e-6)
    assert energy[-1] > 0.985 * energy[0]
    if contact:
        assert energy == pytest.approx(energy[0], rel=2e-3)


def test_bar_impact_converges():
    errors = []
    for cells in (10, 40):
        (t, tip, _, _), _, _ = bar(cells, 0.4 / cells, massless=True, constraint_at="mid")
        errors.append(np.sqrt(np.mean((tip - exact_tip(t)) ** 2)))
    assert errors[1] < 0.5 * errors[0], errors


def test_newton_with_damping_and_no_mass():
    """The tangent knows that a massless node has another velocity: quadratic convergence."""
    _, structure, _ = bar(10, 0.05, end=1.0, damping=Damping(0.1, 0.02), massless=True, constraint_at="mid")
    structure.begin_step(1.0, 0.05)
    info = structure.solve()
    assert info.iterations <= 3, info.residuals
    assert info.residuals[-1] < 1e-9 * info.residuals[0]
