"""Values at material points, at the nodes and in the cells of a body."""

from __future__ import annotations

from typing import Any

import basix
import numpy as np
from dolfinx import fem
from dolfinx import mesh as dolfinx_mesh

from solvers.api import Array
from solvers.fem.calls import calls
from solvers.fem.domain import Domain, input_cells, owned_cells
from solvers.fem.ghosts import accumulate
from solvers.fem.spaces import cell_blocks, function
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.locate import locate


def locate_point(domain: Domain, point: Array) -> tuple[int, Array] | None:
    """(local cell, reference coordinates) of a material point on the one process that owns the cell, else None.

    Collective. None everywhere if the point is not in the body.
    """
    found = None if domain.source is None else locate(domain.source, point)
    found = domain.comm.bcast(found, root=0)
    if found is None:
        return None
    cell, reference = found
    local = np.flatnonzero(input_cells(domain)[: owned_cells(domain)] == cell)
    return (int(local[0]), reference) if len(local) else None


def tabulate(domain: Domain, reference: Array) -> Array:
    """Shape functions of the displacement at a reference point, in the order of the cell's dof blocks."""
    name = CELL_TYPES[domain.cell_type].shape.name
    element = basix.create_element(
        basix.ElementFamily.P, getattr(basix.CellType, name), domain.degree, basix.LagrangeVariant.gll_warped
    )
    return element.tabulate(0, reference[None, :])[0, 0, :, 0]


def evaluate_cells(domain: Domain, expression: fem.Expression) -> Array:
    """Values at the expression's points in all owned cells, shape (cells, points * components)."""
    cells = np.arange(domain.mesh.topology.index_map(domain.dim).size_local, dtype=np.int32)
    return calls.evaluate(expression, domain.mesh, cells)


def average_at_nodes(domain: Domain, space: Any, expression: fem.Expression, *, components: int) -> Array:
    """Mean over the adjacent cells of an expression compiled at `reference_nodes`, shape (local nodes, components).

    `space`: a `scalar_space` of the domain.
    """
    values = evaluate_cells(domain, expression)
    blocks = cell_blocks(space)[: len(values)]
    values = values.reshape(*blocks.shape, components)
    total = function(space)
    mean = np.empty((len(total.x.array), components))
    for component in range(-1, components):
        total.x.array[:] = 0.0
        np.add.at(total.x.array, blocks, 1.0 if component < 0 else values[:, :, component])
        accumulate(total)
        total.x.scatter_forward()
        if component < 0:
            count = total.x.array.copy()
        else:
            mean[:, component] = total.x.array / count
    return mean


def reference_nodes(domain: Domain) -> Array:
    """Reference coordinates of a cell's nodes, in the order of its dof blocks."""
    name = CELL_TYPES[domain.cell_type].shape.name
    return basix.create_element(
        basix.ElementFamily.P, getattr(basix.CellType, name), domain.degree, basix.LagrangeVariant.equispaced
    ).points


def cell_midpoints(domain: Domain) -> Array:
    """Reference position of the middle of each local cell, shape (3, cells)."""
    index_map = domain.mesh.topology.index_map(domain.dim)
    cells = np.arange(index_map.size_local + index_map.num_ghosts, dtype=np.int32)
    return dolfinx_mesh.compute_midpoints(domain.mesh, domain.dim, cells).T
