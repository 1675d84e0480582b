"""The force of a fluid on a face of the box, which a body covers in part: a linear velocity has one stress."""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI

from fsci.builder.build import build
from fsci.case import load_case
from solvers.fluid.flow.probes import force_on_patch
from solvers.timing import Timer

#: The block covers 0.24 of the floor, and ends within cells.
PLANE = """\
time: {step: 0.1, end: 0.1}
fluid:
  density: 1
  viscosity: 0.7
  element: ELEMENT
  initial_velocity: ["2*x + 3*y", "4*x - 2*y"]
  grid: {from: [0, 0], to: [1.2, 0.8], cells: [8, 5]}
  patches: {rest: {on: [x-, x+, y+], outflow: true}, floor: {on: y-, no_slip: true}}
  bodies: {block: {mesh: {shape: rectangle, size: [0.24, 0.4], cells: [1, 1], origin: [0.41, -0.2]}}}
"""
SPACE = (
    PLANE.replace('["2*x + 3*y", "4*x - 2*y"]', '["2*x + 3*z", "0", "4*x - 2*z"]')
    .replace("[0, 0], to: [1.2, 0.8], cells: [8, 5]", "[0, 0, 0], to: [1.2, 0.9, 0.8], cells: [5, 4, 4]")
    .replace("[x-, x+, y+]", "[x-, x+, y-, y+, z+]")
    .replace("on: y-,", "on: z-,")
    .replace("shape: rectangle, size: [0.24, 0.4], cells: [1, 1], origin: [0.41, -0.2]",
             "shape: box, size: [0.24, 0.31, 0.4], cells: [1, 1, 1], origin: [0.41, 0.3, -0.2]")
)  # fmt: skip


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
@pytest.mark.parametrize(("text", "wet"), [(PLANE, 1.2 - 0.24), (SPACE, 1.2 * 0.9 - 0.24 * 0.31)], ids=["2d", "3d"])
def test_the_force_on_a_floor_is_that_of_its_wet_part(tmp_path, text, wet, element):
    (tmp_path / "case.yaml").write_text(text.replace("ELEMENT", element))
    fluid = build(load_case(tmp_path / "case.yaml"), MPI.COMM_SELF, Timer()).scheme
    fluid.initialise(0.0, 0.1)
    u = fluid.unknowns.velocity
    x = u.points
    fluid.flow[u.dofs[:, 0]] = 2.0 * x[:, 0] + 3.0 * x[:, fluid.dim - 1]
    fluid.flow[u.dofs[:, -1]] = 4.0 * x[:, 0] - 2.0 * x[:, fluid.dim - 1]
    fluid.flow[fluid.unknowns.pressure.dofs[:, 0]] = 1.5
    found = np.array(list(force_on_patch(fluid, "floor")().values()))
    expected = np.zeros(fluid.dim)
    expected[0], expected[-1] = 0.7 * (3.0 + 4.0) * wet, (-1.5 - 2.0 * 0.7 * 2.0) * wet
    assert found == pytest.approx(expected, rel=1e-10, abs=1e-12)
