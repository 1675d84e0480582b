"""Snapshots of the structure for files and pictures: deformed bodies with nodal fields."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array, Snapshot
from solvers.mesh.distributed import Nodal, gather_nodal
from solvers.structure.body import Body
from solvers.structure.field import Structure

#: Body -> field name -> (node numbers in the mesh, values there)
PartFields = Mapping[str, Mapping[str, tuple[NDArray[np.int64], Array]]]


#: Components xx, yy, zz, xy, yz, xz of a tensor given by rows, as VTK has them.
SYMMETRIC = [0, 4, 8, 1, 5, 2]


def snapshots(
    structure: Structure, on_surfaces: PartFields | None = None, vectors: Mapping[str, Array] | None = None
) -> list[Snapshot]:
    """One snapshot per body on rank 0, an empty list on others (collective).

    on_surfaces: further fields on surfaces, which are zero at other nodes; vectors: field -> values at owned dofs.
    """
    found = []
    nodal = {"displacement": structure.now.u, "velocity": structure.now.v, **(vectors or {})}
    for number, body in enumerate(structure.bodies):
        gathered = {name: _gather(body, structure.split(values)[number]) for name, values in nodal.items()}
        stress = gather_nodal(structure.comm, Nodal(body.stress(), body.nodes[: body.owned]))
        known = {name: values for name, values in gathered.items() if values is not None}
        if stress is None:
            continue
        mesh = body.domain.source
        assert mesh is not None
        displacement, velocity, *_ = known.values()
        fields = {"displacement": displacement, "velocity": velocity, "von_mises": _von_mises(stress), **known}
        fields["stress"] = stress[:, SYMMETRIC]
        for name, (nodes, values) in (on_surfaces or {}).get(body.name, {}).items():
            fields[name] = np.zeros((len(mesh.points), *values.shape[1:]))
            fields[name][nodes] = np.nan_to_num(values)
            fields[name] = fields[name] if fields[name].ndim == 1 else _in_space(fields[name])
        found.append(Snapshot(body.name, _in_space(mesh.points) + displacement, mesh.cells, mesh.cell_type, fields))
    return found


def _gather(body: Body, array: Array) -> Array | None:
    values = gather_nodal(body.domain.comm, Nodal(array.reshape(-1, body.dim), body.nodes[: body.owned]))
    return None if values is None else _in_space(values)


def _in_space(vectors: Array) -> Array:
    return np.pad(vectors, ((0, 0), (0, 3 - vectors.shape[1])))


def _von_mises(stress: Array) -> Array:
    """sqrt(3/2 s:s) [Pa] with s the deviator of nodal stresses given by rows, shape (n, 9) -> (n,)."""
    sigma = stress.reshape(-1, 3, 3)
    deviator = sigma - np.trace(sigma, axis1=1, axis2=2)[:, None, None] * np.eye(3) / 3.0
    return np.sqrt(1.5 * np.einsum("nij,nij->n", deviator, deviator))
