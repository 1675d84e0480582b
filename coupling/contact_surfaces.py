"""Contact surfaces of elastic bodies: facets, dofs, and the components that supports prescribe."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from solvers.algebra.blocks import Layout
from solvers.contact.surface import Surface
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.topology import cut_out
from solvers.structure.body import Body
from solvers.structure.supports import prescribe, symmetric_dofs


def contact_surface(bodies: Sequence[Body], body: str, *surfaces: str) -> Surface:
    """Named surfaces of one body of a structure as one contact surface, the same on every process (collective).

    bodies: all bodies of the structure, in the order in which their dofs are numbered.
    """
    mesh = next(other for other in bodies if other.name == body).domain.source
    facets = None
    if mesh is not None:
        _, local, nodes = cut_out(mesh, surfaces)
        facets = nodes[local]
    return contact_surface_of(bodies, body, ".".join([body, *surfaces]), facets)


def contact_surface_of(bodies: Sequence[Body], body: str, name: str, facets: NDArray[np.int64] | None) -> Surface:
    """Facets of one body, given by the numbers of all their nodes in its mesh on rank 0, as a contact surface.

    As `contact_surface` (collective).
    """
    index = next(i for i, other in enumerate(bodies) if other.name == body)
    chosen, comm = bodies[index], bodies[index].domain.comm
    layout = Layout(comm, [other.size for other in bodies])
    mesh, found = chosen.domain.source, None
    if mesh is not None and facets is not None:
        nodes, local = np.unique(facets, return_inverse=True)
        found = mesh.points[nodes], local.reshape(facets.shape).astype(np.int64), nodes, mesh.unmoved
    points, local, nodes, unmoved = comm.bcast(found, root=0)
    dofs = global_dofs(layout, index, chosen, nodes)
    start = layout.start + layout.offsets[index]
    return Surface(
        name,
        points,
        local,
        CELL_TYPES[chosen.domain.cell_type].facet,
        dofs,
        held=_held(comm, start, chosen, dofs),
        symmetric=np.isin(dofs, np.concatenate(comm.allgather(start + symmetric_dofs(chosen)))),
        body=body,
        mesh_nodes=nodes,
        unmoved=None if unmoved is None else unmoved[nodes],
    )


def _held(comm: MPI.Comm, start: int, body: Body, dofs: NDArray[np.int64]) -> NDArray[np.float64]:
    """Projections on prescribed components at nodes with these global dofs, shape (n, dim, dim) (collective)."""
    supports = prescribe(body)
    along_axes = np.isin(dofs, np.concatenate(comm.allgather(start + supports.dofs)))
    found = along_axes[:, :, None] * np.eye(body.dim)
    oblique = supports.oblique
    for first, projections in comm.allgather((start + body.dim * oblique.blocks, oblique.projections)):
        for dof, projection in zip(first, projections, strict=True):
            found[dofs[:, 0] == dof] = projection
    return found


def global_dofs(layout: Layout, index: int, body: Body, nodes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Global dofs of nodes of the mesh of body `index`, shape (n, dim) (collective)."""
    order = np.argsort(body.nodes[: body.owned])
    owned = body.nodes[: body.owned][order]
    at = np.minimum(np.searchsorted(owned, nodes), max(len(owned) - 1, 0))
    mine = owned[at] == nodes if len(owned) else np.zeros(len(nodes), dtype=bool)
    first = np.zeros(len(nodes), dtype=np.int64)
    first[mine] = layout.start + layout.offsets[index] + body.dim * order[at[mine]]
    return layout.comm.allreduce(first)[:, None] + np.arange(body.dim)
