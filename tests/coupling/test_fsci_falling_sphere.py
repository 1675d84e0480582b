"""A sphere that settles in a tank: its largest velocity as measured by ten Cate et al., Phys. Fluids 14 (2002) 4012."""

from __future__ import annotations

import pytest
from programs import fsci

from fsci.run.history import read_history

#: changes of the case for the second fluid
REYNOLDS_12 = (
    "fluid.density=962",
    "fluid.viscosity=0.113",
    "structure.bodies.sphere.gravity=[0, 0, -9.81*(1120 - 962)/1120]",
    "time.step=0.04",
    "time.end=1",
    "verify=[]",
)


@pytest.mark.slow
@pytest.mark.parametrize(("changes", "measured"), [((), 0.953 * 0.060), (REYNOLDS_12, 0.959 * 0.091)], ids=["4", "12"])
def test_largest_velocity(changes, measured, tmp_path):
    """Within 3 %."""
    settings = [word for change in changes for word in ("--set", change)]
    run = fsci("run", "cases/falling_sphere", "-o", tmp_path, *settings, processes=2, timeout=2400)
    assert run.returncode == 0, run.stdout[-2000:]
    history = read_history(tmp_path / "history.csv")
    late = history["time"] > 0.4
    assert -history["sphere.z"][late].min() == pytest.approx(measured, rel=0.03)
    assert history["interface.force"].max() < 0.01
