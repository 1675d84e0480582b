"""From the `contact` section of a case to surfaces, pairs and the contact constraint."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from coupling.contact_surfaces import contact_surface
from fsci.builder.named import named
from fsci.builder.obstacle_motion import motion_of_obstacle
from fsci.builder.overlap import facets_in_each_other
from fsci.case import Case, CaseError
from fsci.case.contact import PairSection
from fsci.meshes.of_case import read_obstacle, read_rigid_body
from solvers.api import Array
from solvers.cell_types import CELL_TYPES
from solvers.contact import law as laws
from solvers.contact.contact import Contact
from solvers.contact.pair import Pair
from solvers.contact.surface import Surface
from solvers.mesh_topology import cut_out
from solvers.structure.body import Body


def build_contact(case: Case, comm: MPI.Comm, bodies: Sequence[Body]) -> Contact:
    """All pairs of a case. Raises CaseError (collective)."""
    assert case.contact is not None
    found: dict[tuple[str, ...], Surface] = {}
    pairs = []
    meshes = {body.name: body.domain.source for body in bodies}
    for settings in case.contact.pairs.values():
        sides = []
        for _, side in settings.sides:
            key = (side.body or "", *(side.on or ()), side.obstacle or "")
            if key not in found and side.obstacle is not None:
                found[key] = _obstacle(case, comm, side.obstacle)
            elif key not in found:
                found[key] = contact_surface(bodies, side.body or "", *(side.on or ()))
            sides.append(found[key])
        law = named(laws, settings.law)(*settings.law_parameters)
        deep = facets_in_each_other(case, comm, settings, meshes)
        pairs.append(Pair(sides[0], sides[1], settings.integration, law, deep, _interference(settings)))
    assert case.structure is not None
    moves = case.structure.dynamics is not None
    names = tuple(case.contact.pairs)
    return Contact(pairs, names=names, c_n=case.contact.c_n, keep_overlap=moves, comm=comm)


def _interference(pair: PairSection) -> Callable[[float], float] | None:
    """A function: time [s] -> overlap [m] of the bodies as meshed."""
    formula = pair.interference
    return None if formula is None else lambda t: float(formula(np.zeros((3, 1)), t)[0])


def _obstacle(case: Case, comm: MPI.Comm, name: str) -> Surface:
    """The rigid surface of an obstacle or of a rigid body in the flow, whole on every process."""
    assert case.contact is not None
    found, error = None, None
    if comm.rank == 0:
        try:
            found = _rigid_mesh(case, name)
        except CaseError as problem:
            error = problem
    error = comm.bcast(error, root=0)
    if error is not None:
        raise error
    points, facets, facet_type = comm.bcast(found, root=0)
    return Surface(name, points, facets, facet_type, None, motion=motion_of_obstacle(case, name, points))


def _rigid_mesh(case: Case, name: str) -> tuple[Array, NDArray[np.int64], str]:
    """(points [m], facets, facet type) of a rigid surface."""
    assert case.contact is not None
    if name in case.contact.obstacles:
        mesh = read_obstacle(case, name)
        points, facets, _ = cut_out(mesh, case.contact.obstacles[name].on)
    else:
        assert case.fluid is not None
        mesh = read_rigid_body(case, name)[0]
        points, facets, _ = cut_out(mesh, case.fluid.bodies[name].on)
    return points, facets, CELL_TYPES[mesh.cell_type].facet
