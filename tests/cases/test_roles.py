"""Pairs whose slave is much stiffer and finer than the master: who a case calls the slave changes no result."""

import numpy as np
import pytest
from programs import fsci

from fsci.running.history import read_history


def lame(stiff):
    """Pressure of a ring of radii 1 and 2 in one of radii 2 and 3, plane strain."""
    inner = (1 + 4) / (4 - 1) - 0.3 / 0.7
    outer = (4 + 9) / (9 - 4) + 0.3 / 0.7
    return 0.002 / (2 * 0.91 * (inner / 1e3 + outer / stiff))


FIT = """
time: {step: 1, end: 1}
structure:
  bodies:
    inner:
      mesh: {shape: ring, inner_radius: 1, outer_radius: 2.001, angle: 90, cells: [12, 5], order: 2}
      material: {law: neo_hooke, E: 1000, nu: 0.3}
      supports: &cut [{on: start, symmetry: true}, {on: end, symmetry: true}]
    outer:
      mesh: {shape: ring, inner_radius: 1.999, outer_radius: 3, angle: 90, cells: [CELLS, 5], order: 2}
      material: {law: neo_hooke, E: STIFF, nu: 0.3}
      supports: *cut
contact: {pairs: {fit: {SLAVE: {body: outer, on: inner}, MASTER: {body: inner, on: outer}}}}
probes:
  most: {pair: fit, quantity: pressure}
  least: {pair: fit, quantity: pressure, extreme: least}
output: {fields_every: 0}
"""


def pressed(folder, cells, stiff, *roles):
    """The columns after a step, with the outer ring in the first role."""
    path = folder / f"{roles[0]}.yaml"
    words = dict(zip(("SLAVE", "MASTER"), roles, strict=True)) | {"CELLS": str(cells), "STIFF": str(stiff)}
    text = FIT
    for word, value in words.items():
        text = text.replace(word, value)
    path.write_text(text)
    done = fsci("run", path, "-o", folder / roles[0])
    assert done.returncode == 0, done.stderr
    return read_history(folder / roles[0] / "history.csv")


@pytest.mark.parametrize("cells", [17, 20])
@pytest.mark.parametrize("stiff", [1e5, 1e7])
def test_a_press_fit_into_a_stiff_and_finer_ring(tmp_path, cells, stiff):
    """With the outer ring as the slave the pressure varied from 0 to 2 times its mean in 10 Newton steps for 3."""
    found = [pressed(tmp_path, cells, stiff, *roles) for roles in (("slave", "master"), ("master", "slave"))]
    pressure = lame(stiff)
    for one in found:
        assert one["most"][-1] == pytest.approx(pressure, rel=0.01)
        assert one["least"][-1] == pytest.approx(pressure, rel=0.01)
    assert found[0]["iterations"][-1] == found[1]["iterations"][-1]
    forces = [np.array([one["contact.fit.x"][-1], one["contact.fit.y"][-1]]) for one in found]
    np.testing.assert_allclose(forces[0], -forces[1])  # each on the slave of the case
    assert forces[0] == pytest.approx(np.full(2, 2.0 * pressure), rel=0.01)
