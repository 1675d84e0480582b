"""Thin bodies in periodic cells: the fluid on one side does not know of that on the other."""

import numpy as np
import pytest
from fluid_setup import body, field, loop, make_fluid, solve_steady, step
from programs import fsci

from fsci.running.history import read_history
from solvers.fluid.flow.probes import at_point
from solvers.fluid.grid.box import uniform
from solvers.fluid.terms.boundary.patches import Patch

SIDES, CELL = 24, 0.125
#: slivers of fluid are extended from far away; the same in an open box
NOTHING = {"q1q1": 1e-9, "q2q1": 1e-8}
PERIOD = [Patch("period", ("x-", "x+"), "periodic"), Patch("walls", ("y-", "y+"), "no_slip")]
FREE = [Patch("period", ("x-", "x+"), "periodic"), Patch("walls", ("y-", "y+"), "slip")]


def thin_ring(x, y, radius, thickness):
    """(points, facets) of a ring of fluid on both sides."""
    angle = 2.0 * np.pi * np.arange(SIDES) / SIDES
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points = np.concatenate([radius * ring, (radius - thickness) * ring])
    points = np.array([x, y]) + np.round(points * 2**30) / 2**30  # moved by parts of cells without rounding
    return points, np.concatenate([loop(SIDES), loop(SIDES)[:, ::-1] + SIDES])


def driven(x, thickness, element, cells=(12, 8)):
    """A flow that a force drives past a ring at rest."""
    fluid = make_fluid(
        uniform([0, 0], [CELL * cells[0], 1.0], cells), PERIOD,
        [body("ring", *thin_ring(x, 0.515625, 0.28, thickness))],
        element=element, scheme="steady", convection=False, mu=0.3, body_force=field(2.0, 0.0),
    )  # fmt: skip
    solve_steady(fluid)
    return fluid


@pytest.mark.parametrize("thickness", [1e-3, 0.02, 0.1])
@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_fluid_within_a_ring_is_at_rest(element, thickness):
    """Its pressure balances the force, and the flow around it does not depend on where the period begins."""
    first, moved = driven(0.953125, thickness, element), driven(0.453125, thickness, element)
    for fluid, middle in ((first, 0.953125), (moved, 0.453125)):
        velocity, pressure = (
            [np.array(list(at_point(fluid, name, (middle + x, y), 0.0)().values()))
             for x, y in ((0.0, 0.52), (0.12, 0.52), (-0.1, 0.45), (0.05, 0.63))]
            for name in ("velocity", "pressure")
        )  # fmt: skip
        assert np.abs(velocity).max() < 1e-10
        off = np.ravel(pressure) - pressure[0] - 2.0 * np.array([0.0, 0.12, -0.1, 0.05])
        assert np.abs(off).max() < 1e-9
        assert fluid.grid.sheets is not None
    force, again = (fluid.force()["ring"].sum(axis=0) for fluid in (first, moved))
    assert again == pytest.approx(force, abs=1e-9)
    assert force[0] > 0.5
    beside = [
        at_point(first, "velocity", (0.953125, 0.9), 0.0)()["x"],
        at_point(moved, "velocity", (0.453125, 0.9), 0.0)()["x"],
    ]
    assert beside[1] == pytest.approx(beside[0], abs=1e-10)
    assert beside[0] > 1e-3


@pytest.mark.parametrize("thickness", [1e-3, pytest.param(0.05, marks=pytest.mark.slow), 0.2])
@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_ring_that_moves_with_the_flow(element, thickness):
    """Nothing disturbs a uniform flow."""
    speed = np.array([0.7, 0.0])
    points, facets = thin_ring(0.5, 0.52, 0.28, thickness)
    ring = body("ring", points, facets, motion=lambda x, t: (x + t * speed, 0.0 * x + speed))
    fluid = make_fluid(
        uniform([0, 0], [1.6, 1.0], [16, 10]), FREE, [ring], element=element, mu=0.05, dt=0.1,
        initial_velocity=field(0.7, 0.0),
    )  # fmt: skip
    for number in range(6):
        step(fluid, 0.1 * number, 0.1)
        nodes = fluid.unknowns.velocity.dofs
        velocity = fluid.flow[nodes][fluid.system.active_dofs[nodes[:, 0]]]
        assert np.abs(velocity - speed).max() < NOTHING[element]
        assert np.abs(fluid.force()["ring"].sum(axis=0)).max() < 1e-9
    assert fluid.renewals > 3


CASE = """\
time: {{step: 0.05, end: 0.1}}
fluid:
  density: 1
  viscosity: 0.05
  element: {element}
  gravity: [1, 0]
  grid: {{from: [0, 0], to: [1.6, 1], cells: [16, 10]}}
  patches:
    period: {{on: [x-, x+], periodic: true}}
    walls: {{on: [y-, y+], no_slip: true}}
  bodies:
    leaf:
      mesh: {{shape: rectangle, size: [0.02, 0.5], cells: [1, 5], origin: [0.61, 0.21], rotate: {{angle: 10}}}}
      motion: {{displacement: ["4*t^2", "0.3*t^2"]}}
probes:
  force: {{quantity: force, body: leaf}}
  before: {{quantity: pressure, at: [0.8, 0.57], minus: [0.1, 0.5]}}
  section: {{quantity: flow_rate, plane: {{point: [1.43, 0.5], normal: [1, 0]}}}}
  energy: {{quantity: kinetic_energy}}
"""
COLUMNS = ("force.x", "force.y", "before", "section", "energy", "fluid.mass")


@pytest.mark.slow
@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_two_processes(tmp_path, element):
    """A leaf that moves in a periodic flow, and runs that go on with other processes."""
    (tmp_path / "case.yaml").write_text(CASE.format(element=element))
    found = []
    for processes in (1, 2):
        out = tmp_path / str(processes)
        done = fsci("run", tmp_path, "-o", out, processes=processes)
        assert done.returncode == 0, done.stdout + done.stderr
        done = fsci("resume", out, "--set", "time.end=0.2", processes=3 - processes)
        assert done.returncode == 0, done.stdout + done.stderr
        found.append(read_history(out / "history.csv"))
    for name in COLUMNS:
        assert np.allclose(found[0][name], found[1][name], rtol=1e-8, atol=1e-10), name
    assert np.abs(found[0]["fluid.mass"]).max() < 1e-12
