"""Contact in motion and impact, through the program: momentum, energy, forces without zigzag."""

from __future__ import annotations

import json

import numpy as np
import pytest
from contact_cases import BEFORE, COLLISION, PLATE, run

from solvers.structure.elastic_constants import lame


@pytest.mark.parametrize(
    ("step", "end"), [("0.02", "1.0"), pytest.param("0.005", "1.0", marks=pytest.mark.slow), ("0.00125", "0.15")]
)
def test_contact_gives_no_energy(step, end, tmp_path):
    """Without damping; impact may take some (10.2 % with the large step, 1.1 % with the others).

    At t = 0.085 the corner of the left block slides onto the right one, into which it is bent by then: pushed out in
    one small step, it would give 25 %, pushed out as its area grows, 0.7 %.
    """
    history = run(COLLISION, tmp_path / "run", ("time.step", step), ("time.end", end))
    assert history["energy.total"].max() < (1 + 1e-9) * BEFORE
    assert history["energy.total"][-1] > (0.895 if step == "0.02" else 0.985) * BEFORE
    assert history["contact.active"].max() == 5


#: A soft block is pressed onto another one and dragged along, slowly.
DRAG = """\
title: press and drag
time: {step: 0.02, end: 1.6}
structure:
  dynamics: {rho_inf: 1}
  bodies:
    base:
      mesh: {shape: rectangle, size: [4, 1], cells: [12, 3], order: 1, origin: [0, -1]}
      material: {law: neo_hooke, E: 500, nu: 0.3, density: 0.1}
      supports: [{on: bottom, displacement: [0, 0]}]
    block:
      mesh: {shape: rectangle, size: [1, 1], cells: [4, 4], order: 1, origin: [0.5, 0.001]}
      material: {law: neo_hooke, E: 500, nu: 0.3, density: 0.1}
      supports: [{on: top, displacement: ["0.75*max(t - 1, 0)^2", "-0.3*min(t, 1)^2*(3 - 2*min(t, 1))"]}]
contact:
  pairs: {p: {slave: {body: block, on: bottom}, master: {body: base, on: top}}}
probes: {energy: {quantity: energy}}
"""


def test_slow_pressing_and_dragging(tmp_path):
    """Undamped: no energy from nothing, and a force without zigzag; with the mean of old and new force 5 N."""
    history = run(DRAG, tmp_path / "run")
    steps = json.loads((tmp_path / "run" / "out" / "summary.json").read_text())["steps"]
    stored, force = history["energy.internal"].max(), history["contact.p.y"]
    assert steps["retried"] == 0
    assert np.abs(history["structure.energy"]).max() < 0.01 * stored
    zigzag = np.abs(force[2:] - 2 * force[1:-1] + force[:-2]) / 4
    assert zigzag[force[1:-1] > 1.0].max() < 0.005 * force.max()
    assert history["contact.active"][-1] == 5
    assert force[history["time"] > 1.0] == pytest.approx(122.0, rel=0.015)


def test_momentum_of_a_damped_collision(tmp_path):
    history = run(COLLISION, tmp_path / "damped", ("structure.dynamics.rho_inf", "0.5"))
    assert np.abs(history["momentum.x"] - 1.0).max() < 1e-9
    assert np.abs(history["momentum.y"] - 0.5).max() < 1e-9


def test_a_small_overlap_at_the_start(tmp_path):
    """Two bars without lateral contraction that begin 2e-3 too long: each is shortened by half of it."""
    overlap, E = 2e-3, 1000.0
    law = f"material: {{law: st_venant_kirchhoff, E: {E}, nu: 0}}"
    history = run(
        f"""\
title: two bars
time: {{step: 1, end: 1}}
structure:
  bodies:
    left:
      mesh: {{shape: rectangle, size: [1, 1], cells: [2, 3]}}
      {law}
      supports: [{{on: left, symmetry: true}}, {{on: bottom, symmetry: true}}]
    right:
      mesh: {{shape: rectangle, size: [1, 1], cells: [2, 2], translate: [{1 - overlap}, 0]}}
      {law}
      supports: [{{on: right, symmetry: true}}, {{on: bottom, symmetry: true}}]
contact:
  pairs:
    joint: {{slave: {{body: left, on: right}}, master: {{body: right, on: left}}}}
probes:
  middle: {{body: left, quantity: displacement, on: right}}
solver: {{newton: {{residual: 1.0e-12}}}}
""",
        tmp_path / "bars",
    )
    stretch = 1 - overlap / 2
    assert history["middle.x"][0] == pytest.approx(-overlap / 2, rel=1e-10)
    assert history["contact.joint.x"][0] == pytest.approx(E * 0.5 * (stretch**2 - 1) * stretch, rel=1e-9)


def test_impact_in_one_step(tmp_path):
    """A block that would fly half its size into the plate within the first step."""
    history = run(
        """\
title: a block hits a wall
time: {step: 0.1, end: 0.5}
structure:
  dynamics: {rho_inf: 0.8}
  bodies:
    block:
      mesh: {shape: box, size: [1, 1, 1], cells: [2, 2, 3], order: 1}
      material: {law: neo_hooke, E: 2000, nu: 0.3, density: 1.0}
      initial_velocity: [0, 0, -5]
contact:
  obstacles:
    wall: {mesh: {shape: box, size: [3, 3, 1], cells: [1, 1, 1], translate: [-1, -1, -1.02]}, on: top}
  pairs:
    hit: {slave: {body: block, on: bottom}, master: {obstacle: wall}}
probes:
  foot: {quantity: displacement, on: bottom}
  energy: {quantity: energy}
""",
        tmp_path / "hit",
        ("time.retry.halvings", "0"),
    )
    assert history["contact.active"][0] == 9
    assert history["foot.z"].min() > -0.02 - 1e-9
    assert history["foot.z"][-1] > 0.02  # and off it flies
    assert history["iterations"].max() <= 8


def test_uniform_pressure_is_that_of_the_column(tmp_path):
    """A plate on a block whose sides are held: the pressure of uniaxial strain, in a field of the results."""
    import meshio

    sides = "[{on: bottom, symmetry: true}, {on: left, symmetry: true}, {on: right, symmetry: true}, "
    sides += "{on: front, symmetry: true}, {on: back, symmetry: true}]"
    text = PLATE.replace("[{on: bottom, displacement: [0, 0, 0]}]", sides)
    history = run(text, tmp_path / "column", ("time.end", "0.25"))
    stretch = 1 - 0.19
    mu, lmbda = lame(1000, 0.3)
    pressure = -(mu * (stretch**2 - 1) + lmbda * np.log(stretch)) / stretch
    assert history["contact.press.z"][-1] == pytest.approx(-pressure, rel=1e-9)
    mesh = meshio.read(tmp_path / "column" / "out" / "fields" / "block_000002.vtu")
    top = mesh.points[:, 2] > stretch - 1e-6
    assert top.sum() == 16
    assert mesh.point_data["contact_pressure"][top] == pytest.approx(pressure, rel=1e-9)
    assert mesh.point_data["contact_traction"][top, 2] == pytest.approx(-pressure, rel=1e-9)


# --------------------------------------------------------------------------------------------------- mistakes in a case
