"""A wavy channel that closes: the load that seals it, by the pressures at both of its ends."""

from __future__ import annotations

import numpy as np
import pytest
from test_coupled_run import run

#: The crest's distance from the floor at rest, height of the wave, of the body [m]; cells along.
GAP, WAVE, HEIGHT, ALONG = 0.01, 0.05, 1.0, 16

#: A body 0.5 long on a floor, its lower side a wave with the crest in the middle.
SHAPE = f"""
For i In {{0 : {ALONG}}}
  x = 0.25 + 0.5 * i / {ALONG};
  Point(i + 1) = {{x, {GAP} + 0.5 * {WAVE} * (1 - Cos(4 * Pi * (x - 0.5))), 0}};
EndFor
Point(100) = {{0.75, {HEIGHT}, 0}};
Point(101) = {{0.25, {HEIGHT}, 0}};
Spline(1) = {{1 : {ALONG} + 1}};
Line(2) = {{{ALONG} + 1, 100}};
Line(3) = {{100, 101}};
Line(4) = {{101, 1}};
Curve Loop(1) = {{1, 2, 3, 4}};
Plane Surface(1) = {{1}};
Transfinite Curve {{1, 3}} = {ALONG} + 1;
Transfinite Curve {{2, 4}} = 9;
Transfinite Surface {{1}};
Recombine Surface {{1}};
Physical Curve("bottom") = {{1}};
Physical Curve("right") = {{2}};
Physical Curve("top") = {{3}};
Physical Curve("left") = {{4}};
Physical Surface("block") = {{1}};
"""

BLOCK = """\
      mesh: {file: wave.geo}
      material: {law: st_venant_kirchhoff, E: 100, nu: 0, density: 1}
      supports: [{on: top, displacement: [0, 0]}, {on: [left, right], displacement: [0, null]}]
      gravity: [0, 0]
"""

#: It is pressed down by its weight until t = 0.5; from t = 1 on the pressures at the ends rise.
CHANNEL = """
time: {step: 0.1, end: 1}
fluid:
  density: 1
  viscosity: 1e-3
  flow: stokes
  scheme: backward_euler
  element: q2q1
  grid:
    from: [0, 0]
    to: [1, 1]
    cells: [25, null]
    y: [{to: 0.1, cells: 3}, {to: 1, cells: 6, ratio: 5}]
  patches:
    left: {on: x-, traction: [0, 0]}
    right: {on: x+, traction: [0, 0]}
    walls: {on: [y-, y+], no_slip: true}
structure:
  dynamics: {rho_inf: 0}
  bodies:
    block:
"""
CHANNEL += (
    BLOCK
    + """\
contact:
  film: {transmissivity: 1e-5, zone: seeping}
  obstacles:
    floor: {mesh: {shape: rectangle, size: [2, 0.1], cells: [1, 1], origin: [-0.5, -0.1]}, on: top}
  pairs:
    floor: {slave: {body: block, on: bottom}, master: {obstacle: floor}}
coupling: {scheme: monolithic}
probes:
  out: {quantity: flow_rate, through: right}
"""
)

#: The body alone: its weight at t = 1, the pressure from below at t = 2.
SOLID = (
    """
time: {step: 1, end: 2}
structure:
  bodies:
    block:
"""
    + BLOCK
    + """\
      pressures: [{on: bottom, value: "0.1*max(t - 1, 0)"}]
probes:
  crest: {body: block, quantity: displacement, at: [0.5, 0.01]}
"""
)


def opening(folder, load: float, left: float, right: float, time: float = 3.6) -> float:
    """Pressure [Pa] at which contact opens: force against pressure, extrapolated to zero from its last steps.

    load: the weight per volume [N/m^3]; left, right: shares of the pressure at the ends, which rises by 0.5 Pa/s.
    """
    folder.mkdir()
    (folder / "wave.geo").write_text(SHAPE)
    rise = "0.5*max(t - 1, 0)"
    changes = {
        "time.end": time,
        "structure.bodies.block.gravity": f"[0, '-{load}*min(t/0.5, 1)']",
        "fluid.patches.left.traction": f"['{left}*{rise}', 0]",
        "fluid.patches.right.traction": f"['-{right}*{rise}', 0]",
    }
    history = run(CHANNEL, folder, *((name, str(value)) for name, value in changes.items()))
    assert history["iterations"].max() <= 6
    force, pressure = history["contact.floor.y"], 0.5 * np.maximum(history["time"] - 1.0, 0.0)
    assert force[-1] == 0.0
    last = np.flatnonzero(force > 0.0)[-1]
    slope, height = np.polyfit(pressure[last - 3 : last + 1], force[last - 3 : last + 1], 1)
    return -height / slope


def crest(folder) -> tuple[float, float]:
    """How far the crest goes down under a weight of 1 N/m^3, and up under a pressure of 1 Pa from below [m]."""
    folder.mkdir()
    (folder / "wave.geo").write_text(SHAPE)
    small = 0.1
    history = run(SOLID, folder, ("structure.bodies.block.gravity", f"[0, '-{small}*max(2 - t, 0)']"))
    return tuple(np.abs(history["crest.y"]) / small)


@pytest.mark.slow
def test_sealing_load_is_affine_in_the_inlet_pressure(tmp_path):
    """As in a channel of Shvarts and Yastrebov (arXiv 1712.06312); here the flow crosses one crest.

    A load b moves the crest down by G b, and the pressures move it up by C (p_in + p_out) / 2, because what is odd
    about the crest does not move it: d p_in / d b = 2 G / C, and one pressure is worth as much as the other.
    """
    loads = np.array([2.6, 3.0, 3.4])
    found = np.array([opening(tmp_path / f"{load}", load, 1.0, 0.0) for load in loads])
    assert found[0] - 2.0 * found[1] + found[2] == pytest.approx(0.0, abs=0.01 * found[1])
    down, up = crest(tmp_path / "solid")
    assert (found[2] - found[0]) / (loads[2] - loads[0]) == pytest.approx(2.0 * down / up, rel=0.05)
    assert opening(tmp_path / "other", 3.0, 0.0, 1.0) == pytest.approx(found[1], rel=1e-6)
    assert opening(tmp_path / "both", 3.0, 0.5, 0.5) == pytest.approx(found[1], rel=0.01)
