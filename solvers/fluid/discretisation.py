"""The discretisation of a flow: grid, unknowns and equations, all made anew when its cells change."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from mpi4py import MPI

from solvers import linear
from solvers.fluid.background.grid import DistributedGrid, Grid
from solvers.fluid.background.nested import Nested
from solvers.fluid.background.partition import partition
from solvers.fluid.background.space import Unknowns
from solvers.fluid.behind import BehindWalls
from solvers.fluid.bodies.immersed import ImmersedBody
from solvers.fluid.bodies.surface import by_facets, dry_contact, may_close, seeping, tied
from solvers.fluid.boundary.patches import Boundary, Patch, periodic_axes
from solvers.fluid.cutting.cut import Cutter
from solvers.fluid.cutting.pressure_level import PressureLevels
from solvers.fluid.films.film import films_of
from solvers.fluid.films.gaps import gap_finder
from solvers.fluid.flow_settings import FlowSettings
from solvers.fluid.linear_systems.rough_cells import is_rough
from solvers.fluid.system import FlowSystem
from solvers.fluid.thin.sheets import Sheets
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
    if comm.size > 1 and sheets is None and not isinstance(grid, Nested):
        destinations = partition(comm, grid, bodies)
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
        sheets=sheets is not None,
        with_solids=any(body.motion is None for body in bodies),
        rough=is_rough(grid, convection=settings.convection),
    )
    system = FlowSystem(
        distributed,
        settings,
        boundary,
        unknowns,
        with_bodies=bool(bodies),
        # incomplete factors of dense blocks are two times as fast
        blocked=methods[0] != "direct" and unknowns.block_size > 1,
    )
    surfaces = [body.surface for body in bodies]
    system.slip_length = by_facets(surfaces, [surface.slip_length for surface in surfaces])
    system.transmissivity = by_facets(surfaces, [surface.transmissivity for surface in surfaces])
    system.may_close, system.seeping = may_close(surfaces), seeping(surfaces)
    films = films_of(patches, settings.penalties) if settings.films else None
    # both sides of a thin body have cells in the same place, and a gap may be on one side alone
    gaps = gap_finder(patches, settings.penalties) if settings.with_gaps and sheets is None else None
    in_contact = any(surface.in_contact is not None and surface.in_contact.any() for surface in surfaces)
    unions = grid.dim == 2 and sheets is None and len(bodies) > 1 and not in_contact
    closing = dry_contact(surfaces) if settings.steady else None  # unsteady flows have a history on each side
    cutter = Cutter(
        distributed, system.weights.points, films, gaps, unions=unions, tied=tied(surfaces), closing=closing
    )
    levels = PressureLevels(system, bodies)
    moved = not settings.steady and not all(body.rests for body in bodies)
    behind = BehindWalls(unknowns) if moved and settings.degree == 2 and sheets is None else None
    return Discretisation(distributed, unknowns, boundary, system, cutter, levels, behind, methods)
