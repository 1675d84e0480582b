"""Closed pockets of fluid: what their pressure is, and that the run goes on."""

from __future__ import annotations

import numpy as np
import pytest
from coupling_setup import TIGHT, couple_one
from fluid_setup import body, field, loop, make_fluid, step
from mpi4py import MPI

from coupling.accelerate import Aitken
from coupling.monolithic import Monolithic
from coupling.partitioned import FixedPointTolerance, Partitioned
from fsci import shapes
from solvers.fluid.grid.box import uniform
from solvers.fluid.settings.flow_settings import FlowSettings
from solvers.fluid.terms.boundary.patches import Patch
from solvers.generalised_alpha import GeneralisedAlpha
from solvers.structure.body import Body, Symmetry
from solvers.structure.dynamics import Dynamics
from solvers.structure.elastic_constants import lame
from solvers.structure.materials import StVenantKirchhoff

WEIGHT, DT = 3.0, 0.05


def bell(ceiling=0.0, *, element="q1q1"):
    """A rigid bell on the bottom of a channel with an outlet; its ceiling comes down with a velocity."""
    corners = np.array(
        [[0.2, -0.2], [0.4, -0.2], [0.4, 0.2], [0.6, 0.2], [0.6, -0.2], [0.8, -0.2], [0.8, 0.43], [0.2, 0.43]]
    )
    corners += [0.012, 0.013]

    def motion(points, t):
        x, v = points.copy(), np.zeros_like(points)
        x[[2, 3], 1] -= ceiling * t
        v[[2, 3], 1] -= ceiling
        return x, v

    inflow = field(lambda x, y, t: y * (1 - y) * np.minimum(t / DT, 1), 0)
    patches = [
        Patch("in", ("x-",), "velocity", inflow),
        Patch("out", ("x+",), "outflow"),
        Patch("walls", ("y-", "y+"), "no_slip"),
    ]
    rigid = body("bell", corners, loop(8), motion=motion if ceiling else None)
    return make_fluid(
        uniform([0, 0], [1, 1], [20, 20]), patches, [rigid],
        mu=0.05, scheme="backward_euler", dt=DT, element=element, body_force=field(0, -WEIGHT),
    )  # fmt: skip


def pocket_pressure(fluid):
    nodes = fluid.unknowns.pressure
    inside = (np.abs(nodes.points[:, 0] - 0.512) < 0.07) & (nodes.points[:, 1] < 0.21)
    return nodes.points[inside, 1], fluid.flow[nodes.dofs[inside, 0]]


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_pocket_between_rigid_walls(element):
    """Its pressure is hydrostatic and has a level that stays."""
    fluid = bell(element=element)
    levels = []
    for number in range(3):
        info = step(fluid, number * DT, DT)
        assert info.iterations <= 4
        y, p = pocket_pressure(fluid)
        levels.append(p + WEIGHT * y)
        assert np.ptp(levels[-1]) < 1e-9
    assert np.ptp([level[0] for level in levels]) < 1e-9


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_pocket_that_has_to_shrink(element):
    """What cannot be is done as if its fluid vanished everywhere alike: no step fails, no pressure explodes."""
    fluid = bell(0.1, element=element)
    for number in range(4):
        info = step(fluid, number * DT, DT)
        assert info.iterations <= 5
        assert np.abs(fluid.flow[fluid.unknowns.pressure.dofs]).max() < 20.0


def chamber():
    """An elastic plug in a channel between an inlet with pressure 2 and a closed end."""
    mesh = shapes.rectangle([0.4, 0.2], [4, 2], order=1, cell="quad")
    mesh.points[:, 0] += 0.513
    mu, lmbda = lame(100.0, 0.0)
    supports = (Symmetry("top"), Symmetry("bottom"))
    plug = Body("plug", mesh, StVenantKirchhoff(mu, lmbda, 1.0), supports=supports, comm=MPI.COMM_SELF)
    return couple_one(
        plug,
        Dynamics(GeneralisedAlpha.from_rho_inf(0.0)),
        uniform([0.0, 0.0], [1.5, 0.2], [15, 2]),
        FlowSettings(1.0, 0.1, scheme="backward_euler"),
        [
            Patch("inlet", ("x-",), "traction", (2.0, 0.0)),
            Patch("sides", ("y-", "y+"), "slip"),
            Patch("end", ("x+",), "slip"),
        ],
        wetted=("left", "right"),
    )


def test_pocket_behind_an_elastic_body():
    """The elasticity of the plug makes the pressure behind it known: that of the inlet, when all is at rest."""
    coupled = chamber()
    scheme = Monolithic(coupled, TIGHT)
    coupled.initialise(0.0, 1.0)
    for number in range(25):
        scheme.step(float(number), 1.0)
    nodes, fluid = coupled.flow.unknowns.pressure, coupled.flow
    behind = nodes.points[:, 0] > 1.05
    assert fluid.flow[nodes.dofs[behind, 0]] == pytest.approx(2.0, rel=1e-8)
    right = coupled.interface.points[:, 0] > 0.9
    assert np.abs(coupled.interface.now[right, 0]).max() < 1e-10


def behind(coupled):
    """Pressure [Pa] in the chamber behind the plug."""
    nodes, fluid = coupled.flow.unknowns.pressure, coupled.flow
    return fluid.flow[nodes.dofs[nodes.points[:, 0] > 1.05, 0]]


def test_partitioned_scheme_finds_the_pressure_behind_an_elastic_body():
    """The level is an unknown of its iteration: the plug swings on the fluid as in the monolithic scheme."""
    coupled, other, pressures = chamber(), chamber(), []
    monolithic, partitioned = Monolithic(coupled, TIGHT), Partitioned(other, tolerance=FixedPointTolerance(1e-9))
    for scheme in (monolithic, partitioned):
        scheme.initialise(0.0, 0.1)
    for number in range(6):
        monolithic.step(0.1 * number, 0.1)
        assert partitioned.step(0.1 * number, 0.1).iterations <= 15
        pressures.append(behind(coupled).mean())
        assert behind(other) == pytest.approx(behind(coupled), rel=1e-7)
        assert np.abs(other.interface.now - coupled.interface.now).max() < 1e-10
    assert max(pressures) > 2.2
    state = partitioned.save()
    other, resumed = chamber(), []
    for scheme in (partitioned, Partitioned(other, tolerance=FixedPointTolerance(1e-9))):
        if scheme is not partitioned:
            scheme.initialise(0.0, 0.1)
        scheme.restore(state)
        scheme.step(0.6, 0.1)
        resumed.append(scheme.coupled.interface.now.copy())
    assert np.array_equal(*resumed)


def test_relaxation_alone_keeps_the_level():
    """It would not converge with the level as an unknown: the mean pressure behind the plug stays near zero."""
    coupled = chamber()
    scheme = Partitioned(coupled, Aitken(0.5), FixedPointTolerance(1e-6))
    scheme.initialise(0.0, 0.01)
    assert scheme.step(0.0, 0.01).iterations <= 20
    hold = coupled.flow.parts.levels._holds[0]
    mean = hold.shares @ coupled.flow.flow[: len(hold.shares)]
    assert abs(mean) < 1e-3 * np.abs(behind(coupled)).max()  # the shares of the nodes change as the plug moves
