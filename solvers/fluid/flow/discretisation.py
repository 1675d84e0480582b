"""The discretisation of a flow: grid, unknowns and equations, all made anew when its cells change."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from mpi4py import MPI

from solvers.algebra import linear
from solvers.fluid.cut.cut import Cutter
from solvers.fluid.cut.film import Films
from solvers.fluid.cut.gaps import GapFinder
from solvers.fluid.flow.behind import BehindWalls
from solvers.fluid.geometry.thin.sheets import Sheets
from solvers.fluid.grid.box import Grid
from solvers.fluid.grid.nested import Nested
from solvers.fluid.mesh.distributed_grid import DistributedGrid
from solvers.fluid.mesh.partition import partition
from solvers.fluid.mesh.space import Unknowns
from solvers.fluid.settings.flow_settings import FlowSettings
from solvers.fluid.solve.linear_systems.rough_cells import is_rough
from solvers.fluid.solve.pressure_level import PressureLevels
from solvers.fluid.solve.system import FlowSystem
from solvers.fluid.surfaces.immersed import ImmersedBody
from solvers.fluid.surfaces.surface import dry_contact, tied
from solvers.fluid.terms.boundary.patches import Boundary, Patch, periodic_axes, wall_faces
from solvers.solver_settings import SolverSettings


@dataclass(frozen=True)
class Discretisation:
    """A distributed grid with unknowns, equations, and what belongs to these unknowns."""

    grid: DistributedGrid
    unknowns: Unknowns
    boundary: Boundary
    system: FlowSystem
    cutter: Cutter
    levels: PressureLevels
    behind: BehindWalls | None  #: bounds on second-degree velocities behind moving walls
    methods: tuple[linear.FlowMethod, ...]  #: linear solvers, the usual one first


def discretise(
    comm: MPI.Comm,
    grid: Grid,
    sheets: Sheets | None,
    settings: FlowSettings,
    patches: Sequence[Patch],
    bodies: Sequence[ImmersedBody],
    solver: SolverSettings,
) -> Discretisation:
    """The discretisation of a flow around bodies (collective)."""
    destinations = None
    if comm.size > 1 and not isinstance(grid, Nested):
        destinations = partition(comm, grid, bodies, sheets)
    distributed = DistributedGrid(comm, grid, sheets, destinations)
    unknowns = Unknowns(distributed, settings.degree, periodic_axes(patches))
    boundary = Boundary(distributed, unknowns, patches)
    method = solver.linear if isinstance(solver.linear, str) else "auto"
    methods = linear.choose_flow(
        method,
        grid.dim,
        unknowns.counted(),
        degree=settings.degree,
        steady=settings.steady,
        with_solids=any(body.deforms for body in bodies),
        rough=is_rough(grid, convection=settings.convection),
    )
    surfaces = [body.surface for body in bodies]
    system = FlowSystem(
        distributed,
        settings,
        boundary,
        unknowns,
        surfaces=surfaces,
        # incomplete factors of dense blocks are two times as fast
        blocked=methods[0] != "direct" and unknowns.block_size > 1,
    )
    walls, repeated = wall_faces(patches), unknowns.periodic
    films = Films(walls, settings.penalties.extension, repeated) if settings.films else None
    # both sides of a thin body have cells in the same place, and a gap may be on one side alone
    gaps = GapFinder(walls, settings.penalties, repeated) if settings.with_gaps and sheets is None else None
    in_contact = any(surface.in_contact is not None and surface.in_contact.any() for surface in surfaces)
    unions = sheets is None and len(bodies) > 1 and not in_contact
    cutter = Cutter(
        distributed,
        system.weights.points,
        films,
        gaps,
        unions=unions,
        tied=tied(surfaces),
        closing=dry_contact(surfaces),
        steady=settings.steady,
        periodic=unknowns.periodic,
    )
    levels = PressureLevels(system, bodies)
    moved = not settings.steady and not all(body.rests for body in bodies)
    behind = BehindWalls(unknowns) if moved and settings.degree == 2 and sheets is None else None
    return Discretisation(distributed, unknowns, boundary, system, cutter, levels, behind, methods)
