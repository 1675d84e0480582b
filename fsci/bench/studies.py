"""Runs whose error is measured against a formula: films, and a flow in time around a cut sphere."""

from __future__ import annotations

from collections.abc import Callable
from time import process_time

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from fsci import shapes
from fsci.bench.bands import ELEMENTS, level
from fsci.bench.fluid import graded, polygon, zero
from fsci.bench.table import ERROR, LEVEL, TIME, UNKNOWNS, Row
from solvers.api import Array
from solvers.fluid.flow.field import Fluid
from solvers.fluid.flow.probes import interpolation
from solvers.fluid.grid.box import Grid, uniform
from solvers.fluid.settings.flow_settings import FlowSettings
from solvers.fluid.surfaces.immersed import rigid_body
from solvers.fluid.terms.boundary.patches import Patch
from solvers.mesh.tessellation import tessellate
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings

GAP, SPHERE_GAP = 0.02, 0.1  #: between cylinder, sphere and wall, in radii


def film(element: str, h: float) -> Row:
    """Half a cylinder of radius 1 moves towards a wall: cells h of the film and below the cylinder."""
    begin = process_time()
    return _of_drag(fluid := approaching(element, h, GAP), drag_of_film(fluid, GAP), h, process_time() - begin)


def _of_drag(fluid: Fluid, drag: float, h: float, seconds: float) -> Row:
    """The row of a drag over the exact one, with cells h."""
    error = 100.0 * abs(drag - 1.0)
    methods = {"element": ELEMENTS.index(fluid.settings.element)}
    return {UNKNOWNS: fluid.dofs(), TIME: seconds, ERROR: error, LEVEL: level({"drag": drag}, {"cells": h}, methods)}


def drag_of_film(fluid: Fluid, gap: float) -> float:
    """That of `approaching` over the exact one."""
    alpha = np.arccosh(1.0 + gap)
    exact = 4.0 * np.pi / (alpha - np.tanh(alpha))  # Jeffrey and Onishi (1981)
    return float(2.0 * fluid.force()["cylinder"].sum(axis=0)[1] / exact)


def approaching(element: str, h: float, gap: float) -> Fluid:
    """The flow around half a cylinder of radius 1 that moves towards a wall, with cells h near both."""
    x = graded(0.0, 8.0, (0.0, 1.0), h, 1.15, 1.0)
    y = graded(0.0, 8.0, (0.0, max(4 * h, round((gap + 0.3) / h) * h)), h, 1.15, 1.0)
    points = polygon((0.0, 1.0 + gap), 1.0, 2000)
    count = np.arange(len(points))
    return _falling("cylinder", points, np.stack([count, np.roll(count, -1)], axis=1), (x, y), element)


def approaching_block(element: str, h: float, gap: float) -> Fluid:
    """The flow around half a block of length 2 and height 0.3 that moves towards a wall, with cells h near both.

    Its sides lie in no plane of the grids of `fsci bench resolution`.
    """
    x = graded(0.0, 8.0, (0.0, 1.3), h, 1.15, 1.0)
    y = graded(0.0, 8.0, (0.0, max(4 * h, round((gap + 0.3) / h) * h)), h, 1.15, 1.0)
    parts = np.arange(100)[:, None] / 100
    corner = np.array([[-1.0, gap], [1.0, gap], [1.0, gap + 0.3], [-1.0, gap + 0.3]])
    points = np.concatenate([a + parts * (b - a) for a, b in zip(corner, np.roll(corner, -1, axis=0), strict=True)])
    count = np.arange(len(points))
    return _falling("block", points, np.stack([count, np.roll(count, -1)], axis=1), (x, y), element)


def force_of_film(fluid: Fluid) -> float:
    """On half of the block."""
    return float(fluid.force()["block"].sum(axis=0)[1])


def sphere(element: str, h: float) -> Row:
    """A quarter of a sphere of radius 1 moves towards a wall."""
    begin = process_time()
    x = graded(0.0, 8.0, (0.0, 1.2), h, 1.3, 2.0)
    facets, nodes = tessellate(mesh := shapes.sphere(1.0, [32, 1]))
    points = mesh.points[nodes] + [0.0, 0.0, 1.0 + SPHERE_GAP]
    fluid = _falling("sphere", points, facets, (x, x, x), element)
    force, exact = 4.0 * fluid.force()["sphere"].sum(axis=0)[2], 6.0 * np.pi * brenner(SPHERE_GAP)
    return _of_drag(fluid, float(force / exact), h, process_time() - begin)


def brenner(gap: float) -> float:
    """F / (6 pi mu a V) of a sphere of radius a that approaches a wall; gap in radii.

    Source: H. Brenner, Chem. Eng. Sci. 16 (1961) 242-251.
    """
    alpha = np.arccosh(1.0 + gap)
    n = np.arange(1.0, 40.0 / alpha)
    top = 2.0 * np.sinh((2 * n + 1) * alpha) + (2 * n + 1) * np.sinh(2 * alpha)
    bottom = 4.0 * np.sinh((n + 0.5) * alpha) ** 2 - (2 * n + 1) ** 2 * np.sinh(alpha) ** 2
    terms = n * (n + 1) / ((2 * n - 1) * (2 * n + 3)) * (top / bottom - 1.0)
    return float(4.0 / 3.0 * np.sinh(alpha) * terms.sum())


def _falling(name: str, points: Array, facets: NDArray[np.int64], planes: tuple[Array, ...], element: str) -> Fluid:
    """Creeping flow around a surface that moves down to a wall with velocity 1; free outside, symmetric at 0."""
    dim = len(planes)
    down = np.zeros_like(points) - np.eye(dim)[-1]
    body = rigid_body(name, points, facets, lambda t: (points, down))
    patches = [
        Patch("symmetry", ("x-", "y-")[: dim - 1], "slip"),
        Patch("free", ("x+", "y+", "z+")[:dim], "traction", (zero,) * dim),
        Patch("wall", (f"{'xyz'[dim - 1]}-",), "no_slip"),
    ]
    flow = FlowSettings(1.0, 1.0, element=element, scheme="steady", convection=False)  # type: ignore[arg-type]
    settings = SolverSettings(Tolerance(1e-8), linear="direct")
    fluid = Fluid(Grid(planes), flow, patches, [body], settings, comm=MPI.COMM_SELF)
    fluid.initialise(0.0, 1.0)
    fluid.begin_step(0.0, 1.0)
    fluid.solve()
    return fluid


# ------------------------------------------------------------------------------------------- Ethier and Steinman

A, D = np.pi / 4, np.pi / 2  #: parameters of the flow in [-1, 1]^3; viscosity and density are 1
END = 0.2


def _component(i: int) -> Callable[[Array, float], Array]:
    """u_i = -a (exp(a x_i) sin(a x_j + d x_k) + exp(a x_k) cos(a x_i + d x_j)) exp(-d^2 t), (i, j, k) in a cycle.

    Source: C. R. Ethier, D. A. Steinman, Int. J. Numer. Meth. Fluids 19 (1994) 369-375.
    """
    j, k = (i + 1) % 3, (i + 2) % 3

    def value(x: Array, t: float) -> Array:
        first = np.exp(A * x[i]) * np.sin(A * x[j] + D * x[k])
        second = np.exp(A * x[k]) * np.cos(A * x[i] + D * x[j])
        return -A * (first + second) * np.exp(-(D**2) * t)

    return value


VELOCITY = tuple(_component(i) for i in range(3))


def decay(element: str, scheme: str, cells: int) -> Row:
    """A decaying flow whose velocity is given on the box and on a sphere in it: error of the velocity over its size.

    The step is 0.4 of a cell.
    """
    begin, steps = process_time(), cells // 2
    facets, nodes = tessellate(mesh := shapes.sphere(0.453, [16, 1]))
    points = mesh.points[nodes] + [0.03, -0.04, 0.01]
    body = rigid_body(
        "sphere", points, facets, lambda t: (points, np.stack([u(points.T, t) for u in VELOCITY], axis=1))
    )
    patch = Patch("box", ("x-", "x+", "y-", "y+", "z-", "z+"), "velocity", VELOCITY)
    flow = FlowSettings(1.0, 1.0, element=element, scheme=scheme, initial_velocity=VELOCITY)  # type: ignore[arg-type]
    settings = SolverSettings(Tolerance(1e-6))
    fluid = Fluid(uniform([-1] * 3, [1] * 3, [cells] * 3), flow, [patch], [body], settings, comm=MPI.COMM_SELF)
    dt = END / steps
    fluid.initialise(0.0, dt)
    for number in range(steps):
        fluid.begin_step(number * dt, dt)
        fluid.solve()
        fluid.end_step()
    seconds = process_time() - begin
    side = np.linspace(-1.0, 1.0, 14)[1:-1]  # not at nodes, where errors are smaller
    x = np.stack(np.meshgrid(side, side, side), axis=-1).reshape(-1, 3)
    x = x[np.linalg.norm(x - points.mean(axis=0), axis=1) > 0.47]
    exact = np.stack([u(x.T, END) for u in VELOCITY], axis=1)
    at = (interpolation(fluid, fluid.unknowns.velocity, fluid.unknowns.degree, place) for place in x)
    off = np.array([weights @ fluid.flow[dofs] for dofs, weights in at]) - exact
    return {
        UNKNOWNS: fluid.dofs(),
        TIME: seconds,
        ERROR: 100.0 * float(np.sqrt((off**2).sum() / (exact**2).sum())),
    }
