"""Distributed meshes: cells, facets, named surfaces, and their numbers in the mesh file."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeAlias

import basix
import numpy as np
from dolfinx import mesh as dolfinx_mesh
from mpi4py import MPI
from numpy.typing import NDArray

from solvers.api import Array
from solvers.fem.calls import calls
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.mesh import Mesh

#: (processes, offsets of the first one of each cell); on rank 0, empty on others.
Destinations: TypeAlias = tuple[NDArray[np.int32], NDArray[np.int32]]


def vtk_from_basix(cell_type: str) -> NDArray[np.int64]:
    """Permutation p with nodes_vtk = nodes_basix[p]."""
    record = CELL_TYPES[cell_type]
    shape = getattr(basix.CellType, record.shape.name)
    element = basix.create_element(basix.ElementFamily.P, shape, record.degree, basix.LagrangeVariant.equispaced)
    # matching positions gives the permutation of any version
    distance = np.linalg.norm(record.reference_nodes[:, None, :] - element.points[None, :, :], axis=2)
    return np.argmin(distance, axis=1)


@dataclass(frozen=True)
class Domain:
    """A distributed mesh and what is needed to find its nodes again."""

    mesh: dolfinx_mesh.Mesh
    cell_type: str
    degree: int
    nodes: int  #: nodes of the whole mesh
    surfaces: dict[str, NDArray[np.int32]] = field(default_factory=dict)  #: name -> local exterior facets, sorted
    source: Mesh | None = None  #: rank 0 only: the whole mesh
    axis_aligned: bool = False  #: edges of cells lie along the axes; a form may then be compiled for such cells

    @property
    def comm(self) -> MPI.Comm:
        return self.mesh.comm

    @property
    def dim(self) -> int:
        return self.mesh.geometry.dim


def distribute(
    comm: MPI.Comm, mesh: Mesh | None, *, axis_aligned: bool = False, destinations: Destinations | None = None
) -> Domain:
    """Distribute a mesh that rank 0 holds (other ranks pass None).

    axis_aligned: edges of its cells lie along the axes. destinations: processes of each cell, its owner first, and
    offsets; by the graph of cells if None.
    """
    header = comm.bcast(None if mesh is None else (mesh.cell_type, mesh.points.shape, mesh.surfaces), root=0)
    cell_type, (nodes, dim), named = header
    record = CELL_TYPES[cell_type]
    vtk = vtk_from_basix(cell_type)
    if mesh is not None:
        cells, points = np.ascontiguousarray(mesh.cells[:, np.argsort(vtk)], dtype=np.int64), mesh.points
    else:
        cells, points = np.empty((0, len(vtk)), dtype=np.int64), np.empty((0, dim))
    distributed = calls.create_mesh(comm, cells, points, record.shape.name, record.degree, destinations)
    domain = Domain(distributed, cell_type, record.degree, nodes, source=mesh, axis_aligned=axis_aligned)
    return Domain(**{**vars(domain), "surfaces": _find_surfaces(domain, named)})


def _find_surfaces(domain: Domain, named: dict[str, NDArray[np.int64]]) -> dict[str, NDArray[np.int32]]:
    """Local facets of each named surface, found by their corner nodes (whatever the facet's node order)."""
    if not named:
        return {}
    mesh = domain.mesh
    dim = mesh.topology.dim
    mesh.topology.create_connectivity(dim - 1, dim)
    exterior = np.sort(exterior_facets(domain))
    corners = input_nodes(domain)[calls.facet_nodes(mesh, exterior)]
    corners = np.sort(corners.reshape(len(exterior), CELL_TYPES[CELL_TYPES[domain.cell_type].facet].corners), axis=1)
    facet_of = {tuple(corner): facet for corner, facet in zip(corners.tolist(), exterior, strict=True)}
    found = {}
    for name, facets in named.items():
        local = (facet_of.get(tuple(facet)) for facet in np.sort(facets, axis=1).tolist())
        found[name] = np.sort(np.array([f for f in local if f is not None], dtype=np.int32))
    return found


def exterior_facets(domain: Domain) -> NDArray[np.int32]:
    """Local numbers of the facets on the boundary of the body that this process integrates over."""
    mesh = domain.mesh
    mesh.topology.create_entities(mesh.topology.dim - 1)
    mesh.topology.create_connectivity(mesh.topology.dim - 1, mesh.topology.dim)
    return calls.exterior_facets(mesh)


def input_nodes(domain: Domain) -> NDArray[np.int64]:
    """Number in the mesh file of each local geometry node."""
    return np.asarray(domain.mesh.geometry.input_global_indices, dtype=np.int64)


def input_cells(domain: Domain) -> NDArray[np.int64]:
    """Number in the mesh file of each local cell (ghosts last)."""
    return np.asarray(domain.mesh.topology.original_cell_index, dtype=np.int64)


def owned_cells(domain: Domain) -> int:
    """Count of the local cells that this process owns; they come first."""
    return int(domain.mesh.topology.index_map(domain.dim).size_local)


def _facet_cells(domain: Domain) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """(offsets, cells) of the cells at each local facet."""
    topology = domain.mesh.topology
    topology.create_entities(domain.dim - 1)
    topology.create_connectivity(domain.dim - 1, domain.dim)
    links = topology.connectivity(domain.dim - 1, domain.dim)
    return np.asarray(links.offsets, dtype=np.int32), np.asarray(links.array, dtype=np.int32)


def interior_facets(domain: Domain) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """(local facets with two local cells, those cells of shape (facets, 2))."""
    offsets, cells = _facet_cells(domain)
    facets = np.flatnonzero(np.diff(offsets) == 2).astype(np.int32)
    return facets, np.stack([cells[offsets[facets]], cells[offsets[facets] + 1]], axis=1)


def boundary_facets(domain: Domain) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """(local facets on the boundary of the mesh that this process integrates over, the cell of each)."""
    facets = np.sort(exterior_facets(domain))
    offsets, cells = _facet_cells(domain)
    return facets, cells[offsets[facets]]


def facet_midpoints(domain: Domain, facets: NDArray[np.int32]) -> Array:
    """Midpoints [m] of facets, shape (facets, dim)."""
    if len(facets) == 0:
        return np.empty((0, domain.dim))
    return dolfinx_mesh.compute_midpoints(domain.mesh, domain.dim - 1, facets)[:, : domain.dim]
