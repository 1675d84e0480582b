"""The scenes of the peers by fsci, each as the other programs compute it: rows of unknowns, seconds and errors."""

from __future__ import annotations

import json
from pathlib import Path
from time import process_time

import numpy as np
from mpi4py import MPI
from pressure import pressure_errors

from fsci.bench import fluid, hertz
from fsci.bench.family import FamilyScene
from fsci.bench.fluid import polygon
from fsci.bench.table import Row
from fsci.builder.build import build
from fsci.case import load_case
from solvers.api import Array
from solvers.fluid.flow.field import Fluid
from solvers.fluid.flow.probes import interpolation
from solvers.fluid.grid.box import uniform
from solvers.fluid.settings.flow_settings import FlowSettings
from solvers.fluid.surfaces.immersed import rigid_body
from solvers.fluid.terms.boundary.patches import Patch
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings
from solvers.timing import Timer

#: Disc of the Stokes flow, that of ngsxfem_stokes.py
CENTRE, RADIUS = (0.51, 0.48), 0.21
ONLY_OURS = ("element", "cells of D", "start [s]", "solve [s]")
#: Turek and Hron (2006), as the verify block of fsi1 has them
REFERENCE = {"tip.x": 2.270493e-5, "tip.y": 8.208773e-4, "force.x": 14.29426, "force.y": 0.7637460}
NAMES = {"tip.x": "u_x", "tip.y": "u_y", "force.x": "drag", "force.y": "lift"}


def with_largest(found: Row) -> Row:
    """A row with the largest of its errors."""
    errors = {name: float(value) for name, value in found.items() if name.endswith("error [%]")}
    rest = {name: value for name, value in found.items() if name not in errors}
    return {**rest, **errors, "largest error [%]": max(map(abs, errors.values()))}


def cylinder(element: str, cells: int, folder: Path | None = None) -> Row:
    """2D-1."""
    begin = process_time()
    found = {name: value for name, value in fluid.steady(element, cells).items() if name not in ONLY_OURS}
    return with_largest({**found, "time [s]": process_time() - begin})


def ball(per_radius: int, outer: int, folder: Path | None = None) -> Row:
    """Hertz' contact."""
    found = hertz.solve(per_radius, outer)
    values = {"dofs": found.structure.dofs(), "newton": found.newton, "time [s]": found.cpu, "force": found.force}
    return pressure_errors({**values, "distance": found.distance, "pressure": found.pressure})


def flag(scene: FamilyScene) -> Row:
    """FSI1, solved by a quasi-Newton scheme; seconds from the grid on."""
    case = load_case(scene.folder, [(name, json.dumps(value)) for name, value in scene.settings.items()])
    begin = process_time()
    simulation = build(case, MPI.COMM_WORLD, Timer())
    simulation.initialise(0.0, case.time.step)
    simulation.scheme.step(0.0, case.time.step)
    seconds = process_time() - begin
    found = simulation.probes()
    errors = {f"{NAMES[name]} error [%]": 100.0 * (found[name] / value - 1.0) for name, value in REFERENCE.items()}
    return with_largest({"dofs": sum(simulation.dofs.values()), "time [s]": seconds, **errors})


# --------------------------------------------------------------------------------- Stokes flow with an exact solution


def u_x(x: Array, t: float) -> Array:
    return 20 * x[0] * x[1] ** 3


def u_y(x: Array, t: float) -> Array:
    return 5 * x[0] ** 4 - 5 * x[1] ** 4


def stokes(element: str, cells: int, folder: Path | None = None) -> Row:
    """Errors at sample points in the fluid relative to the largest value, those of ngsxfem, too."""
    begin = process_time()
    points = polygon(CENTRE, RADIUS, 16 * cells)
    count = np.arange(len(points))
    velocity = np.stack([u_x(points.T, 0.0), u_y(points.T, 0.0)], axis=1)
    body = rigid_body("disc", points, np.stack([count, np.roll(count, -1)], axis=1), lambda t: (points, velocity))
    patches = [Patch("box", ("x-", "x+", "y-", "y+"), "velocity", (u_x, u_y))]
    flow = FlowSettings(1.0, 1.0, element=element, scheme="steady", convection=False)  # type: ignore[arg-type]
    settings = SolverSettings(Tolerance(1e-8), linear="direct")
    solved = Fluid(uniform([0, 0], [1, 1], [cells] * 2), flow, patches, [body], settings, comm=MPI.COMM_SELF)
    solved.initialise(0.0, 1.0)
    solved.begin_step(0.0, 1.0)
    solved.solve()
    seconds = process_time() - begin

    x = sample_points()
    unknowns = solved.unknowns
    u = [w @ solved.flow[d] for d, w in (interpolation(solved, unknowns.velocity, unknowns.degree, at) for at in x)]
    p = [(w @ solved.flow[d])[0] for d, w in (interpolation(solved, unknowns.pressure, 1, at) for at in x)]
    exact = np.stack([u_x(x.T, 0.0), u_y(x.T, 0.0)], axis=1)
    off = np.array(p) - (60 * x[:, 0] ** 2 * x[:, 1] - 20 * x[:, 1] ** 3)
    return {
        "dofs": solved.dofs(),
        "time [s]": seconds,
        "velocity [%]": 100 * float(np.sqrt(((np.array(u) - exact) ** 2).sum(axis=1).mean())) / 20,
        "pressure [%]": 100 * float(off.std()) / 60,
    }


def sample_points() -> Array:
    """A lattice of points that no grid has, without those in the disc or very near to it."""
    side = np.linspace(0.0, 1.0, 103)[1:-1]
    x = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    return x[np.hypot(*(x - CENTRE).T) > RADIUS + 0.01]
