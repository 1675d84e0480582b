"""From the `contact` section of a case to surfaces, pairs and the contact constraint."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from coupling.contact_surfaces import contact_surface
from fsci.builder.fits import off_curve
from fsci.builder.held import free_translations, is_held
from fsci.builder.named import named
from fsci.builder.obstacle_motion import motion_of_obstacle
from fsci.builder.on_first import shared
from fsci.builder.overlap import facets_in_each_other
from fsci.builder.periods import periods
from fsci.builder.roles import exchanged
from fsci.case import Case, CaseError
from fsci.meshes.of_case import read_rigid_side
from solvers.api import Array
from solvers.contact import law as laws
from solvers.contact.contact import Contact
from solvers.contact.pair import Pair
from solvers.contact.surface import Surface
from solvers.contact.unheld import Loose
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.topology import cut_out
from solvers.structure.body import Body

if TYPE_CHECKING:
    from solvers.rigid.field import RigidBodies
    from solvers.structure.field import Structure


def build_contact(case: Case, comm: MPI.Comm, bodies: Sequence[Body], rigid: RigidBodies | None = None) -> Contact:
    """All pairs of a case; rigid: free bodies. Raises CaseError (collective)."""
    assert case.contact is not None
    pairs = _pairs(case, comm, bodies, rigid)
    return contact_of(case, comm, list(case.contact.pairs), pairs, comm.bcast(_unheld(case, bodies), root=0))


def _unheld(case: Case, bodies: Sequence[Body]) -> list[Loose]:
    """The static bodies that only contact holds, on the first process."""
    assert case.contact is not None
    assert case.structure is not None
    if case.structure.dynamics is not None:
        return []
    sides = [[side.body or side.obstacle for _, side in pair.sides] for pair in case.contact.pairs.values()]
    signs = [{two[0]: 1.0, two[1]: -1.0} if two[0] != two[1] else {} for two in sides]
    ways = {
        name: np.diag([float(axis not in body.held) for axis in "xyz"[: bodies[0].dim]])
        for name, body in (case.rigid or {}).items()
    }
    for body in bodies:
        if body.domain.source is not None and not is_held(case, body.name, body.domain.source):
            ways[body.name] = free_translations(case, body.name, body.domain.source)
    loose = [
        Loose(name, {n: own[name] for n, own in enumerate(signs) if name in own}, free) for name, free in ways.items()
    ]
    return [body for body in loose if body.pairs]


def know_loads(contact: Contact, structure: Structure, rigid: RigidBodies | None) -> None:
    """Tell the contact the loads of the bodies that only it holds."""
    names, dim = [body.name for body in contact.unheld.bodies], structure.dim

    def loads() -> Array:
        elastic = zip(structure.bodies, structure.split(structure.now.external), strict=True)
        own = {body.name: load.reshape(-1, dim).sum(axis=0) for body, load in elastic}
        found = structure.comm.allreduce(np.array([own.get(name, np.zeros(dim)) for name in names]))
        for body, now in () if rigid is None else zip(rigid.bodies, rigid.now, strict=True):
            if body.name in names:
                found[names.index(body.name)] = now.load[:dim]
        return found

    contact.unheld.loads = loads


def contact_of(
    case: Case, comm: MPI.Comm, names: Sequence[str], pairs: Sequence[Pair], unheld: Sequence[Loose] = ()
) -> Contact:
    """Contact of pairs with the settings of a case."""
    assert case.structure is not None
    moves, c_n = case.structure.dynamics is not None, 1.0 if case.contact is None else case.contact.c_n
    return Contact(pairs, names=names, c_n=c_n, keep_overlap=moves, periods=periods(case), unheld=unheld, comm=comm)


def _pairs(case: Case, comm: MPI.Comm, bodies: Sequence[Body], rigid: RigidBodies | None) -> list[Pair]:
    assert case.contact is not None
    found: dict[tuple[str, ...], Surface] = {}
    pairs = []
    in_flow = case.coupling is not None
    meshes = {body.name: body.domain.source for body in bodies}
    known = {name: mesh for name, mesh in meshes.items() if mesh is not None}  # all of them on the first process
    others = shared(comm, partial(exchanged, case, known, case.contact.pairs))
    for name, settings in case.contact.pairs.items():
        sides = []
        for _, side in settings.sides:
            key = (side.body or "", *(side.on or ()), side.obstacle or "")
            if key not in found and side.obstacle is not None:
                found[key] = _obstacle(case, comm, side.obstacle, rigid)
            elif key not in found:
                found[key] = contact_surface(bodies, side.body or "", *(side.on or ()))
            sides.append(found[key])
        law = named(laws, settings.law)(*settings.law_parameters)
        deep = facets_in_each_other(case, comm, settings, meshes)
        overlap = settings.overlap if settings.interference is not None else None
        off = shared(comm, partial(off_curve, case, settings, known))
        one = Pair(sides[0], sides[1], settings.integration, law, deep, overlap, off, always=in_flow)
        pairs.append(one.exchanged() if name in others else one)
    return pairs


def _obstacle(case: Case, comm: MPI.Comm, name: str, rigid: RigidBodies | None) -> Surface:
    """The rigid surface of an obstacle or of a rigid body, whole on every process."""
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
    if rigid is not None and name in rigid.surfaces:
        index = list(rigid.surfaces).index(name)
        return Surface(name, points, facets, facet_type, None, motion=partial(rigid.points_of, index, points))
    return Surface(name, points, facets, facet_type, None, motion=motion_of_obstacle(case, name, points))


def _rigid_mesh(case: Case, name: str) -> tuple[Array, NDArray[np.int64], str]:
    """(points [m], facets, facet type) of a rigid surface."""
    mesh, on = read_rigid_side(case, name)
    points, facets, _ = cut_out(mesh, on)
    return points, facets, CELL_TYPES[mesh.cell_type].facet
