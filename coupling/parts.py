"""Assembly of a coupled system from its parts, for use as a library."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from coupling.coupled import Coupled
from coupling.elastic import Elastic
from coupling.elastic_start import ElasticStart
from coupling.immersed import immerse, in_fluid
from coupling.interface import DrySide
from coupling.ports import Start
from coupling.sealing_layer import SealingLayer, sealing_layers
from coupling.wetted import wetted_surfaces
from solvers.fluid.flow.field import Fluid
from solvers.fluid.flow.start import FlowStart
from solvers.fluid.grid.box import Grid
from solvers.fluid.settings.flow_settings import FlowSettings
from solvers.fluid.surfaces.immersed import ImmersedBody
from solvers.fluid.surfaces.surface import ImmersedSurface
from solvers.fluid.terms.boundary.patches import Patch
from solvers.mesh.skin import cut_out_skin
from solvers.rigid.field import RigidBodies
from solvers.rigid.start import RigidStart
from solvers.solver_settings import SolverSettings
from solvers.structure.field import Structure
from solvers.structure.time_scheme import Statics
from solvers.timing import Timer

if TYPE_CHECKING:
    from coupling.near_walls import NearWalls


def couple(
    structure: Structure,
    grid: Grid,
    flow: FlowSettings,
    patches: Sequence[Patch],
    *,
    rigid_bodies: Sequence[ImmersedBody] = (),
    wetted: Mapping[str, Sequence[str]] = {},
    start: float = 0.0,
    seal: float | None = None,
    solver: SolverSettings = SolverSettings(),
    timer: Timer | None = None,
) -> Coupled:
    """Elastic bodies in a flow, for `Monolithic` or `Partitioned` (collective).

    grid: the box of cells around the bodies. patches: conditions on the faces of the box. rigid_bodies: further bodies
    with prescribed motion. wetted: body -> names of its wetted surfaces. Without a name the whole surface is wetted,
    except parts in other bodies at the first time `start` [s].
    seal: thickness of a tight layer on contact surfaces [m].
    """
    comm, bodies = structure.comm, structure.bodies
    skins = []
    for body in bodies:
        mesh = body.domain.source
        skins.append(comm.bcast(None if mesh is None else cut_out_skin(mesh, wetted.get(body.name)), root=0))
    surfaces = wetted_surfaces(structure, skins)
    immersed = immerse([in_fluid(surface) for surface in surfaces], rigid_bodies, start)
    fluid = Fluid(grid, flow, patches, immersed, solver, timer=timer, comm=comm)
    layers = {} if seal is None else sealing_layers(surfaces, seal)
    return coupled_elastic(fluid, Elastic(structure, surfaces), layers=layers)


def couple_rigid(
    bodies: RigidBodies,
    grid: Grid,
    flow: FlowSettings,
    patches: Sequence[Patch],
    *,
    rigid_bodies: Sequence[ImmersedBody] = (),
    start: float = 0.0,
    solver: SolverSettings = SolverSettings(),
    timer: Timer | None = None,
) -> Coupled:
    """Rigid bodies that the flow moves, for `Monolithic` or `Partitioned`; all else as in `couple` (collective)."""
    moved = [(ImmersedSurface(body.name, body.facets, len(body.points)), body.points) for body in bodies.bodies]
    immersed = immerse(moved, rigid_bodies, start, rigid=bodies.surfaces)
    return coupled_bodies(Fluid(grid, flow, patches, immersed, solver, timer=timer, comm=bodies.comm), bodies)


def coupled_elastic(
    fluid: Fluid,
    elastic: Elastic,
    dry_sides: Sequence[DrySide] = (),
    layers: Mapping[str, SealingLayer] = {},
    walls: NearWalls | None = None,
) -> Coupled:
    """A structure in a flow. There is a start (`coupling.start`) if the solid has inertia and the flow uses BDF2.

    layers: on surfaces of bodies, by their names; walls: faces of the box that the bodies may reach.
    """
    inertia = not isinstance(elastic.structure.time, Statics)
    start = Start(FlowStart(fluid), ElasticStart(elastic)) if inertia and fluid.scheme.times > 1 else None
    return Coupled(fluid, elastic, dry_sides, start, layers, walls)


def coupled_bodies(fluid: Fluid, bodies: RigidBodies) -> Coupled:
    """Rigid bodies in a flow. There is a start (`coupling.start`) unless the flow is steady."""
    return Coupled(fluid, bodies, start=None if fluid.steady else Start(FlowStart(fluid), RigidStart(bodies)))
