"""Errors of the force on a body by what a run measures of the resolution: the table that warnings are read from."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache

import numpy as np
from mpi4py import MPI

from fsci import shapes
from fsci.bench.fluid import CENTRE, DIAMETER, cylinder, cylinder_grid, graded, zero
from fsci.bench.studies import approaching, approaching_block, drag_of_film, force_of_film
from fsci.bench.table import Row
from solvers.api import Array
from solvers.fluid.flow.field import Fluid
from solvers.fluid.flow.resolution.measure import measure
from solvers.fluid.grid.box import Grid
from solvers.fluid.settings.flow_settings import FlowSettings
from solvers.fluid.surfaces.immersed import rigid_body
from solvers.fluid.terms.boundary.patches import Patch
from solvers.mesh.tessellation import tessellate
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings

FINEST = 32  #: cells along the diameter of the reference, which q2q1 computes
FINEST_ACROSS = 4  #: cells across the film of the reference, which q2q1 computes
DRAG_OF_PLATE = 1.327  #: of Richter's plate [N], the half in the box


def around(
    kind: str,
    name: str,
    reynolds: int,
    element: str,
    cells: int,
    sides: Sequence[float] | None = None,
    places: Sequence[Sequence[float]] = ((0.0, 0.0),),
) -> Row:
    """A body in a channel: cells in its boundary layer, and the error of its drag against the finest grid.

    places: of the grid, in cells.
    """
    flows = [flow_past(sides, reynolds, element, cells, place) for place in places]
    finest = _finest(sides and tuple(sides), reynolds)
    return _mean_row(kind, f"{name}, Re {reynolds}", element, flows, finest)


def plate_in_space(element: str, cells: int, places: Sequence[Sequence[float]] = ((0.0, 0.0),)) -> Row:
    """Richter's plate in a channel of square section, rigid: cells along its height of 0.2 m, the error of its drag.

    Source: Th. Richter, Comput. Methods Appl. Mech. Engrg. 223-224 (2012) 28-42; it bends by 6e-4 of its thickness.
    """
    flows = [_past_plate(element, 0.2 / cells, place) for place in places]
    return _mean_row("sharp in space", "plate on a floor, Re 40", element, flows, DRAG_OF_PLATE)


def _mean_row(kind: str, scene: str, element: str, flows: Sequence[Fluid], exact: float) -> Row:
    """The error is the root mean square over the flows: by how edges lie in cells, it may be small by chance."""
    error = 100.0 * math.sqrt(float(np.mean([(_drag(fluid) / exact - 1.0) ** 2 for fluid in flows])))
    found = [body for fluid in flows for body in measure(fluid)]
    layer, across = (float(np.mean(values)) for values in zip(*((one.layer, one.across) for one in found), strict=True))
    return _row(kind, scene, element, layer, across, error)


def _past_plate(element: str, h: float, place: Sequence[float]) -> Fluid:
    along, top = (0.353 + place[0] * h, 0.553 + place[0] * h), 0.247 + place[1] * h
    across = graded(0.0, 0.4, (0.0, top), h, 1.3, 0.1)
    grid = Grid((graded(0.0, 1.5, along, h, 1.3, 0.2), across, across))
    patches = [
        Patch("in", ("x-",), "velocity", (_into_square, zero, zero)),
        Patch("out", ("x+",), "outflow"),
        Patch("middle", ("z-",), "symmetry"),
        Patch("walls", ("y-", "y+", "z+"), "no_slip"),
    ]
    facets, nodes = tessellate(mesh := shapes.box([0.1, 0.3, 0.4], [1, 1, 1]))
    body = rigid_body("plate", mesh.points[nodes] + [0.4, -0.1, -0.2], facets)
    flow = FlowSettings(1e3, 1.0, element=element, scheme="steady")  # type: ignore[arg-type]
    return _solved(Fluid(grid, flow, patches, [body], SolverSettings(Tolerance(1e-6)), comm=MPI.COMM_SELF))


def _into_square(x: Array, t: float) -> Array:
    return 0.2 * x[1] * (0.4 - x[1]) * (0.4**2 - x[2] ** 2) / (0.2**2 * 0.4**2)


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
    (force,) = fluid.force().values()
    return float(force.sum(axis=0)[0])


def flow_past(
    sides: Sequence[float] | None, reynolds: int, element: str, cells: int, place: Sequence[float] = (0.0, 0.0)
) -> Fluid:
    """The steady flow past a body in Schaefer and Turek's channel; place: of the grid, in cells."""
    shape = None if sides is None else rectangle(0.5 * DIAMETER * np.array(sides))
    mean = 0.01 * (reynolds or 1)
    return _solved(cylinder(cylinder_grid(cells, place), element, mean, shape=shape, convection=reynolds > 0))


def _solved(fluid: Fluid) -> Fluid:
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
