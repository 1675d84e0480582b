"""Surfaces that enter the box from beyond a face, where no fluid was: it begins with the velocity of the surface."""

import numpy as np
import pytest
from fluid_setup import block, body, field, make_fluid, step
from programs import fsci

from fsci.running.history import read_history
from solvers.fluid.flow.probes import flow_rate
from solvers.fluid.grid.box import uniform
from solvers.fluid.terms.boundary.patches import Patch

H = 0.1


def falls(v):
    """The motion (0, -v) or (0, 0, -v)."""

    def motion(x, t):
        way = np.zeros(x.shape[1])
        way[-1] = -v
        return x + t * way, np.broadcast_to(way, x.shape)

    return motion


@pytest.mark.parametrize("beyond", [0.05, 0.5, 1.0 + 1e-9, 1.37])
@pytest.mark.parametrize(
    ("dim", "element", "scheme", "cells"),
    [
        (2, "q1q1", "backward_euler", 0.3),
        (2, "q1q1", "bdf2", 0.9),
        (2, "q1q1", "backward_euler", 2.3),
        (2, "q2q1", "bdf2", 0.9),
        (3, "q1q1", "backward_euler", 0.9),
    ],
)
def test_all_moves_with_a_piston(dim, element, scheme, cells, beyond):
    """A wide block whose top is some cells beyond the box falls with the fluid around it: u = (0, -v), p = 0."""
    v, dt = 0.7, cells * H / 0.7
    up, wide = dim - 1, 1.0 if dim == 2 else 0.3
    low, high = np.full(dim, -0.1), np.full(dim, wide + 0.1)
    low[up], high[up] = 0.54, 1.0 + beyond * H
    top = np.full(dim, wide)
    top[up] = 1.0
    names = ["x-", "x+", "y-", "y+", "z-", "z+"][: 2 * dim]
    u = field(*(0.0,) * up, -v)
    fluid = make_fluid(
        uniform(np.zeros(dim), top, [round(length / H) for length in top]),
        [
            Patch("sides", tuple(names[:-2]), "slip"),
            Patch("below", (names[-2],), "traction", field(*(0.0,) * dim)),
            Patch("above", (names[-1],), "traction", field(*(0.0,) * dim)),
        ],
        [body("piston", *block(low, high), motion=falls(v))],
        element=element, scheme=scheme, dt=dt, initial_velocity=u,
    )  # fmt: skip
    steps = 1 + int(np.ceil((beyond + 0.5) / cells))
    for number in range(steps):
        step(fluid, number * dt, dt)
    dofs = fluid.unknowns.velocity.dofs
    velocity = fluid.flow[dofs[fluid.system.active_dofs[dofs].all(axis=1)]]
    assert fluid.cut.motion.x[:, up].max() < 1.0  # it has entered
    assert np.abs(velocity[:, up] + v).max() < 1e-8
    assert np.abs(velocity[:, :up]).max() < 1e-8
    assert flow_rate(fluid)(["below"]) == pytest.approx(v * wide**up, abs=1e-8)


GATE = """\
time: {{step: 0.05, end: 0.4}}
fluid:
  density: 1
  viscosity: 0.1
  element: q1q1
  scheme: backward_euler
  grid: {{from: [0, 0], to: [3, 1], cells: [30, 10]}}
  patches:
    in: {{on: x-, pressure: 1}}
    out: {{on: x+, outflow: true}}
    walls: {{on: [y-, y+], no_slip: true}}
  bodies:
    gate: {{mesh: {{shape: rectangle, size: [0.5, 0.97], cells: [5, 9], origin: [{x}, 0.2]}}, {how}}}
{coupling}
probes: {{volume: {{quantity: volume}}, inlet: {{quantity: flow_rate, through: in}},
  outlet: {{quantity: flow_rate, through: out}}}}
output: {{fields_every: 0}}
"""
GIVEN = 'motion: {displacement: [0, "-0.317*ramp(t, 0, 0.4)"]}'
FREE = "free: {density: 20, gravity: [0, -8], held: [x, rotation]}"


@pytest.mark.parametrize(
    ("how", "x"),
    [
        (GIVEN, 1.233),
        (FREE, 1.2),
        pytest.param(GIVEN, 1.2, marks=pytest.mark.slow),
        pytest.param(FREE, 1.233, marks=pytest.mark.slow),
    ],
)
def test_a_gate_that_closes_below_opens_above(how, x, tmp_path):
    """Fluid begins above it, and nothing is lost; the volume of the fluid is that beside and above the gate."""
    coupling = "coupling: {scheme: monolithic}" if how == FREE else ""
    (tmp_path / "case.yaml").write_text(GATE.format(how=how, x=x, coupling=coupling))
    done = fsci("run", tmp_path, "-o", tmp_path / "out")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "fluid appears" not in done.stdout
    history = read_history(tmp_path / "out" / "history.csv")
    assert history["fluid.mass"] == pytest.approx(0.0, abs=1e-8)
    low = {GIVEN: 0.2 - 0.317, FREE: 0.0}[how]  # the free one lies on the floor
    assert history["volume"][-1] == pytest.approx(3.0 - 0.5 * (0.97 + min(low, 0.0)), abs=1e-6)
