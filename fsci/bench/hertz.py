"""Benchmark of Hertz contact in 3D: a quarter of an elastic ball is pressed onto a rigid plane in one load step.

Radius 100, E = 1000, nu = 0.3, contact radius 1 on a block of 16 x 16 x 16: small deformation, finite-deformation code.
Source of the solution: K. L. Johnson, Contact Mechanics (1985), chapter 4.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from time import perf_counter, process_time

import numpy as np
from mpi4py import MPI
from scipy.optimize import brentq

from coupling.contact_surfaces import contact_surface
from fsci import shapes
from fsci.bench.table import ERROR, TIME, UNKNOWNS, Row
from solvers.contact.contact import Contact
from solvers.contact.pair import Pair
from solvers.contact.surface import Surface
from solvers.mesh.mesh import Mesh
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings
from solvers.structure.body import Body, Support
from solvers.structure.elastic_constants import lame
from solvers.structure.field import Structure
from solvers.structure.materials import NeoHooke

Array = np.ndarray

RADIUS, E, NU, BLOCK = 100.0, 1000.0, 0.3, 16.0
#: Cells are equal up to here, which is beyond the edge of contact.
CORE = 1.25
#: Displacement of the top that gives a contact radius of 1.
PRESS = 0.00965


@dataclass(frozen=True)
class Found:
    """A solution, and Hertz' values for the force that it has."""

    structure: Structure
    contact: Contact
    wall: float  #: time of the load step [s]
    cpu: float  #: of this process [s]; the same on an idle machine
    newton: int  #: linear solves
    force: float  #: on the whole ball [N]
    radius: float  #: of contact, Hertz [m]
    peak: float  #: pressure in the middle, Hertz [Pa]
    pressure: Array  #: at the nodes of the slave surface [Pa]
    distance: Array  #: of these nodes from the axis [m]

    @property
    def peak_error(self) -> float:
        """Largest pressure relative to Hertz', minus 1."""
        return float(self.pressure.max() / self.peak - 1.0)

    @property
    def pressure_error(self) -> float:
        """L2 norm of the error of the pressure over that of the pressure, by nodal areas."""
        assert self.contact.terms is not None
        area = self.contact.terms.D[self.contact.nodes.of_surface[0]]
        exact = self.peak * np.sqrt(np.maximum(0.0, 1.0 - (self.distance / self.radius) ** 2))
        return float(np.sqrt(area @ (self.pressure - exact) ** 2 / (area @ exact**2)))


def graded(cells: int, outer: int) -> Array:
    """Places [m] from 0 to the size of the block: equal cells in the core, then ones that grow by a constant factor."""
    edge = CORE / cells
    powers = np.arange(1, outer + 1)
    factor = brentq(lambda q: edge * np.sum(q**powers) - (BLOCK - CORE), 1.0, 100.0)
    return np.concatenate([np.linspace(0.0, CORE, cells + 1), CORE + edge * np.cumsum(factor**powers)])


def quarter_ball(per_radius: int, outer: int, order: int = 1) -> Mesh:
    """Hexahedra, `per_radius` along the radius of contact; `outer` ones from there to the sides of the block."""
    cells = round(CORE * per_radius)
    across, up = graded(cells, outer), graded(max(2, cells), outer)
    unit = shapes.box([1, 1, 1], [len(across) - 1, len(across) - 1, len(up) - 1], order=order)
    index = np.rint(order * unit.points * (np.array([len(across)] * 2 + [len(up)]) - 1)) / order
    x, y, z = (np.interp(i, np.arange(len(to)), to) for i, to in zip(index.T, (across, across, up), strict=True))
    low = RADIUS - np.sqrt(RADIUS**2 - x**2 - y**2)
    return replace(unit, points=np.column_stack([x, y, low + (1.0 - low / BLOCK) * z]))


def solve(per_radius: int, outer: int, order: int = 1) -> Found:
    """Press the ball onto the plane in one step."""
    structure, contact = build(quarter_ball(per_radius, outer, order))
    structure.initialise(0.0, 1.0)
    start, start_cpu = perf_counter(), process_time()
    structure.begin_step(0.0, 1.0)
    info = structure.solve()
    structure.end_step()
    wall, cpu = perf_counter() - start, process_time() - start_cpu

    assert contact.terms is not None
    force = 4.0 * contact.resultant(0)[2]
    radius = (0.75 * force * RADIUS * (1.0 - NU**2) / E) ** (1.0 / 3.0)
    nodes = contact.nodes.of_surface[0]
    pressure = np.einsum("nd,nd->n", contact.z[nodes], contact.terms.normals[nodes])
    distance = np.linalg.norm(contact.x[nodes, :2], axis=1)
    peak = 1.5 * force / (np.pi * radius**2)
    return Found(structure, contact, wall, cpu, info.iterations, force, radius, peak, pressure, distance)


def build(mesh: Mesh) -> tuple[Structure, Contact]:
    """The ball with its planes of symmetry, and the plane, one facet."""
    supports = [
        Support("left", (0.0, None, None)),
        Support("front", (None, 0.0, None)),
        Support("top", (None, None, -PRESS)),
    ]
    body = Body("ball", mesh, NeoHooke(*lame(E, NU)), supports=supports, comm=MPI.COMM_SELF)
    slave = contact_surface([body], "ball", "bottom")
    corners = BLOCK * np.array([[-0.1, -0.1, 0], [1.1, -0.1, 0], [1.1, 1.1, 0], [-0.1, 1.1, 0]])
    plane = Surface("plane", corners, np.array([[0, 1, 2, 3]]), "quad", None)
    contact = Contact([Pair(slave, plane)], comm=MPI.COMM_SELF)
    solver = SolverSettings(Tolerance(residual=1e-10))
    return Structure([body], settings=solver, contact=contact), contact


def measure_step(per_radius: int, outer: int) -> Row:
    """One load step; the meshes of the family have the sizes of those measured with other programs."""
    found = solve(per_radius, outer)
    return {
        "cells per radius": per_radius,
        "dofs": found.structure.dofs(),
        "newton": found.newton,
        "wall [s]": found.wall,
        "cpu [s]": found.cpu,
        "peak error": found.peak_error,
        "pressure error (L2)": found.pressure_error,
    }


def measure(order: int, per_radius: int, outer: int) -> Row:
    """Error of the pressure (L2) and time of the load step."""
    found = solve(per_radius, outer, order)
    return {UNKNOWNS: found.structure.dofs(), TIME: found.cpu, ERROR: 100.0 * found.pressure_error}
