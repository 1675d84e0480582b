"""From the `contact` section of a case to surfaces, pairs and the contact constraint."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from fsci.case import Case, CaseError
from fsci.case.contact import Pair as PairSettings
from fsci.case_meshes import read_obstacle
from solvers.blocks import Layout
from solvers.contact.contact import Contact
from solvers.contact.law.coulomb import Coulomb
from solvers.contact.law.frictionless import Frictionless
from solvers.contact.law.law import Law
from solvers.contact.law.tresca import Tresca
from solvers.contact.pair import Pair
from solvers.contact.surface import Surface
from solvers.mesh import Mesh
from solvers.mesh_topology import FACET_TYPE, surface_facets
from solvers.structure.body import Body
from solvers.structure.supports import prescribe, symmetric_dofs


def build_contact(case: Case, comm: MPI.Comm, bodies: Sequence[Body]) -> Contact:
    """All pairs of a case. Raises CaseError (collective)."""
    assert case.contact is not None
    layout = Layout(comm, [body.size for body in bodies])
    found: dict[tuple[str, ...], Surface] = {}
    pairs = []
    for settings in case.contact.pairs.values():
        sides = []
        for side in (settings.slave, settings.master):
            key = (side.body or "", *(side.on or ()), side.obstacle or "")
            if key not in found and side.obstacle is not None:
                found[key] = _obstacle(case, comm, side.obstacle)
            elif key not in found:
                found[key] = surface_of_body(comm, layout, bodies, side.body or "", *(side.on or ()))
            sides.append(found[key])
        pairs.append(Pair(sides[0], sides[1], settings.integration, _law(settings)))
    assert case.structure is not None
    moves = case.structure.dynamics is not None
    return Contact(comm, pairs, names=tuple(case.contact.pairs), c_n=case.contact.c_n, keep_overlap=moves)


def _law(settings: PairSettings) -> Law:
    if settings.friction.coefficient is not None:
        return Coulomb(settings.friction.coefficient)
    if settings.friction.bound is not None:
        return Tresca(settings.friction.bound)
    return Frictionless()


def surface_of_body(comm: MPI.Comm, layout: Layout, bodies: Sequence[Body], body_name: str, *names: str) -> Surface:
    """Named surfaces of a body as one, whole on every process."""
    index = next(i for i, body in enumerate(bodies) if body.name == body_name)
    body = bodies[index]
    mesh = body.domain.source
    points, facets, nodes = comm.bcast(None if mesh is None else _cut_out(mesh, names), root=0)
    dofs = global_dofs(comm, layout, index, body, nodes)
    start = layout.start + layout.offsets[index]
    return Surface(
        ".".join([body_name, *names]),
        points,
        facets,
        FACET_TYPE[body.domain.cell_type],
        dofs,
        held=_held(comm, start, body, dofs),
        symmetric=np.isin(dofs, np.concatenate(comm.allgather(start + symmetric_dofs(body)))),
        body=body_name,
        mesh_nodes=nodes,
    )


def _held(comm: MPI.Comm, start: int, body: Body, dofs: NDArray[np.int64]) -> NDArray[np.float64]:
    """Projections on what supports hold at nodes with these global dofs, shape (n, dim, dim) (collective)."""
    supports = prescribe(body)
    along_axes = np.isin(dofs, np.concatenate(comm.allgather(start + supports.dofs)))
    found = along_axes[:, :, None] * np.eye(body.dim)
    oblique = supports.oblique
    for first, projections in comm.allgather((start + body.dim * oblique.blocks, oblique.projections)):
        for dof, projection in zip(first, projections, strict=True):
            found[dofs[:, 0] == dof] = projection
    return found


def _cut_out(mesh: Mesh, names: Sequence[str]) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.int64]]:
    """(points, facets, node numbers in the mesh) of named surfaces; a facet that is in several counts once."""
    facets = np.concatenate([surface_facets(mesh, name) for name in names])
    facets = facets[np.sort(np.unique(facets, axis=0, return_index=True)[1])]
    nodes, local = np.unique(facets, return_inverse=True)
    return mesh.points[nodes], local.reshape(facets.shape).astype(np.int64), nodes


def global_dofs(comm: MPI.Comm, layout: Layout, index: int, body: Body, nodes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Global dofs of nodes of the mesh file, shape (n, dim) (collective)."""
    order = np.argsort(body.nodes[: body.owned])
    owned = body.nodes[: body.owned][order]
    at = np.minimum(np.searchsorted(owned, nodes), max(len(owned) - 1, 0))
    mine = owned[at] == nodes if len(owned) else np.zeros(len(nodes), dtype=bool)
    first = np.zeros(len(nodes), dtype=np.int64)
    first[mine] = layout.start + layout.offsets[index] + body.dim * order[at[mine]]
    return comm.allreduce(first)[:, None] + np.arange(body.dim)


def _obstacle(case: Case, comm: MPI.Comm, name: str) -> Surface:
    """A rigid surface, whole on every process."""
    assert case.contact is not None
    settings = case.contact.obstacles[name]
    found, error = None, None
    if comm.rank == 0:
        try:
            mesh = read_obstacle(case, name)
            found = (*_cut_out(mesh, settings.on)[:2], FACET_TYPE[mesh.cell_type])
        except CaseError as problem:
            error = problem
    error = comm.bcast(error, root=0)
    if error is not None:
        raise error
    points, facets, facet_type = comm.bcast(found, root=0)
    motion = None
    if settings.motion is not None:
        displacement = settings.motion

        def motion(t: float) -> NDArray[np.float64]:
            return points + np.stack([component(points.T, t) for component in displacement], axis=1)

    return Surface(name, points, facets, facet_type, None, motion=motion)
