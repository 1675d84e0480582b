"""Fluid closed in by walls and bodies: both schemes find the level of its pressure; a steady flow says why not."""

from __future__ import annotations

import json

import numpy as np
import pytest
from test_coupled_dry_side import COLUMN
from test_coupled_run import run

from coupling.coupled import Coupled
from fsci.case import CaseError, load_case
from fsci.running.run import FAILED, run_case
from solvers.api import FailureKind, StepFailed

#: fluid inside of a ring, and outside of it in an open channel
RING = """\
title: a ring with fluid in it
time: {step: 0.02, end: 0.04}
fluid:
  density: 1
  viscosity: 0.05
  element: q1q1
  scheme: backward_euler
  grid: {from: [0, 0], to: [1, 1], cells: [40, 40]}
  patches:
    ends: {on: [x-, x+], outflow: true}
    walls: {on: [y-, y+], no_slip: true}
structure:
  dynamics: {rho_inf: 0.8}
  bodies:
    ring:
      mesh: {shape: ring, inner_radius: 0.17, outer_radius: 0.33, cells: [24, 2], translate: [0.51, 0.49]}
      material: {law: neo_hooke, E: 500, nu: 0.3, density: 5}
      initial_velocity: [1, 0]
coupling: {scheme: monolithic}
probes:
  centre: {field: structure, body: ring, quantity: centre}
  volume: {field: structure, body: ring, quantity: volume}
  pressure: {field: fluid, quantity: pressure, at: [0.5, 0.5]}
"""
NEXT_LINE = "\n  "
TIGHT = "solver: {newton: {residual: 1e-11}}\n"
OPEN, CLOSED = (f"    top: {{on: y+, {condition}}}\n" for condition in ("traction: [0, 0]", "slip: true"))


def message(text: str, folder) -> str:
    (folder / "case.yaml").write_text(text)
    with pytest.raises(CaseError) as caught:
        run_case(load_case(folder / "case.yaml"), folder / "out")
    return str(caught.value)


def test_walls_all_round_a_steady_flow(tmp_path):
    said = message(COLUMN.replace(OPEN, CLOSED), tmp_path)
    assert "case.yaml:7:11: the boundary encloses the fluid, and a steady flow does not determine its pressure" in said
    assert "take 'bdf2', or give a patch with 'traction', 'pressure', 'outflow', 'resistance' or 'windkessel'" in said


@pytest.mark.parametrize("scheme", ["monolithic", "partitioned"])
def test_a_steady_flow_is_not_repeated_with_half_its_step(scheme, tmp_path, monkeypatch):
    """The size of the step means nothing to it, nor to a body at rest in it."""

    def fail(self, t, dt):
        raise StepFailed("test", FailureKind.NEWTON, "on purpose")

    monkeypatch.setattr(Coupled, "begin_step", fail)
    (tmp_path / "case.yaml").write_text(COLUMN.replace("coupling:", f"coupling:\n  scheme: {scheme}"))
    assert run_case(load_case(tmp_path / "case.yaml"), tmp_path / "out") == FAILED
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["steps"]["retried"] == 0


def test_relaxation_alone(tmp_path):
    said = message(RING.replace("monolithic", "partitioned, accelerator: aitken"), tmp_path)
    expected = "bodies enclose a part of the fluid, and relaxation alone does not find its pressure: take 'iqn'"
    assert f"case.yaml:19:46: {expected}" in said


def test_a_cavity_in_a_body(tmp_path):
    """Both schemes find the same level."""
    monolithic = run(RING + TIGHT, tmp_path / "monolithic")
    partitioned = run(RING.replace("monolithic", "partitioned, tolerance: 1e-9") + TIGHT, tmp_path / "partitioned")
    assert partitioned["iterations"].max() <= 20
    for name in ("centre.x", "volume", "pressure"):
        assert partitioned[name] == pytest.approx(monolithic[name], rel=1e-8)


@pytest.mark.parametrize("coupling", ["monolithic", "partitioned, tolerance: 1e-9"])
@pytest.mark.parametrize("scheme", ["bdf2", "backward_euler"])
def test_the_elastic_body_determines_the_level(scheme, coupling, tmp_path):
    """A column of fluid between a lid and an elastic block without mass, which is pushed up from below.

    Its top has nowhere to go, so that the stretch is 1 - d/0.1 and the pressure on it E/2 (1 - s^2) s, to rounding.
    """
    text = COLUMN.replace(OPEN, CLOSED).replace("scheme: steady", f"scheme: {scheme}")
    text = text.replace("coupling:\n", f"coupling:\n  scheme: {coupling.replace(', ', NEXT_LINE)}\n")
    text = text.replace("structure:\n", "structure:\n  dynamics: {rho_inf: 0}\n").replace(
        "nu: 0}", "nu: 0, density: 1e-9}"
    )
    text = text.replace("on: bottom, displacement: [0, 0]", "on: bottom, displacement: [0, 0.001*t]")
    history = run(text.replace("end: 1}", "end: 4}"), tmp_path)
    stretch = 1 - 0.01 * history["time"]
    on_block = 0.5e5 * (1 - stretch**2) * stretch
    assert np.abs(history["top.y"]).max() < 1e-12
    assert np.abs(history["volume"] - 0.5).max() < 1e-12
    assert history["pressure"] == pytest.approx(on_block - 2000, rel=1e-8)
    assert history["force.y"] == pytest.approx(-on_block, rel=1e-8)
