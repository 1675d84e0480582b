"""A stiff block slides on a base: when it starts and stops, how fast and how far, by the formulas of a rigid one."""

import numpy as np
import pytest
from contact_setup import make_body, make_contact
from structure_setup import constant

from fsci import shapes
from solvers.contact.law.coulomb import Coulomb
from solvers.generalised_alpha import GeneralisedAlpha
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings
from solvers.structure.body import Support, Traction
from solvers.structure.dynamics import Dynamics
from solvers.structure.elastic_constants import lame
from solvers.structure.materials import StVenantKirchhoff

SETTINGS = SolverSettings(Tolerance(residual=1e-10, residual_absolute=1e-9, max_iterations=15), linear="direct")
ZERO = constant(0)


def pull(t):
    """Along the block [N]: up to 2, nothing from 2 to 4 s, then back."""
    return t if t <= 2.0 else 0.0 if t <= 4.0 else -0.5 * (t - 4.0)


def exact(t):
    """Displacement of a rigid block of mass 1 and weight 10 with friction 0.1: it slips from 1 to 2.5 and 6 to 8 s."""
    first, stop, back = np.clip(t - 1.0, 0.0, 1.0), np.clip(t - 2.0, 0.0, 0.5), np.clip(t - 6.0, 0.0, 2.0)
    return first**3 / 6.0 + 0.5 * stop - 0.5 * stop**2 - back**3 / 12.0


def slide(dt):
    """Times, displacements of the block's centre, work of friction."""
    material = StVenantKirchhoff(*lame(1e6, 0.0), 1.0)
    block = make_body(
        "block",
        shapes.rectangle([1, 1], [3, 3]),
        material,
        gravity=(ZERO, constant(-10.0)),
        tractions=[Traction("left", (lambda x, t: np.full(x.shape[1], pull(t)), ZERO))],
    )
    base = make_body(
        "base", shapes.rectangle([6, 0.5], [11, 1], [-3, -0.5]), material, supports=[Support("bottom", (ZERO, ZERO))]
    )
    time = Dynamics(GeneralisedAlpha.from_rho_inf(0.0))
    structure, _ = make_contact(
        [block, base], [(("block", "bottom"), ("base", "top"))], time=time, settings=SETTINGS, law=Coulomb(0.1)
    )
    structure.initialise(0.0, dt)
    rows, newton = [], 0
    for n in range(round(8.0 / dt)):
        structure.begin_step(n * dt, dt)
        newton = max(newton, structure.solve().iterations)
        structure.end_step()
        u = structure.split(structure.now.u)[0].reshape(-1, 2)[:, 0].mean()
        rows.append([(n + 1) * dt, u, structure.energy.friction])
    assert newton <= 8
    return np.array(rows).T


def test_a_block_starts_and_stops():
    """First order in the step: at 8 s u = -0.375; the work of friction is 1 N times the way of 0.958 m."""
    errors, ends = [], []
    for dt in (0.2, 0.1, 0.05):
        t, u, work = slide(dt)
        way = np.abs(np.diff(u, prepend=0.0)).sum()
        assert work[-1] == pytest.approx(way, rel=0.02)
        errors.append(np.abs(u - exact(t)).max())
        ends.append(u[-1])
    assert errors[-1] < 0.07 * 0.375
    assert np.diff(np.log2(errors)).max() < -0.8
    assert 2.0 * ends[2] - ends[1] == pytest.approx(-0.375, rel=0.02)
