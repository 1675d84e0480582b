"""Bodies that begin within other ones and come out: the fluid reaches them, and gives way to their volume."""

from __future__ import annotations

import numpy as np
import pytest

from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.run import run_case

#: A rod is pushed out of a sleeve that hides all of it, into a chamber with an outlet.
ROD = """\
title: A rod comes out of a sleeve
time: {{step: 0.1, end: 1}}
fluid:
  density: 1
  viscosity: 0.1
  element: q1q1
  scheme: backward_euler
  grid: {grid}
  patches:
    out: {{on: x+, outflow: true}}
    walls: {{on: {walls}, no_slip: true}}
  bodies:
    sleeve: {{mesh: {sleeve}}}
structure:
  dynamics: {{rho_inf: 0.5}}
  bodies:
    rod:
      mesh: {rod}
      material: {{law: neo_hooke, E: 5000, nu: 0.3, density: 1}}
      supports: [{{on: left, displacement: {pushed}}}]
coupling: {{scheme: {scheme}}}
probes:
  out: {{quantity: flow_rate, through: out}}
  water: {{field: fluid, quantity: volume}}
output: {{fields_every: 0}}
"""
PLANE = {
    "grid": "{from: [0, 0], to: [3, 1], cells: [30, 10]}",
    "walls": "[x-, y-, y+]",
    "sleeve": "{shape: rectangle, size: [0.71, 0.62], cells: [4, 4], origin: [0.52, 0.19]}",
    "rod": "{{shape: rectangle, size: [0.5, 0.21], cells: [5, 2], origin: [{:.4f}, 0.41]}}",
}
SPACE = {
    "grid": "{from: [0, 0, 0], to: [2.4, 1, 1], cells: [14, 6, 6]}",
    "walls": "[x-, y-, y+, z-, z+]",
    "sleeve": "{shape: box, size: [0.71, 0.62, 0.63], cells: [4, 4, 4], origin: [0.52, 0.19, 0.18]}",
    "rod": "{{shape: box, size: [0.5, 0.31, 0.3], cells: [5, 3, 3], origin: [{:.4f}, 0.36, 0.37]}}",
}


def pushed(folder, scene, place=0.63, scheme="monolithic", way="0.5*ramp(t, 0, 1)"):
    """(volume that leaves in each step, by which the fluid's decreases, `fluid.mass`)."""
    along = f'["{way}"{", 0" * (scene["walls"].count(",") // 2)}]'
    settings = scene | {"rod": scene["rod"].format(place), "pushed": along, "scheme": scheme}
    (folder / "case.yaml").write_text(ROD.format(**settings))
    assert run_case(load_case(folder / "case.yaml"), folder / "run") == 0
    found = read_history(folder / "run" / "history.csv")
    return (
        np.diff(found["time"], prepend=0.0) * found["out"],
        -np.diff(found["water"], prepend=found["water"][0]),
        found["fluid.mass"],
    )


@pytest.mark.parametrize(
    ("place", "scheme"),
    [(0.63, "monolithic"), pytest.param(0.6633, "partitioned", marks=pytest.mark.slow)],
)
def test_rod_that_comes_out(tmp_path, place, scheme):
    """All of its surface was dry for ever, and swallowed its volume of water in silence."""
    displaced(*pushed(tmp_path, PLANE, place, scheme), least=0.07, section=0.21)


@pytest.mark.slow
def test_rod_in_space_that_comes_out(tmp_path):
    displaced(*pushed(tmp_path, SPACE), least=0.03, section=0.31 * 0.3)


def displaced(left, less, mass, *, least, section):
    """What leaves is what the rod displaces; least: of it in all; section: of the rod."""
    assert less.sum() > least
    inside, first = less < 1e-12, np.argmax(less > 1e-12)
    assert np.abs(left[inside]).max() < 1e-12
    assert left[first + 1 :] == pytest.approx(less[first + 1 :], rel=0.01, abs=1e-5)
    # the way within the sleeve counts in the step in which it comes out
    assert less[first] < left[first] < 0.1 * section
    assert np.abs(mass).max() < 1e-8


def test_rod_that_goes_back(tmp_path):
    """It comes out by a part of its length, and takes its water in again."""
    left, less, _ = pushed(tmp_path, PLANE, way="0.3*sin(pi*t)^2")
    within = np.abs(less) < 1e-12
    assert less.max() > 0.01
    assert less.min() < -0.01
    assert np.abs(left[within]).max() < 1e-12
    between = ~within & ~np.roll(within, 1) & ~np.roll(within, -1)  # neither comes out nor goes in
    assert left[between] == pytest.approx(less[between], rel=0.02, abs=1e-4)


def test_a_predictor_that_inverts_elements_is_left_out(tmp_path, capsys):
    """The rod turns round while it swings: extrapolated, it passes through its support. No step is repeated."""
    pushed(tmp_path, PLANE, way="0.4*sin(pi*t)^2")
    assert "repeated" not in capsys.readouterr().out


def test_elements_that_invert_are_named(tmp_path, capsys):
    """A support jumps by many elements: the failed steps say so, not that a residual is not a number."""
    with pytest.raises(AssertionError):  # the run fails
        pushed(tmp_path, PLANE, way="where(t > 0.25, 1.5, 0)")
    words = capsys.readouterr().out
    assert "element of body 'rod' inverted" in words
    assert "not a number" not in words
