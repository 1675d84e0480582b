"""Traction and wall shear stress on bodies: they give the forces of probes, and Couette's shear stress."""

from collections import Counter

import numpy as np
import pytest

import fsci
from solvers.api import Snapshot
from solvers.fluid.flow.field import Fluid

#: A channel flow around an elastic block on the floor, and a rigid disc above it.
BODIES = """
time: {step: 0.05, end: 0.1}
structure:
  bodies:
    block:
      mesh: {shape: rectangle, size: [0.3, 0.35], cells: [3, 4], order: 1, origin: [0.8, 0]}
      material: {law: neo_hooke, E: 50, nu: 0.3, density: 2}
      supports: [{on: bottom, displacement: [0, 0]}]
  dynamics: {rho_inf: 0.8}
fluid:
  density: 1
  viscosity: 0.1
  element: q1q1
  grid: {from: [0, 0], to: [2, 1], cells: [30, 16]}
  patches:
    inlet: {on: x-, velocity: ["4*y*(1-y)", 0]}
    walls: {on: [y-, y+], no_slip: true}
    outlet: {on: x+, outflow: true}
  bodies:
    disc: {mesh: {shape: disc, radius: 0.12, cells: [24, 2], translate: [0.5, 0.7]}}
coupling: {scheme: monolithic}
probes:
  load: {body: block, quantity: force}
  drag: {body: disc, quantity: force}
"""

#: A wall that moves with 1 m/s at a distance of 0.65 m from a body that fills the lower part of the box.
COUETTE = """
time: {step: 1, end: 1}
fluid:
  density: 1
  viscosity: 0.4
  element: q1q1
  flow: stokes
  scheme: steady
  grid: {from: [0, 0], to: [1, 1], cells: [6, 7]}
  patches:
    lid: {on: y+, velocity: [1, 0]}
    sides: {on: [x-, x+], velocity: ["(y - 0.35)/0.65", 0]}
    below: {on: y-, no_slip: true}
  bodies:
    floor: {mesh: {shape: rectangle, size: [3, 0.55], cells: [1, 1], origin: [-1, -0.2]}}
"""


def outer_edges(body: Snapshot):
    """Edges of one cell only, of quadrilaterals or of a curve, shape (n, 2)."""
    if body.cell_type == "line":
        return body.cells
    edges = np.sort(np.concatenate([body.cells[:, [i, (i + 1) % 4]] for i in range(4)]), axis=1)
    counts = Counter(map(tuple, edges))
    return np.array([edge for edge, count in counts.items() if count == 1])


def shares(body: Snapshot):
    """Length of the surface that belongs to each node."""
    edges = outer_edges(body)
    lengths = np.linalg.norm(body.points[edges[:, 1]] - body.points[edges[:, 0]], axis=1)
    return np.bincount(edges.ravel(), np.repeat(lengths / 2.0, 2), minlength=len(body.points))


def test_the_force_is_computed_once_for_all_fields(tmp_path, monkeypatch):
    """It serves elastic and rigid bodies."""
    (tmp_path / "case.yaml").write_text(BODIES)
    steps = fsci.build(fsci.load(tmp_path))
    next(iter(steps))
    counted, force = [], Fluid.force
    monkeypatch.setattr(Fluid, "force", lambda fluid: counted.append(1) or force(fluid))
    fields = steps.fields()
    assert fields["block"].point_data["traction"].any()
    assert fields["disc"].point_data["traction"].any()
    assert len(counted) == 1


@pytest.mark.parametrize("element", ["q1q1", "q2q1"])
def test_tractions_sum_to_the_force(tmp_path, element):
    """On an elastic body that has moved and on a rigid one; the shear stress is the part along the wall."""
    (tmp_path / "case.yaml").write_text(BODIES)
    steps = fsci.build(fsci.load(tmp_path, {"fluid.element": element}))
    start = steps.fields()["block"]
    assert not start.point_data["traction"].any()
    for _ in steps:
        pass
    probes, fields = steps.probes(), steps.fields()
    for name, probe in (("block", "load"), ("disc", "drag")):
        body = fields[name]
        traction, shear = body.point_data["traction"], body.point_data["wall_shear_stress"]
        force = shares(body) @ traction
        assert force == pytest.approx([probes[f"{probe}.x"], probes[f"{probe}.y"], 0.0], rel=1e-10, abs=1e-13)
        pressure = traction - shear
        assert np.einsum("nd,nd->n", pressure, shear) == pytest.approx(0.0, abs=1e-12 * np.abs(traction).max() ** 2)
        assert 0.02 < np.abs(shear).max() < np.abs(traction).max()
    inside = shares(fields["block"]) == 0.0
    assert inside.sum() == 6
    assert not fields["block"].point_data["traction"][inside].any()
    assert np.abs(fields["block"].point_data["displacement"]).max() > 1e-4


def test_shear_stress_of_couette(tmp_path):
    """mu U / h; the pressure of the enclosed fluid is that of its node, and constant."""
    (tmp_path / "case.yaml").write_text(COUETTE)
    steps = fsci.build(fsci.load(tmp_path, {"fluid.bodies.floor.mesh.cells": [30, 1]}))
    assert list(steps) == [1.0]
    floor = steps.fields()["floor"]
    x, y, _ = floor.points.T
    inner = (np.abs(y - 0.35) < 1e-12) & (x > 0.15) & (x < 0.85)
    assert inner.sum() >= 6
    assert floor.point_data["wall_shear_stress"][inner] == pytest.approx(
        np.tile([0.4 / 0.65, 0.0, 0.0], (inner.sum(), 1)), rel=1e-9, abs=1e-11
    )
