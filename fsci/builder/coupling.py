"""From a case with fluid and structure to the coupled system and its scheme."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from coupling.accelerate import ACCELERATORS
from coupling.coupled import Coupled
from coupling.elastic import Elastic
from coupling.immersed import immerse, in_fluid
from coupling.interface import DrySide
from coupling.monolithic import Monolithic
from coupling.partitioned import FixedPointTolerance, Partitioned
from coupling.parts import coupled_bodies, coupled_elastic
from coupling.sealing_layer import sealing_layers
from coupling.wetted import WettedSurface, wetted_surfaces
from fsci.builder.dry_side import Closing
from fsci.builder.fluid import build_fluid, build_rigid_bodies
from fsci.builder.on_first import shared
from fsci.builder.skin import find_skin
from fsci.builder.solver import build_tolerance
from fsci.builder.wall_pairs import wall_pairs
from fsci.case import Case
from fsci.case.coupling_checks import level_unknown
from fsci.meshes.of_case import require_shorter_than_period
from solvers.api import Array
from solvers.fluid.flow.field import Fluid
from solvers.fluid.surfaces.immersed import ImmersedBody
from solvers.fluid.surfaces.surface import ImmersedSurface
from solvers.mesh.skin import Skin
from solvers.rigid.field import RigidBodies
from solvers.structure.body import Body
from solvers.structure.field import Structure
from solvers.timing import Timer

if TYPE_CHECKING:
    from coupling.near_walls import NearWalls


def build_coupled(
    case: Case,
    comm: MPI.Comm,
    bodies: Sequence[Body],
    structure: Structure,
    timer: Timer,
    rigid: RigidBodies | None = None,
) -> tuple[Monolithic | Partitioned, Fluid]:
    """The scheme and the flow in it; rigid: bodies that the flow moves, too. Raises CaseError (collective)."""
    assert case.coupling is not None
    assert case.fluid is not None
    skins = [_skin(case, comm, body) for body in bodies]
    walls, film = _walls(case, comm, structure), None if case.contact is None else case.contact.film
    # with dry contact, bodies move as without contact until they are near a wall
    near_walls = walls.dofs if walls is not None and film is not None and film.closed != "dry" else None
    surfaces = wetted_surfaces(structure, [skin for skin, _ in skins], near_walls)
    given, elastic = build_rigid_bodies(case, comm), [in_fluid(surface) for surface in surfaces]
    immersed = immerse(elastic + _moved(rigid), given, case.time.start, rigid=_names(rigid))
    dry_sides = [_dry_side(s, c) for s, (_, c) in zip(surfaces, skins, strict=True) if c is not None]
    immersed += [ImmersedBody(_dry_surface(side), None, deforms=True, sweeps=True) for side in dry_sides]
    fluid = build_fluid(case, comm, timer, immersed)
    layers = {} if film is None or film.seal is None else sealing_layers(surfaces, film.seal)
    if rigid is None:
        return _scheme(case, coupled_elastic(fluid, Elastic(structure, surfaces), dry_sides, layers, walls)), fluid
    from coupling.composite_parts import coupled_both

    return _scheme(case, coupled_both(fluid, Elastic(structure, surfaces), rigid, dry_sides, layers, walls)), fluid


def _walls(case: Case, comm: MPI.Comm, structure: Structure) -> NearWalls | None:
    """The faces of the box that elastic bodies may reach; None if there are none (collective)."""
    meshes = {body.name: mesh for body in structure.bodies if (mesh := body.domain.source) is not None}
    found = shared(comm, partial(wall_pairs, case, meshes))
    if not found:
        return None
    from fsci.builder.walls import build_walls  # with modules of contact

    return build_walls(case, comm, structure, found)


def build_coupled_rigid(
    case: Case, comm: MPI.Comm, bodies: RigidBodies, timer: Timer
) -> tuple[Monolithic | Partitioned, Fluid]:
    """The coupled system of a flow and the rigid bodies that it moves. Raises CaseError (collective)."""
    assert case.fluid is not None
    immersed = immerse(_moved(bodies), build_rigid_bodies(case, comm), case.time.start, rigid=_names(bodies))
    fluid = build_fluid(case, comm, timer, immersed)
    return _scheme(case, coupled_bodies(fluid, bodies)), fluid


def _moved(bodies: RigidBodies | None) -> list[tuple[ImmersedSurface, Array]]:
    """Surfaces of rigid bodies in the flow, with their vertices at the start [m]."""
    found = [] if bodies is None else bodies.bodies
    return [(ImmersedSurface(body.name, body.facets, len(body.points)), body.points) for body in found]


def _names(bodies: RigidBodies | None) -> set[str]:
    return set() if bodies is None else {body.name for body in bodies.bodies}


def _scheme(case: Case, coupled: Coupled) -> Monolithic | Partitioned:
    assert case.coupling is not None
    if case.coupling.scheme == "monolithic":
        return Monolithic(coupled, build_tolerance(case))
    settings = case.coupling
    tolerance = FixedPointTolerance(settings.tolerance, settings.tolerance_absolute, settings.max_iterations)
    accelerator = ACCELERATORS[settings.accelerator](settings.relaxation, settings.reuse)
    return Partitioned(coupled, accelerator, tolerance)


def start(case: Case, scheme: Monolithic | Partitioned, fluid: Fluid, t: float, dt: float) -> None:
    """Both fields at the first time. Raises CaseError (collective)."""
    scheme.initialise(t, dt)
    if fluid.parts.levels.unknown and (mistake := level_unknown(case)):
        raise case.error(mistake[0], f"bodies enclose a part of the fluid, and {mistake[1]}")


def _skin(case: Case, comm: MPI.Comm, body: Body) -> tuple[Skin, Closing | None]:
    found: Any = None
    if comm.rank == 0:
        try:
            assert body.domain.source is not None
            found = find_skin(case, body.name, body.domain.source)
        except Exception as raised:  # raised on every process below
            found = raised
    found = comm.bcast(found, root=0)
    if isinstance(found, Exception):
        raise found
    require_shorter_than_period(case, ("structure", "bodies", body.name), found[0].points)
    return found


def _dry_side(surface: WettedSurface, closing: Closing) -> DrySide:
    return DrySide(f"{surface.name}.dry_side", surface.name, closing.ends, closing.corners, closing.facets)


def _dry_surface(side: DrySide) -> ImmersedSurface:
    """Its facets, which fluid never touches."""
    return ImmersedSurface(side.name, side.facets, int(side.facets.max()) + 1, np.zeros(len(side.facets), dtype=bool))
