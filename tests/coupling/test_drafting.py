"""Drafting, kissing and tumbling of two free discs that settle in a channel."""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI

from fsci.builder.build import build
from fsci.case import load_case
from solvers.march import march
from solvers.timing import Timer

#: Scene of Uhlmann, J. Comput. Phys. 209 (2005) 448-476, in cm, g, s: 8 by 24 diameters, the discs a hundredth of a
#: radius beside the middle.
CHANNEL = """\
time: {step: 0.001, end: 0.3}
fluid:
  density: 1
  viscosity: 0.01
  element: q1q1
  gravity: [0, -981]
  grid: {from: [0, 0], to: [2, 6], cells: [32, 96]}
  patches: {walls: {on: [x-, x+, y-, y+], no_slip: true}}
  bodies:
    upper: {mesh: {shape: disc, radius: 0.125, cells: [48, 1], translate: [0.999, 5]}, free: {density: 1.5}}
    lower: {mesh: {shape: disc, radius: 0.125, cells: [48, 1], translate: [1.001, 4.5]}, free: {density: 1.5}}
coupling: {scheme: monolithic}
output: {fields_every: 0}
"""

#: Times [s] of the first touch and of equal heights on this grid; 48 by 144 cells have 0.181 and 0.281 s.
FIRST_TOUCH, EQUAL_HEIGHTS = 0.173, 0.286


@pytest.mark.slow
def test_drafting_kissing_tumbling(tmp_path):
    """The upper disc reaches the lower one in its wake, both turn about each other, and part beside each other."""
    (tmp_path / "case.yaml").write_text(CHANNEL)
    found = build(load_case(tmp_path / "case.yaml"), MPI.COMM_SELF, Timer())
    bodies = found.scheme.coupled.solid
    contact, touched, distances, level, worst = bodies.contact, [], [], np.inf, 0
    for t, info in march(found.scheme, 0.3, 300):
        assert (contact.standoff - contact.near.gap).max(initial=0.0) < 1e-6 * 0.125
        upper, lower = (
            body.inertia.centre + now.shift[:2] for body, now in zip(bodies.bodies, bodies.now, strict=True)
        )
        distances.append(np.linalg.norm(upper - lower))
        if contact.active.any():
            touched.append(t)
        if upper[1] < lower[1]:
            level = min(level, t)
        worst = max(worst, info.iterations)
    assert worst <= 8
    assert touched[0] == pytest.approx(FIRST_TOUCH, rel=0.05)
    assert level == pytest.approx(EQUAL_HEIGHTS, rel=0.05)
    assert touched[-1] < level
    assert distances[49] > 0.495  # drafting has hardly begun
    assert distances[-1] > 1.2 * 0.25
