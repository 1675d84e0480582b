"""A sphere that settles in a tank: its largest velocity as measured by ten Cate et al., Phys. Fluids 14 (2002) 4012."""

from __future__ import annotations

import pytest
from programs import run_whole

from fsci.run.history import read_history

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
