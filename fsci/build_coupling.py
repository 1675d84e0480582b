"""From a case with fluid and structure to the coupled system and its scheme."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from coupling.accelerate import Accelerator, Aitken, QuasiNewton, Relaxation
from coupling.contact_surface import global_dofs
from coupling.coupled import Coupled
from coupling.interface import DrySide, Interface, Wetted
from coupling.monolithic import Monolithic
from coupling.partitioned import Partitioned, Tolerance
from fsci.build_fluid import build_fluid, build_rigid_bodies
from fsci.build_solver import build_tolerance
from fsci.case import Case
from fsci.case.coupling_checks import closed_in
from fsci.case_meshes import require_inside_period
from fsci.dry_side import find_ends
from fsci.skin import Skin, cut_out_skin
from solvers.api import Scheme
from solvers.blocks import Layout
from solvers.fluid.field import Body as Bather
from solvers.fluid.inside import winding
from solvers.fluid.surface import Motion, Surface
from solvers.structure.body import Body
from solvers.structure.field import Structure
from solvers.timing import Timer

Array = NDArray[np.float64]


def build_coupled(
    case: Case, comm: MPI.Comm, bodies: Sequence[Body], structure: Structure, timer: Timer
) -> tuple[Scheme, Coupled]:
    """The scheme and what it couples. Raises CaseError (collective)."""
    assert case.coupling is not None
    skins = [_skin(case, comm, body) for body in bodies]
    layout = Layout(comm, [body.size for body in bodies])
    wetted = [
        Wetted(skin.name, skin.points, global_dofs(layout, index, bodies[index], skin.nodes))
        for index, skin in enumerate(skins)
    ]
    rigid = build_rigid_bodies(case, comm)
    at_start = [(b.surface, b.motion(case.time.start).x) for b in rigid if b.motion is not None]
    at_start += [(Surface(s.name, s.facets, len(s.points), s.wet), s.points) for s in skins]
    wet = _touched(case, at_start)
    bathers = [replace(body, surface=surface) for body, surface in zip(rigid, wet, strict=False)]
    bathers += [Bather(surface, None) for surface in wet[len(rigid) :]]
    dry_sides = [_dry_side(skin, skin.corners) for skin in skins if skin.corners is not None]
    bathers += [Bather(_dry_line(side), None) for side in dry_sides]
    fluid = build_fluid(case, comm, timer, bathers)
    coupled = Coupled(fluid, structure, Interface(structure, wetted, dry_sides))
    if case.coupling.scheme == "monolithic":
        return Monolithic(coupled, build_tolerance(case)), coupled
    settings = case.coupling
    tolerance = Tolerance(settings.tolerance, settings.tolerance_absolute, settings.max_iterations)
    return Partitioned(coupled, _accelerator(case), tolerance), coupled


def start(case: Case, coupled: Coupled, t: float, dt: float) -> None:
    """Both fields at the first time. Raises CaseError (collective)."""
    coupled.initialise(t, dt)
    if coupled.fluid.level_unknown:
        where, why = closed_in(case)
        raise case.error(where, f"bodies close in a part of the fluid, and {why}")


def _touched(case: Case, surfaces: Sequence[tuple[Surface, Array]]) -> list[Surface]:
    """Surfaces without the facets in other bodies, where bodies are one piece, and those on the box's boundary.

    Where the case names what is wet, that stays.
    """
    assert case.fluid is not None
    low, high = np.array(case.fluid.grid.start), np.array(case.fluid.grid.to)
    found = []
    for index, (surface, x) in enumerate(surfaces):
        if surface.wet is None:
            middles = x[surface.facets].mean(axis=1)
            distance = np.abs(np.concatenate([middles - low, middles - high], axis=1)).min(axis=1)
            wet = distance > 1e-9 * (high - low).max()
            for other, (body, at) in enumerate(surfaces):
                if other == index:
                    continue
                near = np.all((middles > at.min(axis=0)) & (middles < at.max(axis=0)), axis=1)
                motion = Motion(at, np.zeros_like(at))
                for facet in np.flatnonzero(near & wet):
                    wet[facet] = winding(middles[facet], motion, body.facets) < 0.75
            surface = replace(surface, wet=wet)
        found.append(surface)
    return found


def _skin(case: Case, comm: MPI.Comm, body: Body) -> Skin:
    found: Any = None
    if comm.rank == 0:
        try:
            assert body.domain.source is not None
            found = cut_out_skin(case, body.name, body.domain.source)
        except Exception as raised:  # every process must hear of it
            found = raised
    found = comm.bcast(found, root=0)
    if isinstance(found, Exception):
        raise found
    require_inside_period(case, ("structure", "bodies", body.name), found.points)
    return found


def _dry_side(skin: Skin, corners: Array) -> DrySide:
    return DrySide(f"{skin.name}.dry_side", skin.name, find_ends(skin.facets), corners)


def _dry_line(side: DrySide) -> Surface:
    """Its segments, which fluid never touches."""
    vertices = np.arange(len(side.corners) + 2)
    segments = np.stack([vertices[:-1], vertices[1:]], axis=1)
    return Surface(side.name, segments, len(vertices), np.zeros(len(segments), dtype=bool))


def _accelerator(case: Case) -> Accelerator:
    assert case.coupling is not None
    settings = case.coupling
    if settings.accelerator == "iqn":
        return QuasiNewton(settings.relaxation, settings.reuse)
    return Aitken(settings.relaxation) if settings.accelerator == "aitken" else Relaxation(settings.relaxation)
