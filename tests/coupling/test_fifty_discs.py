"""Fifty free discs fall on each other in a fluid, with friction."""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI

from fsci.builder.build import build
from fsci.builder.rigid_contact import STANDOFF
from fsci.case import load_case
from solvers.march import march
from solvers.rigid import motion
from solvers.timing import Timer

RADIUS = 0.045
HEAD = """\
time: {step: 0.005, end: 2}
fluid:
  density: 1
  viscosity: 0.005
  element: q1q1
  gravity: [0, -10]
  scheme: backward_euler
  grid: {from: [0, 0], to: [1, 1.4], cells: [30, 42]}
  patches: {walls: {on: [x-, x+, y-], no_slip: true}, top: {on: y+, outflow: true}}
  bodies:
"""
TAIL = """\
contact: {friction: {coefficient: 0.3}}
coupling: {scheme: monolithic}
output: {fields_every: 0}
"""


def simulation(folder, order, step=0.005):
    """The discs in a box, named in this order in the case: ten rows of five, a little beside their places."""
    rng = np.random.default_rng(1)
    lines = []
    for k in range(50):
        across, up = k % 5, k // 5
        x, y = np.array([0.12 + 0.19 * across + 0.02 * (up % 2), 0.06 + 0.115 * up]) + 0.01 * rng.uniform(-1, 1, 2)
        mesh = f"{{shape: disc, radius: {RADIUS}, cells: [16, 1], translate: [{x:.5f}, {y:.5f}]}}"
        lines.append(f"    d{k}: {{mesh: {mesh}, free: {{density: 20}}}}\n")
    head = HEAD.replace("step: 0.005", f"step: {step}")
    (folder / "case.yaml").write_text(head + "".join(lines[k] for k in order) + TAIL)
    return build(load_case(folder / "case.yaml"), MPI.COMM_SELF, Timer())


def overlap(bodies):
    """How far [m] contact is below the gap that it leaves open, at most, at the end of a step."""
    return float((bodies.contact.standoff - bodies.contact.near.gap).max(initial=0.0))


@pytest.mark.slow
@pytest.mark.parametrize("step", [0.005, 0.01])
def test_fifty_discs_fall_on_each_other(tmp_path, step):
    """No overlap, few iterations, momentum."""
    found = simulation(tmp_path, range(50), step)
    bodies = found.scheme.coupled.solid
    assert bodies.contact.standoff == pytest.approx(STANDOFF / 30.0)
    touched, momentum = 0, 0.0
    for _, info in march(found.scheme, 0.3, round(0.3 / step)):
        assert overlap(bodies) < 1e-6 * RADIUS
        assert info.iterations <= 8
        momentum = max(momentum, info.numbers["interface.momentum"])
        touched = max(touched, int(bodies.contact.active.sum()))
    weight = sum(10.0 * body.inertia.mass for body in bodies.bodies)
    assert momentum < 1e-6 * weight
    assert touched >= 20


@pytest.mark.slow
def test_fifty_discs_come_to_rest(tmp_path):
    """They brace each other: 89 vertices touch, with friction. At rest contact carries their weight less buoyancy."""
    found = simulation(tmp_path, range(50), 0.01)
    bodies = found.scheme.coupled.solid
    for _, info in march(found.scheme, 1.65, 165):
        assert overlap(bodies) < 1e-6 * RADIUS
        assert info.iterations <= 8
    pairs = list(zip(bodies.bodies, bodies.now, strict=True))
    fallen = -sum(10.0 * body.inertia.mass * now.shift[1] for body, now in pairs)
    assert sum(motion.kinetic_energy(body, now) for body, now in pairs) < 1e-12 * fallen
    immersed = 10.0 * (1.0 - 1.0 / 20.0) * sum(body.inertia.mass for body in bodies.bodies)
    up = sum(info.numbers[f"contact.on_d{k}.y"] for k in range(50))
    assert up == pytest.approx(immersed, rel=1e-4)  # the fluid still moves
    assert up + bodies.on_surface[:, 1].sum() == pytest.approx(immersed / 0.95, rel=1e-9)


@pytest.mark.slow
def test_the_order_of_fifty_discs_does_not_matter(tmp_path):
    """Until after the first impacts; later every difference grows."""
    ends = []
    for order in (np.arange(50), np.random.default_rng(5).permutation(50)):
        found = simulation(tmp_path, order)
        for _ in march(found.scheme, 0.1, 10):
            pass
        bodies = found.scheme.coupled.solid
        assert bodies.in_contact()
        ends.append({body.name: now.shift for body, now in zip(bodies.bodies, bodies.now, strict=True)})
    for name, shift in ends[0].items():
        assert ends[1][name] == pytest.approx(shift, abs=1e-9), name
