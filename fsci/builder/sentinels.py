"""From a case to the sentinels of its bodies: what may overlap, pass through walls, or leap."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from fsci.builder.closed_faces import closed_faces
from fsci.builder.on_first import shared
from fsci.builder.periods import periods
from fsci.case import Case
from fsci.meshes.of_case import read_obstacle
from solvers.api import Sentinel
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.tessellation import tessellate
from solvers.sentinels.bodies import MovingBody
from solvers.sentinels.overlaps import Meeting, Overlaps
from solvers.sentinels.self_overlaps import SelfOverlaps
from solvers.sentinels.walls import BoxWalls

if TYPE_CHECKING:
    from solvers.contact.contact import Contact
    from solvers.fluid.surfaces.immersed import ImmersedBody
    from solvers.rigid.field import RigidBodies
    from solvers.structure.field import Structure

Array = NDArray[np.float64]


def build_sentinels(
    case: Case,
    comm: MPI.Comm,
    *,
    structure: Structure | None = None,
    contact: Contact | None = None,
    rigid: RigidBodies | None = None,
    given: list[ImmersedBody] | None = None,
) -> dict[str, Sentinel]:
    """Those that the case needs (collective); given: rigid bodies in the flow that it does not move."""
    wetted = {} if case.coupling is None else case.coupling.wetted
    elastic = [] if structure is None else list(_elastic(structure, wetted))
    bodies = [*elastic, *([] if rigid is None else _free(rigid))]
    walls = list(closed_faces(case)) if bodies else []
    rest = [*_given(given or []), *_obstacles(case, comm)] if bodies else []
    found: dict[str, Sentinel] = {}
    repeat = periods(case)
    if len(bodies) + len(rest) > 1:
        meetings, tied = _meetings(case, structure)
        found["overlaps"] = Overlaps([*bodies, *rest], meetings, tied | case.joined, repeat)
    if structure is not None and (len(bodies) > 1 or contact is not None):
        found["self_overlaps"] = SelfOverlaps(elastic, _with_themselves(case))
    if case.fluid is not None and bodies:
        around = np.isfinite(repeat) if repeat is not None else np.zeros(case.fluid.grid.dimension, dtype=bool)
        box = np.where(around, -np.inf, case.fluid.grid.start), np.where(around, np.inf, case.fluid.grid.to)
        ending = [name for name, body in case.fluid.bodies.items() if body.free and body.free.leaves == "stop"]
        found["walls"] = BoxWalls(bodies, walls, box, ending)
    if structure is not None and contact is not None:
        from solvers.structure.leaps import Leaps

        found["leaps"] = Leaps(structure, partial(_way_of_obstacles, structure))
    return found


# ---------------------------------------------------------------------------------------------------------- bodies


def _elastic(structure: Structure, wetted: Mapping[str, Sequence[str]]) -> Iterator[MovingBody]:
    """wetted: names of the surfaces in the fluid, of bodies that are partly in it."""
    from coupling.contact_surfaces import global_dofs
    from solvers.algebra.blocks import Layout
    from solvers.algebra.rows import gather_at

    comm = structure.comm
    layout = Layout(comm, [body.size for body in structure.bodies])
    for index, body in enumerate(structure.bodies):
        mesh = body.domain.source
        facets, nodes, points = comm.bcast(None if mesh is None else _surface(mesh), root=0)
        wet = comm.bcast(None if mesh is None else tessellate(mesh, wetted.get(body.name))[1], root=0)
        dofs = global_dofs(layout, index, body, nodes)

        def positions(t: float, points: Array = points, dofs: NDArray[np.int64] = dofs) -> Array:
            return points + gather_at(comm, structure.now.u, structure.layout.start, dofs)

        pieces = CELL_TYPES[body.domain.cell_type].degree
        yield MovingBody(body.name, facets, positions, free=True, pieces=pieces, dry=~np.isin(nodes, wet))


def _surface(mesh: Any) -> tuple[NDArray[np.int64], NDArray[np.int64], Array]:
    """(facets, numbers of the vertices in the mesh, their positions [m])."""
    facets, nodes = tessellate(mesh)
    return facets, nodes, mesh.points[nodes]


def _free(bodies: RigidBodies) -> Iterator[MovingBody]:
    for index, body in enumerate(bodies.bodies):
        yield MovingBody(body.name, body.facets, partial(_position, bodies, index), free=True, rigid=True)


def _position(bodies: RigidBodies, index: int, t: float) -> Array:
    from solvers.rigid.surface import positions

    return positions([bodies.bodies[index]], [bodies.now[index]])[0]


def _given(bodies: list[ImmersedBody]) -> Iterator[MovingBody]:
    for body in bodies:
        if (motion := body.motion) is not None:
            yield MovingBody(body.surface.name, body.surface.facets, _positions_of(motion), free=False, rigid=True)


def _positions_of(motion: Callable[[float], Any]) -> Callable[[float], Array]:
    return lambda t: motion(t).x


def _obstacles(case: Case, comm: MPI.Comm) -> Iterator[MovingBody]:
    if case.contact is None:
        return
    from fsci.builder.obstacle_motion import motion_of_obstacle

    for name in (name for name, settings in case.contact.obstacles.items() if settings.free is None):
        facets, _, points = shared(comm, partial(_obstacle, case, name))
        motion = motion_of_obstacle(case, name, points) or partial(_at_rest, points)
        yield MovingBody(name, facets, motion, free=False, rigid=True)


def _obstacle(case: Case, name: str) -> tuple[NDArray[np.int64], NDArray[np.int64], Array]:
    return _surface(read_obstacle(case, name))


def _at_rest(points: Array, t: float) -> Array:
    return points


# ----------------------------------------------------------------------------------------------------------- contact


def _meetings(case: Case, structure: Structure | None) -> tuple[dict[frozenset[str], Meeting], set[frozenset[str]]]:
    """(contact between two bodies by their names, bodies that are tied)."""
    if case.contact is None or structure is None:
        return {}, set()
    surfaces = {name: [side.on or () for _, side in pair.sides] for name, pair in case.contact.pairs.items()}
    found: dict[frozenset[str], Meeting] = {}
    tied = set()
    for name, pair in case.contact.pairs.items():
        owners = [side.body or side.obstacle or "" for _, side in pair.sides]
        key = frozenset(owners)
        if pair.tied:
            tied.add(key)
        elif len(key) == 2:
            before = found.get(key)
            names = (*(before.pairs if before else ()), name)
            masks = dict(before.facets) if before else {}
            for (_, side), on in zip(pair.sides, surfaces[name], strict=True):
                if side.body is not None:
                    mask = _facets_on(structure, side.body, on)
                    masks[side.body] = mask | masks.get(side.body, np.zeros_like(mask))
            found[key] = Meeting(names, owners[0], masks)
    return found, tied


def _with_themselves(case: Case) -> dict[str, tuple[str, ...]]:
    """Names of the pairs between surfaces of one body, by its name."""
    found: dict[str, tuple[str, ...]] = {}
    for name, pair in {} if case.contact is None else case.contact.pairs.items():
        (_, slave), (_, master) = pair.sides
        if slave.body is not None and slave.body == master.body and not pair.tied:
            found[slave.body] = (*found.get(slave.body, ()), name)
    return found


def _facets_on(structure: Structure, body: str, surfaces: tuple[str, ...]) -> NDArray[np.bool_]:
    """Mask of the facets of a body's whole surface that are on named ones (collective)."""
    mesh = next(other for other in structure.bodies if other.name == body).domain.source
    mask = None
    if mesh is not None:
        facets, nodes = tessellate(mesh)
        some, some_nodes = tessellate(mesh, surfaces)
        keys = {tuple(facet) for facet in np.sort(some_nodes[some], axis=1).tolist()}
        mask = np.array([tuple(facet) in keys for facet in np.sort(nodes[facets], axis=1).tolist()])
    return structure.comm.bcast(mask, root=0)


def _way_of_obstacles(structure: Structure) -> float:
    """The largest way of a rigid node in the step [m]."""
    from solvers.contact.contact import Contact

    contact = structure.constraint
    assert isinstance(contact, Contact)
    rigid = contact.nodes.dofs[:, 0] < 0
    return float(np.linalg.norm((contact.x - contact.x_old)[rigid], axis=1).max(initial=0.0))
