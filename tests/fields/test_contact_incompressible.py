"""Contact of nearly incompressible bodies: the bulk modulus does not stiffen a surface, which escapes sideways."""

import json

import numpy as np
import pytest
from programs import fsci
from structure_setup import block

from fsci.running.history import read_history
from solvers.structure.body import Body
from solvers.structure.materials import NeoHooke
from solvers.structure.tangent import of_surfaces

#: A seal between a lid that comes down and a floor; it touches a wall that presses only when a pressure comes, in mm.
SEAL = """\
title: a seal in a groove
units: {{length: mm, mass: t, time: s}}
time: {{step: 0.25, end: 2}}
structure:
  bodies:
    seal:
      mesh: {{shape: rectangle, size: [4, 3], cells: {cells}, order: {order}}}
      material: {{law: mooney_rivlin, c10: 0.4, c01: 0.1, bulk: {bulk}}}
      element: {element}
      pressures: [{{on: left, value: "2*max(t-1,0)"}}]
contact:
  obstacles:
    floor: {{mesh: {{shape: rectangle, size: [10, 1], cells: [1, 1], origin: [-3, -1]}}, on: top}}
    wall: {{mesh: {{shape: rectangle, size: [1, 6], cells: [1, 1], origin: [4, -1]}}, on: left}}
    lid: {{mesh: {{shape: rectangle, size: [10, 1], cells: [1, 1], origin: [-3, 3]}}, on: bottom, motion: [0, "-0.3*min(t,1)"]}}
  pairs:
    floor: {{slave: {{body: seal, on: bottom}}, master: {{obstacle: floor}}}}
    lid: {{slave: {{body: seal, on: top}}, master: {{obstacle: lid}}}}
    wall: {{slave: {{body: seal, on: right}}, master: {{obstacle: wall}}}}
output: {{fields_every: 0}}
"""  # noqa: E501


@pytest.mark.parametrize(
    ("cells", "order", "bulk", "element"),
    [
        pytest.param("[8, 6]", 2, 2000, "mixed", marks=pytest.mark.slow),
        ("[7, 5]", 1, 200000, "mixed"),
        ("[8, 6]", 2, 2000, "displacement"),
    ],
)
def test_a_seal_repeats_no_step(tmp_path, cells, order, bulk, element):
    """The wall carries the pressure on the other side, 2 MPa on 2.7 mm, and each step takes a few Newton steps."""
    case = tmp_path / "case.yaml"
    case.write_text(SEAL.format(cells=cells, order=order, bulk=bulk, element=element))
    done = fsci("run", case, "-o", tmp_path / "out")
    assert done.returncode == 0, done.stdout + done.stderr
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["warnings"] == []
    assert summary["steps"] == {"accepted": 8, "retried": 0}
    history = read_history(tmp_path / "out" / "history.csv")
    assert max(history["iterations"]) <= 4
    np.testing.assert_allclose(history["contact.wall.x"][-1], -2.0 * 2.7, rtol=1e-9)


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.4999])
@pytest.mark.parametrize(
    ("cell_type", "element"),
    [("quad", "displacement"), ("quad9", "mixed"), pytest.param("tetra", "mixed", marks=pytest.mark.slow)],
)
def test_modulus_of_surfaces(cell_type, element, nu):
    """E* / M = (1 - 2 nu) / (1 - nu)^2, wherever the body is."""
    mu, lmbda = 1.0 / (2 * (1 + nu)), nu / ((1 + nu) * (1 - 2 * nu))
    mesh = block(cell_type, 3)
    body = Body("body", mesh, NeoHooke(mu, lmbda, 1.0), element=element)
    body.set_displacement(np.zeros(mesh.points.size))
    matrix = body.create_tangent()
    body.assemble_tangent(matrix, 0.0)
    np.testing.assert_allclose(of_surfaces(matrix, body), (1 - 2 * nu) / (1 - nu) ** 2, rtol=1e-9)
