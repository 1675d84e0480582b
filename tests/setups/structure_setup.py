"""Meshes and structures that several tests use."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from mpi4py import MPI

from fsci import shapes
from solvers.mesh.cell_types import reference_nodes
from solvers.mesh.mesh import Mesh
from solvers.newton import Tolerance
from solvers.solver_settings import SolverSettings
from solvers.structure.body import Body, Support
from solvers.structure.field import Structure
from solvers.structure.time_scheme import Statics

CELL_TYPES = ("triangle", "triangle6", "quad", "quad9", "tetra", "tetra10", "hexahedron", "hexahedron27")
TIGHT = SolverSettings(Tolerance(residual=1e-13), linear="direct")


def constant(number: float):
    """A load or displacement that is the same everywhere and always."""
    return lambda x, t: np.full(x.shape[1], float(number))


def vector(*numbers: float):
    return tuple(constant(number) for number in numbers)


def block(cell_type: str, cells: int) -> Mesh:
    """The unit square or cube."""
    cell = {"tria": "tri", "quad": "quad", "tetr": "tet", "hexa": "hex"}[cell_type[:4]]
    order = 1 if cell_type in ("triangle", "quad", "tetra", "hexahedron") else 2
    if cell in ("tri", "quad"):
        return shapes.rectangle([1, 1], [cells, cells], order=order, cell=cell)
    return shapes.box([1, 1, 1], [cells, cells, cells], order=order, cell=cell)


def distort(mesh: Mesh, size: float, seed: int = 1) -> Mesh:
    """Move the inner corners at random by up to `size`; the other nodes follow, so that edges stay straight."""
    rng = np.random.default_rng(seed)
    corners = np.unique(mesh.cells[:, : corner_count(mesh)])
    inner = corners[np.all((mesh.points[corners] > 1e-9) & (mesh.points[corners] < 1 - 1e-9), axis=1)]
    points = mesh.points.copy()
    points[inner] += rng.uniform(-size, size, (len(inner), points.shape[1]))
    weights = corner_shape_functions(mesh)
    moved = np.einsum("nc,kcd->knd", weights, points[mesh.cells[:, : weights.shape[1]]])
    points[mesh.cells] = moved
    return replace(mesh, points=points)


def corner_count(mesh: Mesh) -> int:
    return {"tria": 3, "quad": 4, "tetr": 4, "hexa": 8}[mesh.cell_type[:4]]


def corner_shape_functions(mesh: Mesh) -> np.ndarray:
    """Linear shape functions of the corners at all nodes of a cell, shape (nodes, corners)."""
    nodes = reference_nodes(mesh.cell_type)
    corners = nodes[: corner_count(mesh)]
    if mesh.cell_type[:4] in ("tria", "tetr"):
        return np.column_stack([1 - nodes.sum(axis=1), nodes])
    return np.prod(np.where(corners[None] == 1, nodes[:, None], 1 - nodes[:, None]), axis=2)


def make_structure(mesh: Mesh, material, *, time=None, settings=TIGHT, comm=MPI.COMM_SELF, **loads) -> Structure:
    """A structure of one body."""
    return Structure([Body("body", mesh, material, **loads, comm=comm)], time or Statics(), settings)


def held_everywhere(mesh: Mesh, displacement) -> list[Support]:
    """The whole boundary follows displacement(component)(x, t)."""
    dim = mesh.points.shape[1]
    return [Support(name, tuple(displacement(i) for i in range(dim))) for name in mesh.surfaces]


def load_step(structure: Structure):
    """From zero to time 1 in one step."""
    structure.initialise(0.0, 1.0)
    structure.begin_step(0.0, 1.0)
    info = structure.solve()
    structure.end_step()
    return info
