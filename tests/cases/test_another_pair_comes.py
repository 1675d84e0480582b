"""A block lies on a floor with friction near its limit, and a ram comes near: a pair that begins disturbs no other."""

import numpy as np
from programs import fsci

from fsci.running.history import read_history

CASE = """\
time: {step: 0.01, end: 0.3}
structure:
  dynamics: {rho_inf: 0.5}
  bodies:
    slab:
      mesh: {shape: rectangle, size: [1.6, 0.2], cells: [10, 2]}
      material: {law: neo_hooke, E: 2e4, nu: 0.3, density: 50}
      gravity: [2.5, -10]
contact:
  friction: {coefficient: 0.3}
  obstacles:
    floor: {mesh: {shape: rectangle, size: [4, 0.5], cells: [1, 1], translate: [-1, -0.5]}, on: top}
    ram:
      mesh: {shape: rectangle, size: [0.2, 0.5], cells: [1, 1], translate: [1.7, 0.02]}
      motion: {displacement: ["-0.4*t", 0]}
      on: left
  pairs:
    floor: {slave: {body: slab, on: bottom}, master: {obstacle: floor}}
    ram: {slave: {body: slab, on: right}, master: {obstacle: ram}}
output: {fields_every: 0}
"""


def test_no_step_is_repeated_as_the_ram_comes_near(tmp_path):
    """Nodes of the floor that slip cannot balance their friction while they are held."""
    (tmp_path / "case.yaml").write_text(CASE)
    done = fsci("run", tmp_path / "case.yaml", "-o", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert "warning" not in done.stdout + done.stderr
    found = read_history(tmp_path / "out" / "history.csv")
    np.testing.assert_allclose(found["dt"], 0.01, rtol=1e-12)
    assert found["contact.ram.x"][-1] < -100.0
    across, up = found["contact.floor.x"], found["contact.floor.y"]
    assert (np.abs(across) <= (0.3 + 1e-6) * up).all()
