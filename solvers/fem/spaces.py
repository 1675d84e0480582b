"""Finite element spaces, and the nodes and cells of their dofs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import basix
import numpy as np
from dolfinx import fem
from numpy.typing import NDArray

from solvers.api import Array
from solvers.fem.calls import calls
from solvers.fem.compiling import compiling
from solvers.fem.domain import Domain, input_nodes
from solvers.fem.forms import COMPILE_OPTIONS
from solvers.mesh.cell_types import CELL_TYPES


def cell_of(domain: Domain) -> str:
    """UFL's name of the cells."""
    return CELL_TYPES[domain.cell_type].shape.name


def _space(domain: Domain, element: Any) -> Any:
    with compiling("an element"):
        return calls.function_space(domain.mesh, element, COMPILE_OPTIONS)


def vector_space(domain: Domain) -> Any:
    """Isoparametric vector Lagrange space: one dof block per node."""
    return _space(domain, calls.lagrange_element(cell_of(domain), domain.degree, (domain.dim,)))


def scalar_space(domain: Domain) -> Any:
    """Isoparametric scalar Lagrange space: one dof per node."""
    return _space(domain, calls.lagrange_element(cell_of(domain), domain.degree))


def cellwise_space(domain: Domain) -> Any:
    """Space of piecewise constants: one number per cell."""
    return _space(domain, calls.discontinuous_element(cell_of(domain), 0))


def pressure_space(domain: Domain) -> Any:
    """Discontinuous scalars: constant in first-order cells, linear in second-order cells."""
    return _space(domain, calls.discontinuous_element(cell_of(domain), domain.degree - 1))


def broken_space(domain: Domain) -> Any:
    """Scalars with values of their own at the nodes of each cell."""
    return _space(domain, calls.broken_element(cell_of(domain), domain.degree))


def flow_space(domain: Domain, velocity_degree: int) -> Any:
    """Velocity and pressure as one function with dim + 1 components, pressure last and of first degree.

    Equal order: one block of dim + 1 unknowns per node, side by side in the matrix; otherwise a mixed element.
    """
    cell = cell_of(domain)
    if velocity_degree == 1:
        element = calls.lagrange_element(cell, 1, (domain.dim + 1,))
    else:
        velocity = calls.lagrange_element(cell, velocity_degree, (domain.dim,))
        element = calls.mixed_element([velocity, calls.lagrange_element(cell, 1)])
    return _space(domain, element)


def cell_blocks(space: Any) -> NDArray[np.int32]:
    """Local dof blocks of each local cell, shape (cells, blocks per cell); a process may have no cells."""
    return calls.cell_blocks(space)


def identify_blocks(
    space: Any, blocks: NDArray[np.int32], masters: NDArray[np.int64], owners: NDArray[np.int32]
) -> tuple[Any, NDArray[np.int32]]:
    """A space with other dof blocks in the place of some: (space, its number of each local block) (collective).

    `blocks` are local; `masters` are the global numbers of what replaces them, and `owners` the processes that own
    these; the master of a master is itself. Replaced blocks are no unknowns of the new space: those after them move up.
    """
    dofmap = space.dofmap
    index_map = dofmap.index_map
    first, last = index_map.local_range
    number = np.concatenate([np.arange(first, last), np.asarray(index_map.ghosts, dtype=np.int64)])
    own, before = last - first, number.copy()
    number[blocks] = masters
    replaced = np.flatnonzero(number[:own] != before[:own])
    gone = np.concatenate(space.mesh.comm.allgather(first + replaced))  # in ascending order, as processes are
    owner = np.concatenate([np.full(own, -1, dtype=np.int32), np.asarray(index_map.owners, dtype=np.int32)])
    owner[blocks] = owners
    elsewhere = (number < first) | (number >= last)
    ghosts, example, of_ghosts = np.unique(number[elsewhere], return_index=True, return_inverse=True)
    kept = own - len(replaced)
    place = np.empty(len(number), dtype=np.int32)
    place[~elsewhere] = number[~elsewhere] - first - np.searchsorted(first + replaced, number[~elsewhere])
    place[elsewhere] = kept + of_ghosts
    found = calls.replace_dofs(
        space, place[cell_blocks(space)], kept, ghosts - np.searchsorted(gone, ghosts), owner[elsewhere][example]
    )
    return found, place


def component_dofs(
    domain: Domain, space: Any, components: Sequence[int], degree: int
) -> tuple[NDArray[np.int32], Array]:
    """Local unrolled dofs (nodes, components) of components of a `flow_space` on straight cells, and their points.

    `degree`: of the components. Points [m] have the shape (nodes, dim); owned nodes come first.
    """
    if space.dofmap.index_map_bs > 1:
        points = space.tabulate_dof_coordinates()[:, : domain.dim]
        blocks = np.arange(len(points), dtype=np.int32) * space.dofmap.index_map_bs
        return blocks[:, None] + np.asarray(components, dtype=np.int32), points
    # not DOLFINx's `collapse`, which fails on a process without cells
    by_cell = [component_cell_dofs(space, component) for component in components]
    _, place = np.unique(by_cell[0], return_index=True)
    cell = getattr(basix.CellType, CELL_TYPES[domain.cell_type].shape.name)
    element = basix.create_element(basix.ElementFamily.P, cell, degree, basix.LagrangeVariant.gll_warped)
    shapes, _ = tabulate_lagrange(domain, 1, element.points)
    corners = domain.mesh.geometry.x[calls.geometry_nodes(domain.mesh)].reshape(-1, shapes.shape[1], 3)
    points = np.einsum("qa,cai->cqi", shapes, corners[:, :, : domain.dim]).reshape(-1, domain.dim)
    return np.stack([dofs.ravel()[place] for dofs in by_cell], axis=1), points[place]


def component_cell_dofs(space: Any, component: int) -> NDArray[np.int32]:
    """Local dofs of one component of a `flow_space` in each local cell, in the order of the scalar element."""
    if space.dofmap.index_map_bs > 1:
        part = space.sub(component)
    else:
        part = space.sub(0).sub(component) if component < space.mesh.geometry.dim else space.sub(1)
    return cell_blocks(part)


def tabulate_lagrange(domain: Domain, degree: int, points: Array) -> tuple[Array, Array]:
    """Scalar shape functions (points, functions) and their reference gradients (points, functions, dim)."""
    element = basix.create_element(
        basix.ElementFamily.P,
        getattr(basix.CellType, CELL_TYPES[domain.cell_type].shape.name),
        degree,
        basix.LagrangeVariant.gll_warped,
    )
    table = element.tabulate(1, points)[..., 0]
    return table[0], np.moveaxis(table[1:], 0, -1)


def node_steps(domain: Domain, degree: int) -> NDArray[np.int64]:
    """From the first corner of a cell to its nodes of degree 1 or 2 in their lattice, shape (functions, dim)."""
    cell = getattr(basix.CellType, CELL_TYPES[domain.cell_type].shape.name)
    element = basix.create_element(basix.ElementFamily.P, cell, degree, basix.LagrangeVariant.gll_warped)
    return np.rint(degree * element.points).astype(np.int64)


def facet_dofs(space: Any, component: int, facets: NDArray[np.int32]) -> NDArray[np.int32]:
    """Local dofs of one component of a `flow_space` on facets, on every process that knows them (collective)."""
    dim = space.mesh.topology.dim
    if space.dofmap.index_map_bs > 1:
        blocks = fem.locate_dofs_topological(space, dim - 1, facets)
        return np.asarray(blocks, dtype=np.int32) * space.dofmap.index_map_bs + component
    part = space.sub(0).sub(component) if component < dim else space.sub(1)
    return np.asarray(fem.locate_dofs_topological(part, dim - 1, facets), dtype=np.int32)


def quadrature_space(domain: Domain, degree: int, shape: tuple[int, ...] = ()) -> Any:
    """Values at the points of the quadrature rule of a degree; shape () for scalars, (n,) vectors, (n, m) tensors."""
    return _space(domain, calls.quadrature_element(cell_of(domain), degree, shape))


def quadrature_points(domain: Domain, degree: int) -> tuple[Array, Array]:
    """(points of shape (n, dim), weights) on the reference cell that a measure of this degree uses."""
    return basix.make_quadrature(getattr(basix.CellType, CELL_TYPES[domain.cell_type].shape.name), degree)


def function(space: Any) -> fem.Function:
    """A finite element function, zero at first."""
    return fem.Function(space)


def node_of_block(domain: Domain, space: Any) -> NDArray[np.int64]:
    """Mesh-file number of the node behind each local dof block (owned blocks first, then ghosts)."""
    blocks = cell_blocks(space)
    geometry = calls.geometry_nodes(domain.mesh).reshape(blocks.shape)
    nodes = np.full(space.dofmap.index_map.size_local + space.dofmap.index_map.num_ghosts, -1, dtype=np.int64)
    nodes[blocks] = input_nodes(domain)[geometry]
    return nodes


def surface_blocks(domain: Domain, space: Any, name: str) -> NDArray[np.int32]:
    """Local dof blocks on a named surface, on every process that knows the node (a collective call)."""
    return fem.locate_dofs_topological(space, domain.mesh.topology.dim - 1, domain.surfaces[name])


def node_heights(domain: Domain, space: Any) -> Array:
    """Height [m] of the flattest cell at each local dof block: the least stretch of its map from the reference cell."""
    record = CELL_TYPES[domain.cell_type]
    middle = record.reference_nodes[: record.corners].mean(axis=0, keepdims=True)
    slopes = tabulate_lagrange(domain, domain.degree, middle)[1][0]
    nodes = calls.geometry_nodes(domain.mesh).reshape(-1, len(slopes))
    maps = np.einsum("cni,nk->cik", domain.mesh.geometry.x[nodes, : domain.dim], slopes)
    heights = np.full(space.dofmap.index_map.size_local + space.dofmap.index_map.num_ghosts, np.inf)
    np.minimum.at(heights, cell_blocks(space), np.linalg.svd(maps, compute_uv=False)[:, -1:])
    return heights


def block_points(space: Any) -> Array:
    """Reference position of each local dof block, shape (3, blocks)."""
    return np.ascontiguousarray(space.tabulate_dof_coordinates().T)
