"""A sphere that settles in a tank: its largest velocity as measured by ten Cate et al., Phys. Fluids 14 (2002) 4012."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from programs import run_whole
from test_coupled_run import run

from fsci.running.history import read_history

#: changes of the case for the second fluid
REYNOLDS_12 = (
    "fluid.density=962",
    "fluid.viscosity=0.113",
    "structure.bodies.sphere.gravity=[0, 0, -9.81*(1120 - 962)/1120]",
    "time.step=0.04",
    "time.end=1",
    "verify=[{value: sphere.z, statistic: min, from: 0.4, reference: -0.08727, relative: 0.03}]",
)


@pytest.mark.slow
@pytest.mark.parametrize("changes", [(), REYNOLDS_12], ids=["4", "12"])
def test_largest_velocity(changes, tmp_path):
    """Within 3 %: 0.953 of 0.060 m/s, 0.959 of 0.091 m/s."""
    run_whole("falling_sphere", tmp_path, *changes, processes=2, timeout=2400)
    assert read_history(tmp_path / "history.csv")["interface.force"].max() < 0.01


#: The sphere at rest in the middle of the tank, at Re 1.5. Walls move at 0.895 of the velocity in an infinite fluid.
HELD = """
time: {step: 1, end: 1}
fluid:
  density: 970
  viscosity: 0.373
  element: q2q1
  scheme: steady
  grid:
    from: [0, 0, 0]
    to: [0.05, 0.05, 0.16]
    x: [{to: 0.025, cells: 4}, {to: 0.05, cells: 2, ratio: 1.6}]
    y: [{to: 0.025, cells: 4}, {to: 0.05, cells: 2, ratio: 1.6}]
    cells: [null, null, 26]
    refine: [{around: sphere, layers: 3, level: 1}]
  patches:
    symmetry: {on: [x-, y-], symmetry: true}
    walls: {on: [x+, y+, z-, z+], velocity: [0, 0, 0.034]}
  bodies:
    sphere:
      mesh: {file: quarter_sphere.geo, parameters: {size: 0.0011}, order: 2, translate: [0, 0, 0.0625]}
probes:
  force: {field: fluid, body: sphere, quantity: force}
"""
#: Drag over the weight in the liquid on 8 x 8 x 26 cells with as many around the sphere (66,453 unknowns). `q1q1` on
#: finer and finer cells has 1.035, 0.995, 0.987.
FINER = 0.9790


@pytest.mark.slow
def test_drag_at_low_reynolds_number_does_not_depend_on_the_grid(tmp_path):
    """Five cells of q2q1 across the sphere are enough; 0.03 % off."""
    shutil.copy(Path(__file__).parents[2] / "cases" / "falling_sphere" / "quarter_sphere.geo", tmp_path)
    drag = run(HELD, tmp_path)["force.z"][-1]
    assert drag / (9.81 * (1120 - 970) * 1.76715e-6 / 4) == pytest.approx(FINER, rel=2e-3)
