"""Benchmark of Cook's membrane, nearly incompressible: error against time by element."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from time import process_time

import numpy as np
from mpi4py import MPI

from fsci import shapes
from fsci.bench.table import Row
from solvers.mesh.mesh import Mesh
from solvers.solver_settings import SolverSettings
from solvers.structure.body import Body, Support, Traction
from solvers.structure.elastic_constants import lame
from solvers.structure.elements import Formulation
from solvers.structure.field import Structure
from solvers.structure.materials import LinearElastic

#: Of the corner, by an independent program (tests/fields/test_cook_reference.py).
RISE = 27.755


def measure(cell: str, order: int, element: Formulation, cells: int) -> Row:
    """Rise of the upper right corner, its error against the finest mesh, processor time of assembly and solution."""
    _compile(cell, order, element)
    mesh = membrane(cell, order, cells)
    rise, seconds = solve(mesh, element)
    nodes = {("quad", 1): "quad4", ("quad", 2): "quad9", ("tri", 2): "tri6"}[cell, order]
    return {
        "cell": nodes,
        "element": element,
        "cells": cells,
        "dofs": mesh.points.size,
        "corner u_y": round(rise, 3),
        "error [%]": 100 * (1 - rise / RISE),
        "time [ms]": 1e3 * seconds,
    }


@cache
def _compile(cell: str, order: int, element: Formulation) -> None:
    """The forms, which is not measured."""
    solve(membrane(cell, order, 2), element)


def membrane(cell: str, order: int, cells: int) -> Mesh:
    """The panel with the corners (0, 0), (48, 44), (48, 60), (0, 44)."""
    mesh = shapes.rectangle([1, 1], [cells, cells], order=order, cell=cell)
    s, t = mesh.points.T
    return replace(mesh, points=np.column_stack([48 * s, 44 * s * (1 - t) + (44 + 16 * s) * t]))


def solve(mesh: Mesh, element: Formulation) -> tuple[float, float]:
    """(vertical displacement of the upper right corner, processor seconds) for E = 70, nu = 0.4999, a shear of 6.25."""
    held, sheared = Support("left"), Traction("right", (0.0, 6.25))
    material = LinearElastic(*lame(70.0, 0.4999))
    body = Body("panel", mesh, material, element=element, supports=[held], tractions=[sheared], comm=MPI.COMM_SELF)
    structure = Structure([body], settings=SolverSettings(linear="direct"))
    structure.initialise(0.0, 1.0)
    structure.begin_step(0.0, 1.0)
    begin = process_time()
    structure.solve()
    seconds = process_time() - begin
    corner = int(np.argmax(body.points[0] + body.points[1]))
    return float(body.u.x.array.reshape(-1, 2)[corner, 1]), seconds
