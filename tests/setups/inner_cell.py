"""A cube of 27 cells pressed from above, of which the second process has the cell in the middle only.

Writes the displacement, what probes find and the nodal stresses into a file. That process has no facet of any surface.
"""

import sys
from functools import partial
from unittest.mock import patch

import dolfinx
import numpy as np
from mpi4py import MPI
from structure_setup import TIGHT, block, constant, load_step, vector

from solvers import fem
from solvers.structure.body import Body, Pressure, Support
from solvers.structure.field import Structure
from solvers.structure.materials import NeoHooke
from solvers.structure.probes import at_point, of_bodies, on_surface
from solvers.structure.snapshot import snapshots


def middle_apart(comm, parts, dim_or_types, cells, ghost_mode=None):
    """Owners of the cells, all given by process 0, each followed by the process that has it as a ghost.

    cells: their nodes; newer versions of DOLFINx give one list of nodes for each type of cell.
    """
    middle, neighbours = 13, (4, 10, 12, 14, 16, 22)
    number = cells.num_nodes if ghost_mode is not None else len(cells[0]) // 8
    owners = [[1, 0] if c == middle else [0, 1] if c in neighbours else [0] for c in range(number)]
    offsets, flat = np.cumsum([0, *map(len, owners)]), np.concatenate([[], *owners])
    return dolfinx.cpp.graph.AdjacencyList_int32(flat.astype(np.int32), offsets.astype(np.int32))


def in_two_parts(create_mesh, *arguments, **named):
    """A mesh of which the second process has the middle."""
    return create_mesh(*arguments, **(named | {"partitioner": middle_apart}))


def main(out):
    comm = MPI.COMM_WORLD
    supports = [Support("bottom", vector(0, 0, 0))]
    load = [Pressure("top", constant(0.1))]
    material = NeoHooke(1.0, 1.0, 1.0)
    create_mesh = dolfinx.mesh.create_mesh if comm.size == 1 else partial(in_two_parts, dolfinx.mesh.create_mesh)
    with patch.object(dolfinx.mesh, "create_mesh", create_mesh):
        body = Body("cube", block("hexahedron", 3), material, supports=supports, pressures=load, comm=comm)
    domain = body.domain
    if comm.rank == 1:
        assert fem.owned_cells(domain) == 1
        assert not any(len(facets) for facets in domain.surfaces.values())
    structure = Structure([body], settings=TIGHT)
    load_step(structure)
    probes = [
        at_point(structure, body, "displacement", (0.5, 0.5, 0.5)),
        on_surface(structure, body, "reaction", "bottom"),
        on_surface(structure, body, "displacement", "top"),
        of_bodies(structure, [body], "volume"),
    ]
    measured = np.array([value for probe in probes for value in probe().values()])
    fields = snapshots(structure)
    if comm.rank == 0:
        np.savez(out, measured=measured, **fields[0].point_data)


if __name__ == "__main__":
    main(sys.argv[1])
