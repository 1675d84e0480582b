"""A flow that is not `solvers.fluid`, coupled with elastic and rigid bodies: its mass is added to theirs."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from column import Column
from mpi4py import MPI
from scipy.optimize import brentq

from coupling.accelerate import QuasiNewton
from coupling.coupled import Coupled
from coupling.elastic import Elastic
from coupling.monolithic import Monolithic
from coupling.partitioned import FixedPointTolerance, Partitioned
from coupling.wetted import wetted_surfaces
from fsci import shapes
from solvers.generalised_alpha import GeneralisedAlpha
from solvers.mesh.skin import cut_out_skin
from solvers.newton import Tolerance
from solvers.rigid.body import PointSpring, RigidBody
from solvers.rigid.field import RigidBodies
from solvers.rigid.inertia import Inertia
from solvers.solver_settings import SolverSettings
from solvers.structure.body import Body, Support, Symmetry
from solvers.structure.dynamics import Dynamics
from solvers.structure.elastic_constants import lame
from solvers.structure.field import Structure
from solvers.structure.materials import StVenantKirchhoff

TIGHT = Tolerance(1e-10)
SPEED, WIDTH, MASS, STIFFNESS = 1e-5, 0.2, 0.6, 5.0


def bar(ratio: float) -> tuple[Elastic, Column, float]:
    """An elastic bar 0 < x < 1, held at x = 0, that starts with the velocities of its first mode, and its frequency.

    E = rho_s = 1, nu = 0, hence k tan k = rho_s L_s / (rho_f L) with the column.
    """
    k, (mu, lmbda) = brentq(lambda k: k * np.tan(k) - ratio, 0.0, 1.57), lame(1.0, 0.0)
    body = Body(
        "bar",
        shapes.rectangle([1.0, WIDTH], [20, 1], order=1, cell="quad"),
        StVenantKirchhoff(mu, lmbda, 1.0),
        supports=(Support("left"), Symmetry("top"), Symmetry("bottom")),
        initial_velocity=(lambda x, t: SPEED * np.sin(k * x[0]) / np.sin(k), 0.0),
        comm=MPI.COMM_SELF,
    )
    time = Dynamics(GeneralisedAlpha.from_rho_inf(1.0))
    structure = Structure([body], time, SolverSettings(TIGHT))
    (surface,) = wetted_surfaces(structure, [cut_out_skin(body.domain.source, ("right",))])
    column = Column("bar", surface.points, surface.facets, density=1.0 / ratio, length=1.0, velocity=SPEED)
    return Elastic(structure, [surface]), column, k


def block(ratio: float) -> tuple[RigidBodies, Column, float]:
    """A free rigid body on a spring, which starts with a velocity, and its frequency: sqrt(k / (m + M))."""
    points = np.array([[0.0, 0.0], [0.3, 0.0], [0.3, WIDTH], [0.0, WIDTH]])
    facets = np.array([[0, 1], [1, 2], [2, 3], [3, 0]])
    inertia = Inertia(MASS, np.array([0.15, 0.5 * WIDTH]), 0.01 * np.eye(3))
    spring = PointSpring((0.15, 0.5 * WIDTH), STIFFNESS)
    body = RigidBody("block", points, facets, inertia, springs=[spring], initial_velocity=(SPEED, 0.0))
    density = MASS / (ratio * WIDTH)
    column = Column("block", points, facets, density=density, length=1.0, velocity=SPEED)
    solid = RigidBodies([body], GeneralisedAlpha.from_rho_inf(1.0), TIGHT, comm=MPI.COMM_SELF)
    return solid, column, float(np.sqrt(STIFFNESS / (MASS * (1.0 + 1.0 / ratio))))


def way(scheme, frequency: float, per_period: int) -> np.ndarray:
    """Displacement of the wall over SPEED / frequency after each step of a period."""
    dt, coupled = 2.0 * np.pi / frequency / per_period, scheme.coupled
    scheme.initialise(0.0, dt)
    found = []
    for number in range(per_period):
        scheme.step(number * dt, dt)
        found.append(coupled.flow.shares @ coupled.interface.now[:, 0] / (SPEED / frequency))
        assert coupled.balance.force < 1e-6
        assert coupled.balance.momentum <= 1e-9 * coupled.balance.load
    return np.array(found)


@pytest.mark.parametrize("solid", [bar, block])
@pytest.mark.parametrize("ratio", [10.0, 1.0, 0.1])
def test_added_mass(solid, ratio):
    errors = []
    for per_period in (50, 100):
        part, flow, frequency = solid(ratio)
        exact = np.sin(2.0 * np.pi * np.arange(1, per_period + 1) / per_period)
        errors.append(np.abs(way(Monolithic(Coupled(flow, part), TIGHT), frequency, per_period) - exact).max())
    assert errors[1] < 0.01
    assert errors[0] > 3.0 * errors[1]


@pytest.mark.parametrize("solid", [bar, block])
@pytest.mark.parametrize("ratio", [1.0, 0.1])
def test_both_schemes_agree(solid, ratio):
    part, flow, frequency = solid(ratio)
    one = way(Monolithic(Coupled(flow, part), TIGHT), frequency, 40)
    part, flow, frequency = solid(ratio)
    scheme = Partitioned(Coupled(flow, part), QuasiNewton(0.5), FixedPointTolerance(1e-9))
    assert way(scheme, frequency, 40) == pytest.approx(one, abs=1e-6)


@pytest.mark.parametrize("scheme", [Monolithic, Partitioned])
def test_resumed(scheme):
    def steps(made, numbers):
        for number in numbers:
            made.step(0.1 * number, 0.1)
        return made.coupled.interface.now

    whole, part = (scheme(Coupled(*reversed(bar(1.0)[:2]))) for _ in range(2))
    whole.initialise(0.0, 0.1)
    steps(whole, range(3))
    state = whole.save()
    part.initialise(0.0, 0.1)
    part.restore(state)
    assert np.array_equal(steps(part, range(3, 6)), steps(whole, range(3, 6)))


def test_does_without_the_fluid():
    """Nothing that another flow needs imports the one that the program has."""
    here = Path(__file__).parent
    program = (
        f"import sys; sys.path[:0] = [{str(here)!r}, {str(here.parent / 'setups')!r}]; from test_other_flow import *;"
        "part, flow, frequency = block(1.0); way(Monolithic(Coupled(flow, part), TIGHT), frequency, 4);"
        "part, flow, frequency = bar(1.0); way(Partitioned(Coupled(flow, part)), frequency, 4);"
        "found = [name for name in sys.modules if name.startswith('solvers.fluid')]; assert not found, found"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stderr
