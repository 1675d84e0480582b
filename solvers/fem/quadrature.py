"""Points and weights of integrals over cells and facets of the reference configuration, as plain arrays."""

from __future__ import annotations

from dataclasses import dataclass, replace

import basix
import numpy as np
from dolfinx import fem
from numpy.typing import NDArray

from solvers.api import Array
from solvers.fem.domain import Domain
from solvers.fem.spaces import block_points, cell_blocks, quadrature_points, tabulate_lagrange
from solvers.mesh.cell_types import CELL_TYPES

#: Number of corners -> type of a facet.
FACETS = {2: basix.CellType.interval, 3: basix.CellType.triangle, 4: basix.CellType.quadrilateral}


@dataclass(frozen=True)
class Entities:
    """Cells, or facets with the same number in their cells: they share the tables of shape functions."""

    blocks: NDArray[np.int32]  #: local dof blocks of each entity, shape (entities, nodes)
    cells: NDArray[np.int32]  #: local cell of each entity, shape (entities,)
    shape: Array  #: shape functions at the points, shape (points, nodes)
    slopes: Array  #: their derivatives along the entity's own coordinates, shape (points, nodes, tangents)
    rule: Array  #: weights on the reference entity, shape (points,)
    positions: Array  #: points in the reference configuration [m], shape (3, entities * points)
    weights: Array  #: cells: volume, facets: area of each point [m^d], shape (entities, points)
    outward: Array  #: facets: 1 or -1, sign of the normal that `area_vectors` gives, shape (entities,)

    def area_vectors(self, x: Array) -> Array:
        """n dA/d(reference area) of facets with nodes at x [m], shape (blocks, dim) -> (entities, points, dim)."""
        return self.outward[:, None, None] * _normal(self.tangents(x))

    def tangents(self, x: Array) -> Array:
        """Derivatives of the position along the entity's own coordinates, shape (entities, points, dim, tangents)."""
        return np.einsum("pnk,end->epdk", self.slopes, x[self.blocks], optimize=True)


def cell_quadrature(domain: Domain, space: fem.FunctionSpace, degree: int) -> list[Entities]:
    """The cells that this process owns, with a rule that is exact to a polynomial degree on affine cells."""
    points, rule = quadrature_points(domain, degree)
    shape, slopes = tabulate_lagrange(domain, domain.degree, points)
    cells = np.arange(domain.mesh.topology.index_map(domain.dim).size_local, dtype=np.int32)
    blocks = cell_blocks(space)[cells]
    x = block_points(space)[: domain.dim].T
    jacobian = np.einsum("pnk,end->epdk", slopes, x[blocks], optimize=True)
    weights = rule * np.abs(np.linalg.det(jacobian))
    positions = _positions(space, blocks, shape)
    return [Entities(blocks, cells, shape, slopes, rule, positions, weights, np.ones(len(cells)))]


def facet_quadrature(domain: Domain, space: fem.FunctionSpace, surface: str, degree: int) -> list[Entities]:
    """The facets of a named surface that this process integrates over, by their numbers in their cells."""
    mesh, dim = domain.mesh, domain.dim
    facets = domain.surfaces[surface]
    mesh.topology.create_connectivity(dim, dim - 1)
    of_facet, of_cell = mesh.topology.connectivity(dim - 1, dim), mesh.topology.connectivity(dim, dim - 1)
    cells = np.array([of_facet.links(facet)[0] for facet in facets], dtype=np.int32)
    numbers = np.array([list(of_cell.links(c)).index(f) for c, f in zip(cells, facets, strict=True)], dtype=np.int32)
    return [_facets(domain, space, int(number), cells[numbers == number], degree) for number in np.unique(numbers)]


def _facets(domain: Domain, space: fem.FunctionSpace, number: int, cells: NDArray[np.int32], degree: int) -> Entities:
    """The facets with this number in the given cells."""
    cell_type = getattr(basix.CellType, CELL_TYPES[domain.cell_type].shape.name)
    element = basix.create_element(basix.ElementFamily.P, cell_type, domain.degree, basix.LagrangeVariant.gll_warped)
    corners = basix.geometry(cell_type)[basix.topology(cell_type)[domain.dim - 1][number]]
    local, rule = basix.make_quadrature(FACETS[len(corners)], degree)
    edges = corners[1 : domain.dim] - corners[0]  # of the reference facet, one for each of its coordinates
    shape, slopes = tabulate_lagrange(domain, domain.degree, corners[0] + local @ edges)

    x = block_points(space)[: domain.dim].T
    of_cells = cell_blocks(space)[cells]
    jacobian = np.einsum("nk,end->edk", slopes[0], x[of_cells], optimize=True)
    away = _normal(edges.T) @ basix.cell.facet_outward_normals(cell_type)[number]
    nodes = element.entity_closure_dofs[domain.dim - 1][number]
    blocks = of_cells[:, nodes]
    along = np.einsum("pnk,jk->pnj", slopes[:, nodes], edges)
    on_facet = Entities(
        blocks=blocks,
        cells=cells,
        shape=shape[:, nodes],
        slopes=along,
        rule=rule,
        positions=_positions(space, blocks, shape[:, nodes]),
        weights=np.empty(0),
        outward=np.sign(away) * np.sign(np.linalg.det(jacobian)),
    )
    area = rule * np.linalg.norm(on_facet.area_vectors(x), axis=2)
    return replace(on_facet, weights=area)


def _normal(tangents: Array) -> Array:
    """Normal of the size of the area that the tangents (..., dim, dim - 1) span; (dy, -dx) of an edge (dx, dy)."""
    if tangents.shape[-1] == 1:
        return np.stack([tangents[..., 1, 0], -tangents[..., 0, 0]], axis=-1)
    return np.cross(tangents[..., 0], tangents[..., 1])


def _positions(space: fem.FunctionSpace, blocks: NDArray[np.int32], shape: Array) -> Array:
    """Points in the reference configuration [m], shape (3, entities * points)."""
    return (shape @ block_points(space).T[blocks]).reshape(-1, 3).T
