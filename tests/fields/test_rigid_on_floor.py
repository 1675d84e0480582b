"""A single free disc or ball at rest on a floor without a fluid: the floor carries its weight, on whichever side."""

from __future__ import annotations

import numpy as np
import pytest

from fsci.case import load_case
from fsci.running.history import read_history
from fsci.running.run import FINISHED, run_case

#: It falls by a fiftieth of its radius or more onto a table, and rests on a side of its polygon or polyhedron.
BALL = """\
time: {step: 0.02, end: 0.4}
rigid:
  gravity: [0, 0, -10]
  bodies:
    body: {mesh: {shape: sphere, radius: 0.15, cells: [3, 1], translate: [0.31, 0.28, 0.153]}, density: 8}
contact:
  FRICTION
  obstacles: {floor: {mesh: {shape: box, size: [2, 2, 0.2], cells: [1, 1, 1], origin: [-1, -1, -0.2]}, on: top}}
probes:
  mass: {body: body, quantity: mass}
  centre: {body: body, quantity: centre}
  momentum: {body: body, quantity: momentum}
output: {fields_every: 0}
"""
DISC = (
    BALL.replace("[0, 0, -10]", "[0, -10]")
    .replace("shape: sphere, radius: 0.15, cells: [3, 1], translate: [0.31, 0.28, 0.153]",
             "shape: disc, radius: 0.15, cells: [24, 1], rotate: {angle: 7.5}, translate: [0.31, 0.153]")
    .replace("shape: box, size: [2, 2, 0.2], cells: [1, 1, 1], origin: [-1, -1, -0.2]",
             "shape: rectangle, size: [2, 0.2], cells: [1, 1], origin: [-1, -0.2]")
)  # fmt: skip
#: Height of the centre: corners of the lowest side of the polyhedron are at 15 degrees in two directions.
LOWEST = {"y": 0.15 * np.cos(np.pi / 24), "z": 0.15 / np.sqrt(1.0 + 2.0 * np.tan(np.pi / 12) ** 2)}


def scaled(text: str) -> str:
    """All lengths a thousandth, at the same times."""
    for old, new in [
        ("radius: 0.15", "radius: 1.5e-4"), ("-10]", "-0.01]"), ("[0.31, 0.28, 0.153]", "[3.1e-4, 2.8e-4, 1.53e-4]"),
        ("[0.31, 0.153]", "[3.1e-4, 1.53e-4]"), ("[2, 2, 0.2]", "[2e-3, 2e-3, 2e-4]"), ("[2, 0.2]", "[2e-3, 2e-4]"),
        ("[-1, -1, -0.2]", "[-1e-3, -1e-3, -2e-4]"), ("[-1, -0.2]", "[-1e-3, -2e-4]"),
    ]:  # fmt: skip
        text = text.replace(old, new)
    return text


@pytest.mark.parametrize("friction", ["bodies: all", "friction: {coefficient: 0.4}"])
@pytest.mark.parametrize("scale", [1.0, 1e-3])
@pytest.mark.parametrize(("text", "up"), [pytest.param(DISC, "y", id="disc"), pytest.param(BALL, "z", id="ball")])
def test_the_floor_carries_the_weight(tmp_path, text, up, scale, friction):
    text = text.replace("FRICTION", friction)
    (tmp_path / "case.yaml").write_text(text if scale == 1.0 else scaled(text))
    assert run_case(load_case(tmp_path / "case.yaml"), tmp_path / "out") == FINISHED
    found = read_history(tmp_path / "out" / "history.csv")
    weight = 10.0 * scale * found["mass"][-1]
    assert found[f"contact.on_body.{up}"][-1] == pytest.approx(weight, rel=1e-9)
    assert found["contact.on_body.x"][-1] == pytest.approx(0.0, abs=1e-9 * weight)
    assert found[f"centre.{up}"].min() == pytest.approx(scale * LOWEST[up], rel=1e-9)
    assert found[f"centre.{up}"][-1] == pytest.approx(scale * LOWEST[up], rel=1e-9)
    assert abs(found[f"momentum.{up}"][-1]) < 1e-12 * weight
