"""A rigid sphere falls as an elastic one that is stiff: same mass, same velocity."""

from __future__ import annotations

import pytest
from programs import fsci

from fsci.running.history import read_history

COARSE = [
    *(f"fluid.grid.{a}=[{{to: 0.012, cells: 4}}, {{to: 0.05, cells: 5, ratio: 4}}]" for a in "xy"),
    "fluid.grid.z=[{to: 0.065, cells: 6, ratio: 0.25}, {to: 0.1425, cells: 26}, {to: 0.16, cells: 4, ratio: 2.5}]",
    "time.end=0.3",
    "verify=[]",
]


@pytest.mark.slow
def test_rigid_and_elastic(tmp_path):
    """The mass of the elastic one counts the curved cells: the rigid one gets a density that makes up for it."""

    def run(name: str, *changes: str):
        words = [word for change in (*COARSE, *changes) for word in ("--set", change)]
        done = fsci("run", f"cases/{name}", "-o", tmp_path / f"{name}{len(changes)}", *words, timeout=2400)
        assert done.returncode == 0, done.stdout[-2000:]
        return read_history(tmp_path / f"{name}{len(changes)}" / "history.csv")

    elastic = run("falling_sphere")
    density = 1120.0 * elastic["mass"][0] / 0.00049123539802
    rigid = run("falling_rigid_sphere", f"fluid.bodies.sphere.free.density={density!r}")
    assert rigid["mass"] == pytest.approx(elastic["mass"], rel=1e-6)
    late = elastic["time"] > 0.19
    # their first steps are divided into different parts, which leaves 0.26 %
    assert rigid["sphere.z"][late] == pytest.approx(elastic["sphere.z"][late], rel=4e-3)
    assert rigid["interface.force"].max() < 0.01
    assert rigid["iterations"].sum() <= elastic["iterations"].sum()
