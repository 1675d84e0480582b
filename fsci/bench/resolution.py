"""Errors of the force on a body by what a run measures of the resolution: the table that warnings are read from."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from fsci.bench.fluid import CENTRE, DIAMETER, cylinder, cylinder_grid
from fsci.bench.studies import approaching, approaching_block, drag_of_film, force_of_film
from fsci.bench.table import Row
from solvers.api import Array
from solvers.fluid.flow.field import Fluid
from solvers.fluid.flow.resolution.measure import measure

FINEST = 32  #: cells along the diameter of the reference, which q2q1 computes
FINEST_ACROSS = 4  #: cells across the film of the reference, which q2q1 computes


def around(kind: str, name: str, reynolds: int, element: str, cells: int, sides: Sequence[float] | None = None) -> Row:
    """A body in a channel: cells in its boundary layer, and the error of its drag against the finest grid."""
    fluid = flow_past(sides, reynolds, element, cells)
    error = 100.0 * abs(_drag(fluid) / _finest(sides and tuple(sides), reynolds) - 1.0)
    (found,) = measure(fluid)
    scene = f"{name}, Re {reynolds}"
    return _row(kind, scene, element, found.layer, found.across, error)


def film(element: str, gap: float, cells: float) -> Row:
    """A cylinder that approaches a wall: cells in the gap (in radii) where the force acts, and the error.

    With q2q1 those along it: across, its parabolas are exact, and errors come from the change along the film.
    """
    fluid = approaching(element, gap / cells, gap)
    (found,) = measure(fluid)
    (narrow,) = found.gaps
    error = 100.0 * abs(drag_of_film(fluid, gap) - 1.0)
    counted = narrow.along if element == "q2q1" else narrow.cells
    return _row("film", f"gap of {gap:g} radii", element, counted, narrow.least, error)


def film_with_ends(element: str, gap: float, cells: float) -> Row:
    """A block that approaches a wall: cells across the gap, and the error of its force.

    With q2q1 times the cells along it: flat films are exact, and each end is off by a part of a cell.
    """
    fluid = approaching_block(element, gap / cells, gap)
    (found,) = measure(fluid)
    (film,) = found.gaps
    error = 100.0 * abs(force_of_film(fluid) / _finest_film(gap) - 1.0)
    error *= film.along if element == "q2q1" else 1.0
    return _row("ends", f"block, gap of {gap:g} half lengths", element, film.cells, film.least, error)


@cache
def _finest_film(gap: float) -> float:
    return force_of_film(approaching_block("q2q1", gap / FINEST_ACROSS, gap))


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
