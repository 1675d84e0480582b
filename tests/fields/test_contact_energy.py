"""The energy balance of bodies that slide, roll and rest on a floor: what is left is an error of contact in space.

The force acts along the averaged normals of the slave, and a gap between polyhedra also changes when their normals
turn (docs/theory_contact.md, Energy). This error does not depend on the step, and falls with the square of the cells.
"""

from dataclasses import replace

import numpy as np
import pytest
from contact_setup import make_body, make_contact
from structure_setup import constant
from test_contact_start import TRAPEZOIDAL
from test_rigid_inertia import spins

from fsci import shapes
from solvers.contact.law.coulomb import Coulomb
from solvers.contact.law.frictionless import Frictionless
from solvers.contact.surface import Surface
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings
from solvers.structure.dynamics import Dynamics
from solvers.structure.materials import NeoHooke

FLOOR = Surface("floor", np.array([[6.0, 0.0], [-6.0, 0.0]]), np.array([[0, 1]]), "line", None)
WEIGHT = (constant(0.0), constant(-10.0))
STIFF, SOFT = NeoHooke(7.7e6, 11.5e6, 1000.0), NeoHooke(3.8e5, 5.8e5, 1000.0)
SETTINGS = SolverSettings(Tolerance(residual=1e-10, residual_absolute=1e-9, max_iterations=40), linear="direct")


def disc(around, *, velocity=0.0, spin=0.0):
    mesh = shapes.disc(1.0, [around, max(2, around * 3 // 32)])
    return make_body(
        "disc",
        replace(mesh, points=mesh.points + np.array([-2.0, 1.0])),
        STIFF,
        gravity=WEIGHT,
        initial_velocity=spins([0.0, 0.0, spin], (-2.0, 1.0), v=(velocity, 0.0, 0.0)),
    )


def block(material=SOFT, height=0.0):
    return make_body("block", shapes.rectangle([1.0, 1.0], [4, 4], [0.5, height]), material, gravity=WEIGHT)


def run(bodies, law, dt, end=0.3):
    """(largest error of the balance over the energy exchanged, the errors of inertia and of internal forces)."""
    sides = {"disc": "outer", "block": "bottom"}
    pairs = [((body.name, sides[body.name]), FLOOR) for body in bodies]
    time = Dynamics(TRAPEZOIDAL)
    structure, _ = make_contact(bodies, pairs, time=time, settings=SETTINGS, law=law, exchanges_mass=True)
    structure.initialise(0.0, dt)
    errors, of_inertia, of_strain, energy = [0.0], 0.0, 0.0, structure.energy
    for n in range(round(end / dt)):
        structure.begin_step(n * dt, dt)
        structure.solve()
        kinetic, internal = energy.kinetic, energy.internal
        du = structure.now.u - structure.old.u
        structure.end_step()
        inertia = time._inertia(structure, 0.0)
        of_inertia += energy.kinetic - kinetic - inertia @ du
        of_strain += energy.internal - internal - 0.5 * (structure.old.internal + structure.now.internal) @ du
        errors.append(energy.error)
    return np.array([np.abs(errors).max(), abs(of_inertia), abs(of_strain)]) / energy.exchanged


@pytest.mark.parametrize(
    ("velocity", "spin", "law"),
    [
        pytest.param(2.0, 0.0, Coulomb(0.3), id="friction", marks=pytest.mark.slow),
        pytest.param(2.0, 2.0, Frictionless(), id="spin", marks=pytest.mark.slow),
    ],
)
def test_a_disc_beside_a_block(velocity, spin, law):
    """Inertia and internal forces are right; the error of contact does not grow with fewer or more steps."""

    def error(around, dt):
        return run([disc(around, velocity=velocity, spin=spin), block()], law, dt)

    coarse, shorter, fine = error(24, 0.005), error(24, 0.0025), error(48, 0.005)
    for found in (coarse, shorter, fine):
        assert found[1:].max() < 1e-3
    assert shorter[0] == pytest.approx(coarse[0], rel=0.05)
    assert fine[0] < coarse[0] / 2.5


def test_a_disc_that_rolls_with_the_speed_of_its_spin():
    """The foot rests, so that the direction of the force does no work."""
    assert run([disc(24, velocity=2.0, spin=-2.0), block()], Frictionless(), 0.005)[0] < 2e-3


@pytest.mark.parametrize(
    "law",
    [
        pytest.param(Frictionless(), id="frictionless", marks=pytest.mark.slow),
        pytest.param(Coulomb(0.3), id="friction"),
    ],
)
def test_a_block_that_falls_flat(law):
    """Contact of flat surfaces has no error in space: rest is exact, and the error of impacts falls with the step."""
    assert run([block()], law, 0.005, 0.1)[0] < 1e-4
    long, short = (run([block(height=0.02)], law, dt)[0] for dt in (0.01, 0.0025))
    assert short < min(long / 2.0, 2e-3)
