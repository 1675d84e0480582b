"""Errors of the force on a body by what a run measures of the resolution: the table that warnings are read from."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from fsci.bench.fluid import CENTRE, DIAMETER, cylinder, cylinder_grid
from fsci.bench.studies import approaching, drag_of_film
from fsci.bench.table import Row
from solvers.api import Array
from solvers.fluid.flow.field import Fluid
from solvers.fluid.flow.resolution.measure import measure

FINEST = 32  #: cells along the diameter of the reference, which q2q1 computes
GAP = 0.1  #: of a cylinder that approaches a wall, in radii


def around(kind: str, name: str, reynolds: int, element: str, cells: int, sides: Sequence[float] | None = None) -> Row:
    """A body in a channel: cells in its boundary layer, and the error of its drag against the finest grid."""
    fluid = flow_past(sides, reynolds, element, cells)
    error = 100.0 * abs(_drag(fluid) / _finest(sides and tuple(sides), reynolds) - 1.0)
    (found,) = measure(fluid)
    scene = f"{name}, Re {reynolds}"
    return _row(kind, scene, element, found.layer, found.across, error)


def film(element: str, cells: float) -> Row:
    """A cylinder that approaches a wall: cells in the gap where the force acts, and the error of its drag.

    With q2q1 those along it: across, its parabolas are exact, and errors come from the change along the film.
    """
    fluid = approaching(element, GAP / cells, GAP)
    (found,) = measure(fluid)
    (gap,) = found.gaps
    error = 100.0 * abs(drag_of_film(fluid, GAP) - 1.0)
    return _row(
        "film", f"gap of {GAP:g} radii", element, gap.along if element == "q2q1" else gap.cells, gap.least, error
    )


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
def _finest(sides: Sequence[float] | None, reynolds: int) -> float:
    return _drag(flow_past(sides, reynolds, "q2q1", FINEST))


def _drag(fluid: Fluid) -> float:
    return float(fluid.force()["cylinder"].sum(axis=0)[0])


def flow_past(sides: Sequence[float] | None, reynolds: int, element: str, cells: int) -> Fluid:
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
