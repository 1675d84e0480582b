"""`fsci check` warns of facets in the fluid that `wetted` does not name."""

import meshio  # noqa: TID253
import numpy as np
import pytest
from case_mistakes import load

from fsci.check.meshes import check_meshes

WALL = """\
time: {step: 0.1, end: 1}
structure:
  dynamics: {rho_inf: 0.5}
  bodies:
    wall:
      mesh: {shape: rectangle, size: [0.5, 1], cells: [4, 8], origin: [1, 0]}
      material: {law: neo_hooke, E: 1e4, nu: 0.3, density: 1000}
      supports: [{on: [top, bottom], displacement: [0, 0]}]
fluid:
  density: 1000
  viscosity: 1
  grid: {from: [0, 0], to: [2, 1], cells: [20, 10]}
  patches:
    walls: {on: [y-, y+], no_slip: true}
    ends: {on: [x-, x+], outflow: true}
coupling: {wetted: {wall: left}}
"""
PLATE = "    plate: {mesh: {shape: rectangle, size: [0.2, 1], cells: [4, 8], origin: [1.5, 0]}, material: "
PLATE += "{law: neo_hooke, E: 1e4, nu: 0.3, density: 1000}, supports: [{on: top, displacement: [0, 0]}]}\nfluid:"


def dry(text):
    return [text for text in check_meshes(load(text)).warnings if "not wet" in text]


@pytest.mark.usefixtures("in_new_folder")
def test_a_wall_with_fluid_on_both_sides():
    """Its right side, unless it is wet, outside of the box, or at another body. The ends are at walls of the box."""
    (found,) = dry(WALL.replace("cells: [4, 8]", "cells: [4, 8], order: 1"))
    assert found.startswith("case.yaml:16:27: 8 facets of 'wall', such as that around (1.5, 0.")
    assert found.endswith(
        "are in the fluid but not wet, so that fluid vanishes in them: name their surfaces, too, or say with "
        "'dry_side' where there is no fluid"
    )
    assert dry(WALL.replace("wall: left", "wall: [left, right]")) == []
    assert dry(WALL.replace("{wetted: {wall: left}}", "{}")) == []
    assert dry(WALL.replace("to: [2, 1]", "to: [1.3, 1]")) == []
    assert dry(WALL.replace("fluid:", PLATE)) == []
    assert dry(WALL.replace("left}", "left}, dry_side: {wall: [[2.5, 1.5], [2.5, -0.5]]}")) == []


@pytest.mark.usefixtures("in_new_folder")
@pytest.mark.parametrize("scale", [1.0, 1e-3])
def test_a_membrane_from_a_line(scale):
    """Which is thin: 20 facets on its other side, none at its ends."""
    y = np.linspace(0.0, 1.0, 21)
    points = scale * np.stack([1.0 + 0.02 * np.sin(np.pi * y), y, 0.0 * y], axis=1)
    meshio.Mesh(points, [("line", np.stack([np.arange(20), np.arange(1, 21)], axis=1))]).write("skin.vtk")
    text = WALL.replace(
        "{shape: rectangle, size: [0.5, 1], cells: [4, 8], origin: [1, 0]}", "{file: skin.vtk, thickness: T, order: 1}"
    )
    text = (
        text.replace("T,", f"{0.01 * scale},")
        .replace("[2, 1]", f"[{2 * scale}, {scale}]")
        .replace("[top, bottom]", "edge")
    )
    (found,) = dry(text.replace("wall: left", "wall: top"))
    assert "20 facets of 'wall', such as that around (" in found
    assert dry(text.replace("wall: left", "wall: [top, bottom]")) == []
