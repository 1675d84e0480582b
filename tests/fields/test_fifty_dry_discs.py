"""Fifty free discs fall on each other in a box without a fluid, with friction, and come to rest."""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI

from fsci.builder.build import build
from fsci.case import load_case
from solvers.march import march
from solvers.rigid import motion
from solvers.timing import Timer

RADIUS = 0.045
CASE = """\
time: {step: 0.005, end: 1.2}
rigid:
  gravity: [0, -10]
  bodies:
DISCS
contact:
  friction: {coefficient: 0.3}
  obstacles:
    floor: {mesh: {shape: rectangle, size: [1.4, 0.2], cells: [1, 1], translate: [-0.2, -0.2]}}
    left: {mesh: {shape: rectangle, size: [0.2, 3], cells: [1, 1], translate: [-0.2, 0]}}
    right: {mesh: {shape: rectangle, size: [0.2, 3], cells: [1, 1], translate: [1, 0]}}
output: {fields_every: 0}
"""


@pytest.mark.slow
def test_fifty_dry_discs_come_to_rest(tmp_path):
    """No overlap, no step that fails, and at the end no motion: 16 sides do not roll for ever."""
    rng, lines = np.random.default_rng(1), []
    for k in range(50):
        across, up = k % 5, k // 5
        x, y = np.array([0.12 + 0.19 * across + 0.02 * (up % 2), 0.06 + 0.115 * up]) + 0.01 * rng.uniform(-1, 1, 2)
        mesh = f"{{shape: disc, radius: {RADIUS}, cells: [16, 1], translate: [{x:.5f}, {y:.5f}]}}"
        lines.append(f"    d{k}: {{mesh: {mesh}, density: 20}}")
    (tmp_path / "case.yaml").write_text(CASE.replace("DISCS", "\n".join(lines)))
    field = build(load_case(tmp_path / "case.yaml"), MPI.COMM_SELF, Timer()).scheme
    iterations = []
    for _, info in march(field, 1.2, 240):
        iterations.append(info.iterations)
        assert -field.contact.near.gap.min(initial=0.0) < 1e-6 * RADIUS
    pairs = list(zip(field.bodies, field.now, strict=True))
    kinetic = sum(motion.kinetic_energy(body, now) for body, now in pairs)
    fallen = -sum(10.0 * body.inertia.mass * now.shift[1] for body, now in pairs)
    assert kinetic < 1e-6 * fallen
    assert max(iterations) <= 20
    assert np.mean(iterations) < 4.0
    up = sum(info.numbers[f"contact.on_d{k}.y"] for k in range(50))
    assert up == pytest.approx(10.0 * sum(body.inertia.mass for body in field.bodies), rel=1e-9)
