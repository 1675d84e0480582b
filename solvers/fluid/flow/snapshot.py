"""Snapshots of the flow for files and pictures: cells with fluid, and the surfaces of bodies at their positions."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from solvers.api import Array, Snapshot
from solvers.fluid.flow.field import Fluid
from solvers.mesh.distributed import Nodal, gather_nodal
from solvers.mesh.tessellation import tangential, vertex_shares


def snapshots(fluid: Fluid, forces: Mapping[str, Array] | None = None) -> list[Snapshot]:
    """Snapshots of the flow and of each body on rank 0, an empty list on others (collective).

    forces: those of `surface_forces`, if they are known already.
    """
    flow, bodies = _flow(fluid), _bodies(fluid, surface_forces(fluid) if forces is None else forces)
    return [] if flow is None else [flow, *bodies]


def surface_forces(fluid: Fluid) -> dict[str, Array]:
    """Force [N] of the flow on the vertices of each body, zero before the first step (collective)."""
    if fluid.bodies and fluid.started:
        return fluid.force()
    return {name: np.zeros_like(x) for name, x in fluid.moving.surfaces.by_name(fluid.cut.motion.x).items()}


def _flow(fluid: Fluid) -> Snapshot | None:
    """Velocity and pressure at the corners of all cells with fluid; other nodes of q2q1 are left out.

    Corners inside of bodies have the values of the smooth extension, so that pictures are correct up to the surface.
    """
    unknowns, grid = fluid.unknowns, fluid.grid
    velocity, pressure = (
        gather_nodal(fluid.comm, Nodal(fluid.flow[nodes.dofs[: nodes.owned]], nodes.consecutive[: nodes.owned]))
        for nodes in (unknowns.velocity, unknowns.pressure)
    )
    share = np.zeros(len(grid.numbers))
    wet = np.concatenate([fluid.cut.uncut, fluid.cut.cut])
    share[wet] = np.maximum(fluid.cut.fraction[wet], np.finfo(float).tiny)
    shares = gather_nodal(fluid.comm, Nodal(share[: grid.owned, None], grid.original[: grid.owned]))
    if velocity is None or pressure is None or shares is None:
        return None
    mesh = grid.grid.mesh() if grid.nested is None else grid.nested.picture()
    place = np.arange(len(mesh.cells))
    if grid.sheets is not None:
        copied = grid.sheets.cells
        place = np.concatenate([place, copied if grid.nested is None else grid.nested.cell_of[copied]])
    fraction = np.bincount(place, shares[:, 0])[:, None]
    active = fraction[:, 0] > 0.0
    nodes, cells = np.unique(mesh.cells[active], return_inverse=True)
    at_corners = [values[_corners(fluid, degree)] for values, degree in ((velocity, unknowns.degree), (pressure, 1))]
    fields = {"velocity": _in_space(at_corners[0][nodes]), "pressure": at_corners[1][nodes, 0]}
    cells = cells.reshape(-1, mesh.cells.shape[1])
    inside = {"fluid_fraction": fraction[active, 0]}
    return Snapshot("fluid", _in_space(mesh.points[nodes]), cells, mesh.cell_type, fields, inside)


def _corners(fluid: Fluid, degree: int) -> np.ndarray:
    """Index of each corner of the cells, x fastest, among the nodes of a degree."""
    if (nested := fluid.grid.nested) is not None:
        return np.searchsorted(nested.all_nodes(degree), nested.corners(degree))
    counts = fluid.unknowns.lattice_shape(degree)
    lattice = np.arange(int(np.prod(counts))).reshape(counts, order="F")
    indices = [
        degree * np.arange(n + 1) % count for n, count in zip(fluid.grid.grid.shape, counts, strict=True)
    ]  # fmt: skip
    return lattice[np.ix_(*indices)].ravel(order="F")


def _bodies(fluid: Fluid, forces: Mapping[str, Array]) -> list[Snapshot]:
    """Rigid surfaces with their velocity, and traction and wall shear stress of the fluid (zero before the first step).

    Elastic bodies are in the snapshots of the structure.
    """
    found, start = [], 0
    for body in fluid.bodies:
        surface, dim = body.surface, fluid.dim
        part = slice(start, start + surface.vertices)
        start = part.stop
        if body.deforms:
            continue
        x, v = fluid.cut.motion.x[part], fluid.cut.motion.v[part]
        force = forces[surface.name]
        area, normals = vertex_shares(x, surface.facets)
        traction = np.divide(force, area[:, None], out=np.zeros_like(force), where=area[:, None] > 0.0)
        shear = tangential(traction, normals)
        fields = {"velocity": v, "traction": traction, "wall_shear_stress": shear}
        fields = {name: _in_space(values) for name, values in fields.items()}
        kind = "line" if dim == 2 else "triangle"
        found.append(Snapshot(surface.name, _in_space(x), surface.facets, kind, fields))
    return found


def _in_space(vectors: Array) -> Array:
    return np.pad(vectors, ((0, 0), (0, 3 - vectors.shape[1])))
