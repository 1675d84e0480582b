"""Errors of the force on a body by what a run measures of the resolution: the table that warnings are read from."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import numpy as np

from fsci.bench.fluid import CENTRE, DIAMETER, cylinder, cylinder_grid
from fsci.bench.studies import approaching, error_of_drag
from fsci.bench.table import Row
from solvers.api import Array
from solvers.fluid.field import Fluid
from solvers.fluid.resolution.measure import measure

#: Bodies in the channel: (kind, name, sides of a rectangle in diameters; None: the cylinder, Reynolds numbers by the
#: mean inflow and the diameter; 0: Stokes flow).
BODIES = (
    ("smooth", "cylinder", None, (0, 20, 100)),
    ("sharp", "square", (1.0, 1.0), (0, 20)),
    ("sharp", "plate", (0.13, 1.0), (0, 20)),
)
#: Cells along the diameter, and those of the reference, which q2q1 computes.
CELLS = {"q1q1": (5, 8, 12, 20), "q2q1": (2, 3, 4, 6, 10)}
FINEST = 32
#: Cells in the gap of a cylinder that approaches a wall, `GAP` radii high.
GAP = 0.1
IN_GAP = {"q1q1": (0.5, 0.8, 1.0, 1.3, 2.0, 3.0, 4.0), "q2q1": (0.1, 0.2, 0.5, 1.0, 2.0)}


def run() -> list[Row]:
    """All rows, some minutes; `fsci bench resolution -o fsci/resolution/table.json` makes the table anew."""
    return list(rows())


def rows() -> Iterator[Row]:
    """The films, then the bodies."""
    for element, gaps in IN_GAP.items():
        for cells in gaps:
            yield film(element, cells)
    for kind, name, sides, numbers in BODIES:
        for reynolds in numbers:
            for element, some in CELLS.items():
                for cells in some:
                    yield around(kind, name, sides, reynolds, element, cells)


def around(kind: str, name: str, sides: tuple[float, float] | None, reynolds: int, element: str, cells: int) -> Row:
    """A body in a channel: cells in its boundary layer, and the error of its drag against the finest grid."""
    fluid = flow_past(sides, reynolds, element, cells)
    error = 100.0 * abs(_drag(fluid) / _finest(sides, reynolds) - 1.0)
    (found,) = measure(fluid)
    scene = f"{name}, Re {reynolds}"
    return _row(kind, scene, element, found.layer, found.across, error)


def film(element: str, cells: float) -> Row:
    """A cylinder that approaches a wall: cells in the gap where the force acts, and the error of its drag."""
    fluid = approaching(element, GAP / cells, GAP)
    (found,) = measure(fluid)
    (gap,) = found.gaps
    return _row("film", f"gap of {GAP:g} radii", element, gap.cells, gap.least, error_of_drag(fluid, GAP))


def _row(kind: str, scene: str, element: str, cells: float, least: float, error: float) -> Row:
    return {
        "kind": kind,
        "scene": scene,
        "element": element,
        "cells": round(cells, 4),
        "across": round(least, 4),
        "error [%]": round(error, 4),
    }


@cache
def _finest(sides: tuple[float, float] | None, reynolds: int) -> float:
    return _drag(flow_past(sides, reynolds, "q2q1", FINEST))


def _drag(fluid: Fluid) -> float:
    return float(fluid.force()["cylinder"].sum(axis=0)[0])


def flow_past(sides: tuple[float, float] | None, reynolds: int, element: str, cells: int) -> Fluid:
    """The steady flow past a body in Schaefer and Turek's channel."""
    shape = None if sides is None else rectangle(0.5 * DIAMETER * np.array(sides))
    mean = 0.01 * (reynolds or 1)
    fluid = cylinder(cylinder_grid(cells), element, mean, shape=shape, convection=reynolds > 0)
    fluid.initialise(0.0, 1.0)
    fluid.begin_step(0.0, 1.0)
    fluid.solve()
    return fluid


def rectangle(half: Array, parts: int = 40) -> Array:
    """Points on the sides of a rectangle, counterclockwise; no side lies in a plane of the grids."""
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * half
    t = np.arange(parts)[:, None] / parts
    sides = [a + t * (b - a) for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)]
    return np.concatenate(sides) + np.array(CENTRE) + [1.3e-3 * DIAMETER, -2.1e-3 * DIAMETER]
