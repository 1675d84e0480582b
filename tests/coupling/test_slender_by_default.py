"""A slender body in a flow without numerical settings: second order, resumed bit for bit, on two processes."""

from __future__ import annotations

import numpy as np
import pytest
from programs import fsci
from test_coupled_run import run

from fsci.case import load_case
from fsci.meshes.of_case import read_body
from fsci.running.history import read_history

PLATE = """\
title: a plate of tetrahedra in a channel
time: {step: 0.1, end: 0.2}
fluid:
  density: 1
  viscosity: 0.1
  element: q1q1
  grid: {from: [0, 0, 0], to: [3, 1, 1], cells: [12, 5, 5]}
  patches:
    inlet: {on: x-, velocity: ["16*y*(1-y)*z*(1-z)", 0, 0]}
    outlet: {on: x+, outflow: true}
    walls: {on: [y-, y+, z-, z+], no_slip: true}
structure:
  dynamics: {rho_inf: 0.8}
  bodies:
    plate:
      mesh: {shape: box, size: [0.1, 0.5, 0.6], cells: [1, 3, 4], cell: tet, origin: [1.03, 0.23, 0]}
      material: {law: st_venant_kirchhoff, E: 2000, nu: 0.3, density: 5}
      supports: [{on: bottom, displacement: [0, 0, 0]}]
coupling: {scheme: monolithic}
probes:
  tip: {field: structure, body: plate, quantity: displacement, at: [1.08, 0.23, 0.6]}
output: {fields_every: 0}
solver: {newton: {residual: 1.0e-11}}
"""


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Folder of the case, and its history."""
    folder = tmp_path_factory.mktemp("plate")
    return folder, run(PLATE, folder)


def test_resumed_bit_for_bit(whole, tmp_path):
    """Vertices of tetrahedra, which are mixtures of nodes, follow from the state."""
    folder, expected = whole
    assert read_body(load_case(folder / "case.yaml"), "plate").cell_type == "tetra10"
    found = resumed(folder, tmp_path / "half", processes=1)
    for column in expected.keys() - {"wall", "residual"}:
        assert np.array_equal(expected[column], found[column]), column


@pytest.mark.slow
def test_two_processes(whole, tmp_path):
    folder, expected = whole
    found = resumed(folder, tmp_path / "two", processes=2)
    for column in (name for name in expected if name.startswith("tip.")):
        np.testing.assert_allclose(found[column], expected[column], rtol=0.0, atol=1e-9)


def resumed(folder, out, *, processes):
    """History of a run that ends in the middle and goes on."""
    for words in (["run", folder, "-o", out, "--set", "time.end=0.1"], ["resume", out, "--set", "time.end=0.2"]):
        done = fsci(*words, processes=processes)
        assert done.returncode == 0, done.stdout + done.stderr
    return read_history(out / "history.csv")
