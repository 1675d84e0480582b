"""Values at material points, at the nodes and in the cells of a body."""

from __future__ import annotations

import basix
import numpy as np
from dolfinx import fem
from dolfinx import mesh as dolfinx_mesh
from mpi4py import MPI

from solvers.api import Array
from solvers.fem.domain import CELLS, Domain
from solvers.fem.ghosts import accumulate
from solvers.fem.spaces import function, scalar_space


def locate_point(domain: Domain, point: Array) -> tuple[int, Array] | None:
    """(local cell, reference coordinates) of a material point on the one process that answers for it, else None.

    Collective. Points up to 1e-8 of the body's size outside still count as inside.
    """
    from dolfinx import geometry

    mesh, x = domain.mesh, np.zeros(3)
    x[: len(point)] = point
    size = domain.comm.allreduce(float(np.ptp(mesh.geometry.x, axis=0).max(initial=0.0)), op=MPI.MAX)
    tree = geometry.BoundingBoxTree(mesh, mesh.topology.dim, padding=1e-8 * size)
    candidates = geometry.compute_collisions(tree, x[None, :])
    cells = np.asarray(candidates.links(0))
    owned = mesh.topology.index_map(mesh.topology.dim).size_local
    best: tuple[float, int] = (np.inf, -1)
    for cell in cells[cells < owned]:
        nodes = mesh.geometry.dofmap.links(cell)
        distance = float(np.linalg.norm(geometry.compute_distance_gjk(x[None, :], mesh.geometry.x[nodes])))
        best = min(best, (distance, int(cell)))
    distance, rank = domain.comm.allreduce((best[0], domain.comm.rank), op=MPI.MINLOC)
    if not distance <= 1e-6 * size or rank != domain.comm.rank:
        return None
    nodes = mesh.geometry.dofmap.links(best[1])
    reference = mesh.geometry.cmap.pull_back(x[None, : domain.dim], mesh.geometry.x[nodes][:, : domain.dim])
    return best[1], reference[0]


def tabulate(domain: Domain, reference: Array) -> Array:
    """Shape functions of the displacement at a reference point, in the order of the cell's dof blocks."""
    name, degree = CELLS[domain.cell_type]
    element = basix.create_element(
        basix.ElementFamily.P, getattr(basix.CellType, name), degree, basix.LagrangeVariant.gll_warped
    )
    return element.tabulate(0, reference[None, :])[0, 0, :, 0]


def evaluate_cells(domain: Domain, expression: fem.Expression) -> Array:
    """Values at the expression's points in all owned cells, shape (cells, points * components)."""
    cells = np.arange(domain.mesh.topology.index_map(domain.dim).size_local, dtype=np.int32)
    return expression.eval(cells)


def average_at_nodes(domain: Domain, expression: fem.Expression, *, components: int) -> Array:
    """Mean over the adjacent cells of an expression compiled at `reference_nodes`, shape (local nodes, components)."""
    space = scalar_space(domain)
    values = evaluate_cells(domain, expression)
    values = values.reshape(len(values), -1, components)
    blocks = space.dofmap.list.array.reshape(-1, values.shape[1])[: len(values)]
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
    name, degree = CELLS[domain.cell_type]
    return basix.create_element(
        basix.ElementFamily.P, getattr(basix.CellType, name), degree, basix.LagrangeVariant.equispaced
    ).points


def cell_midpoints(domain: Domain) -> Array:
    """Reference position of the middle of each local cell, shape (3, cells)."""
    index_map = domain.mesh.topology.index_map(domain.dim)
    cells = np.arange(index_map.size_local + index_map.num_ghosts, dtype=np.int32)
    return dolfinx_mesh.compute_midpoints(domain.mesh, domain.dim, cells).T
