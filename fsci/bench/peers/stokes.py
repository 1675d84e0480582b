"""Stokes flow around a cut disc with an exact solution: errors at sample points in the fluid, those of ngsxfem too."""

from __future__ import annotations

from time import process_time

import numpy as np
from mpi4py import MPI

from fsci.bench.fluid import polygon
from fsci.bench.table import Row
from solvers.api import Array
from solvers.fluid.background.grid import uniform
from solvers.fluid.bodies.immersed import rigid_body
from solvers.fluid.boundary.patches import Patch
from solvers.fluid.field import Fluid
from solvers.fluid.flow_settings import FlowSettings
from solvers.fluid.probes import interpolation
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings

CENTRE, RADIUS = (0.51, 0.48), 0.21


def u_x(x: Array, t: float) -> Array:
    return 20 * x[0] * x[1] ** 3


def u_y(x: Array, t: float) -> Array:
    return 5 * x[0] ** 4 - 5 * x[1] ** 4


def solve(element: str, cells: int) -> Row:
    """Errors relative to the largest value, and seconds of the processor from the grid on."""
    begin = process_time()
    points = polygon(CENTRE, RADIUS, 16 * cells)
    count = np.arange(len(points))
    velocity = np.stack([u_x(points.T, 0.0), u_y(points.T, 0.0)], axis=1)
    body = rigid_body("disc", points, np.stack([count, np.roll(count, -1)], axis=1), lambda t: (points, velocity))
    patches = [Patch("box", ("x-", "x+", "y-", "y+"), "velocity", (u_x, u_y))]
    flow = FlowSettings(1.0, 1.0, element=element, scheme="steady", convection=False)  # type: ignore[arg-type]
    settings = SolverSettings(Tolerance(1e-8), linear="direct")
    fluid = Fluid(uniform([0, 0], [1, 1], [cells] * 2), flow, patches, [body], settings, comm=MPI.COMM_SELF)
    fluid.initialise(0.0, 1.0)
    fluid.begin_step(0.0, 1.0)
    fluid.solve()
    seconds = process_time() - begin

    x = sample_points()
    unknowns = fluid.unknowns
    u = [w @ fluid.flow[d] for d, w in (interpolation(fluid, unknowns.velocity, unknowns.degree, at) for at in x)]
    p = [(w @ fluid.flow[d])[0] for d, w in (interpolation(fluid, unknowns.pressure, 1, at) for at in x)]
    exact = np.stack([u_x(x.T, 0.0), u_y(x.T, 0.0)], axis=1)
    off = np.array(p) - (60 * x[:, 0] ** 2 * x[:, 1] - 20 * x[:, 1] ** 3)
    return {
        "dofs": fluid.dofs(),
        "time [s]": seconds,
        "velocity [%]": 100 * float(np.sqrt(((np.array(u) - exact) ** 2).sum(axis=1).mean())) / 20,
        "pressure [%]": 100 * float(off.std()) / 60,
    }


def sample_points() -> Array:
    """A lattice of points that no grid has, without those in the disc or very near to it."""
    side = np.linspace(0.0, 1.0, 103)[1:-1]
    x = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    return x[np.hypot(*(x - CENTRE).T) > RADIUS + 0.01]
