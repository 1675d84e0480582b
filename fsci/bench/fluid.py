"""Benchmarks of the flow: error against time of 2D-1, the direct solver by size, and a step in 3D by part."""

from __future__ import annotations

import math
from collections.abc import Sequence
from time import perf_counter
from typing import Literal

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from fsci.bench.table import Row
from solvers.fluid.flow.field import Fluid
from solvers.fluid.flow.probes import at_point, difference
from solvers.fluid.grid.box import Grid, uniform
from solvers.fluid.settings.flow_settings import FlowSettings
from solvers.fluid.surfaces.immersed import ImmersedBody, rigid_body
from solvers.fluid.terms.boundary.patches import Patch
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings
from solvers.timing import Timer

Array = NDArray[np.float64]

#: Schaefer and Turek's channel [m], and the flow 2D-1: http://www.mathematik.tu-dortmund.de/~featflow/en/benchmarks
LENGTH, HEIGHT, DIAMETER, CENTRE = 2.2, 0.41, 0.1, (0.2, 0.2)
DRAG, LIFT, PRESSURE = 5.57953523384, 0.010618948146, 0.11752016697


def zero(x: Array, t: float) -> Array:
    return np.zeros(x.shape[1])


def graded(low: float, high: float, fine: tuple[float, float], h: float, ratio: float, largest: float) -> Array:
    """Planes from low to high: distance h between the two `fine` ones, growing by `ratio` up to `largest` outside."""
    middle = np.linspace(*fine, round((fine[1] - fine[0]) / h) + 1)
    before, after = _growing(fine[0] - low, h, ratio, largest), _growing(high - fine[1], h, ratio, largest)
    return np.concatenate([fine[0] - before[::-1], middle, fine[1] + after])


def _growing(length: float, h: float, ratio: float, largest: float) -> Array:
    steps: list[float] = []
    while sum(steps) < length:
        h = min(h * ratio, largest)
        steps.append(h)
    return np.cumsum(steps) * (length / sum(steps)) if steps else np.zeros(0)


def polygon(centre: tuple[float, float], radius: float, count: int) -> Array:
    """Corners of a regular polygon in a circle, counterclockwise."""
    angles = 2.0 * np.pi * np.arange(count) / count
    return np.asarray(centre) + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def disc(name: str, points: Array) -> ImmersedBody:
    """The polygon of some corners."""
    count = np.arange(len(points))
    return rigid_body(name, points, np.stack([count, np.roll(count, -1)], axis=1))


def cylinder_grid(cells: int, place: Sequence[float] = (0.0, 0.0)) -> Grid:
    """The channel with this many cells along the diameter of the cylinder, moved by parts of them.

    No plane of the grid touches the cylinder: there the pressure would be 1 % off.
    """
    h = DIAMETER / cells
    x, y = ((0.1288 + part * h, 0.2712 + part * h) for part in place)
    along = graded(0.0, LENGTH, x, h, 1.08, 4 * h + 0.01)
    return Grid((along, graded(0.0, HEIGHT, y, h, 1.08, 2 * h)))


def cylinder(
    grid: Grid, element: str, mean: float, scheme: str = "steady", timer: Timer | None = None, *, segments: int = 800,
    tolerance: float = 1e-8, varying: bool = False, shape: Array | None = None, convection: bool = True,
) -> Fluid:  # fmt: skip
    """Schaefer and Turek's channel with inflow of largest velocity 1.5 `mean`; `varying` times sin(pi t / 8).

    shape: corners of another body than the cylinder.
    """

    def inflow(x: Array, t: float) -> Array:
        return 6.0 * mean * x[1] * (HEIGHT - x[1]) / HEIGHT**2 * (math.sin(math.pi * t / 8.0) if varying else 1.0)

    patches = [
        Patch("in", ("x-",), "velocity", (inflow, zero)),
        Patch("out", ("x+",), "outflow"),
        Patch("walls", ("y-", "y+"), "no_slip"),
    ]
    body = disc("cylinder", polygon(CENTRE, DIAMETER / 2, segments) if shape is None else shape)
    flow = FlowSettings(1.0, 1e-3, element=element, scheme=scheme, convection=convection)  # type: ignore[arg-type]
    return Fluid(grid, flow, patches, [body], SolverSettings(Tolerance(tolerance)), timer=timer, comm=MPI.COMM_SELF)


def steady(element: str, cells: int) -> Row:
    """2D-1: errors of drag, lift and pressure difference, and wall time."""
    timer, mean, grid = Timer(), 0.2, cylinder_grid(cells)
    begin = perf_counter()
    fluid = cylinder(grid, element, mean, timer=timer)
    fluid.initialise(0.0, 1.0)
    ready = perf_counter()
    fluid.begin_step(0.0, 1.0)
    info = fluid.solve()
    drag, lift = 2.0 * fluid.force()["cylinder"].sum(axis=0) / (mean**2 * DIAMETER)
    end = perf_counter()
    front, back = (at_point(fluid, "pressure", (x, 0.2), 0.0) for x in (0.15, 0.25))
    drop = difference(front, back)()[""]
    return {
        "element": element,
        "cells of D": cells,
        "dofs": fluid.dofs(),
        "newton": info.iterations,
        "start [s]": ready - begin,
        "solve [s]": end - ready,
        "c_D error [%]": 100.0 * (drag / DRAG - 1.0),
        "c_L error [%]": 100.0 * (lift / LIFT - 1.0),
        "dp error [%]": 100.0 * (drop / PRESSURE - 1.0),
    }


# ------------------------------------------------------------------------------------------------ one linear system


def stokes(cells: int) -> Row:
    """Stokes flow around a disc by the direct solver, all of it from the grid on: seconds by part."""
    timer, begin = Timer(), perf_counter()

    def lid(x: Array, t: float) -> Array:
        return np.where(x[1] > 1.0 - 1e-9, 1.0, 0.0)

    patches = [Patch("box", ("x-", "x+", "y-", "y+"), "velocity", (lid, zero))]
    body = disc("disc", polygon((0.51, 0.48), 0.21, 4 * cells))
    flow = FlowSettings(1.0, 1.0, scheme="steady", convection=False)
    solver = SolverSettings(Tolerance(1e-8), linear="direct")
    fluid = Fluid(uniform([0, 0], [1, 1], [cells] * 2), flow, patches, [body], solver, timer=timer, comm=MPI.COMM_SELF)
    fluid.initialise(0.0, 1.0)
    fluid.begin_step(0.0, 1.0)
    fluid.solve()
    return {"cells": f"{cells} x {cells}", "dofs": fluid.dofs(), **parts(timer, perf_counter() - begin)}


def parts(timer: Timer, total: float) -> dict[str, float]:
    """Seconds by part."""
    known = {f"{name} [s]": timer.seconds.get(name, 0.0) for name in ("cut", "weights", "assembly", "solve")}
    return {"total [s]": total, **known, "rest [s]": total - sum(known.values())}


# ---------------------------------------------------------------------------------------------------- a step in 3D


def ring(count: int, around: int, radius: float, thickness: float, tilt: float) -> tuple[Array, NDArray[np.int64]]:
    """(points, triangles) of a torus about the z axis, tilted about y by an angle [rad]."""
    u, v = np.meshgrid(*(2.0 * np.pi * np.arange(n) / n for n in (count, around)), indexing="ij")
    r = radius + thickness * np.cos(v)
    flat = np.stack([r * np.cos(u), r * np.sin(u), thickness * np.sin(v)], axis=-1).reshape(-1, 3)
    i, j = (index.ravel() for index in np.indices((count, around)))
    a, b, c, d = (((i + p) % count) * around + (j + q) % around for p, q in ((0, 0), (1, 0), (1, 1), (0, 1)))
    turn = np.array([[np.cos(tilt), 0, np.sin(tilt)], [0, 1, 0], [-np.sin(tilt), 0, np.cos(tilt)]])
    return flat @ turn.T, np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def ring_in_channel(
    cells: int,
    timer: Timer,
    comm: MPI.Comm = MPI.COMM_SELF,
    *,
    steady: bool = False,
    element: Literal["q1q1", "q2q1"] = "q1q1",
) -> Fluid:
    """A tilted ring that sinks through a channel, Reynolds number 200 by its width; steady: at rest (collective)."""
    points, facets = ring(64, 32, 0.5, 0.2, math.radians(65.0))
    speed = np.array([0.0, 0.0, -0.2])

    def inflow(x: Array, t: float) -> Array:
        return -(1.0 - x[0] ** 2) * (1.0 - x[1] ** 2)

    patches = [
        Patch("in", ("z+",), "velocity", (zero, zero, inflow)),
        Patch("out", ("z-",), "outflow"),
        Patch("walls", ("x-", "x+", "y-", "y+"), "no_slip"),
    ]
    motion = None if steady else lambda t: (points + t * speed, 0.0 * points + speed)
    body = rigid_body("ring", points, facets, motion)
    flow = FlowSettings(1.0, 0.01, scheme="steady" if steady else "backward_euler", element=element)
    solver = SolverSettings(Tolerance(1e-6), linear_tolerance=1e-5)
    grid = uniform([-1.0] * 3, [1.0] * 3, [cells] * 3)
    return Fluid(grid, flow, patches, [body], solver, timer=timer, comm=comm)


def channel(cells: int, steps: int, dt: float = 0.05) -> Row:
    """A ring moves through a channel, backward Euler: seconds of one time step by part."""
    timer = Timer()
    fluid = ring_in_channel(cells, timer)
    fluid.initialise(0.0, dt)
    timer.seconds.clear()
    begin, newton = perf_counter(), 0
    for number in range(steps):
        fluid.begin_step(number * dt, dt)
        newton += fluid.solve().iterations
        fluid.end_step()
    seconds = {name: value / steps for name, value in parts(timer, perf_counter() - begin).items()}
    return {
        "cells": f"{cells}^3",
        "dofs": fluid.dofs(),
        "cut cells": len(fluid.cut.cut),
        "newton per step": newton / steps,
        "krylov, last": fluid.iterate.linear_iterations,
        **seconds,
    }
