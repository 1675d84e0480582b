"""Friction in a flow: a torus comes down to the wall of torus_wall obliquely, heavier than there, on a coarse grid."""

import numpy as np
import pytest
from programs import fsci

from fsci.running.history import read_history

OBLIQUE = {
    "fluid.grid.cells": "[8, 8, 13]",
    "structure.bodies.torus.mesh.cells": "[16, 8]",
    "structure.bodies.torus.mesh.translate": "[-0.1, 0, -0.54]",
    "structure.bodies.torus.material.density": "20",
    "structure.bodies.torus.initial_velocity": "[4, 0, -2]",
    "contact.pairs.wall.friction": "{coefficient: 0.3}",
    "time": "{step: 0.005, end: 0.06}",
    "probes.mean": "{pair: wall, quantity: mean_gap}",
    "output.fields_every": "0",
    "solver.newton.residual": "1e-8",
    "verify": "[]",
}


@pytest.mark.slow
def test_a_torus_slides_on_the_wall(tmp_path):
    """Friction pulls back by about mu times the pressure, and only takes energy; all balances hold."""
    changes = [word for key, value in OBLIQUE.items() for word in ("--set", f"{key}={value}")]
    done = fsci("run", "cases/torus_wall", "-o", tmp_path, *changes, timeout=900)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    found = read_history(tmp_path / "history.csv")
    along, across = found["contact.wall.x"], found["contact.wall.z"]
    slipping = (across > 0.1 * across.max()) & (found["contact.sticking"] == 0)
    assert slipping.sum() >= 5
    ratio = -along[slipping] / across[slipping]  # the coarse torus has normals that lean by up to a few degrees
    assert ratio.min() > 0.2
    assert ratio.max() < 0.45
    assert found["contact.friction"][-1] > 0
    assert np.diff(found["contact.friction"]).min() > -1e-6 * found["contact.friction"][-1]
    assert found["interface.force"].max() < 1e-5
    assert np.abs(found["interface.momentum"]).max() < 1e-3
    assert np.abs(found["fluid.mass"]).max() < 1e-5
    assert np.nanmin(found["mean"]) > -1e-10
