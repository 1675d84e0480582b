"""The bodies in a fluid, those that a solid moves among them, and which of their facets are wet at the start."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from coupling.wetted import WettedSurface
from solvers.api import Array
from solvers.fluid.surfaces.hidden import hidden_facets
from solvers.fluid.surfaces.immersed import ImmersedBody
from solvers.fluid.surfaces.surface import ImmersedSurface


def in_fluid(surface: WettedSurface) -> tuple[ImmersedSurface, Array]:
    """(the surface of an elastic body in the fluid, reference positions of its vertices [m])."""
    marks = surface.wet, surface.in_contact
    return ImmersedSurface(surface.name, surface.facets, len(surface.points), *marks, tied=surface.tied), surface.points


def immerse(
    moved: Sequence[tuple[ImmersedSurface, Array]],
    given: Sequence[ImmersedBody],
    t: float = 0.0,
    *,
    rigid: Collection[str] = (),
) -> list[ImmersedBody]:
    """All bodies in the fluid: first those with prescribed motion, `given`, then those that a solid moves, `moved`.

    moved: surfaces with the positions of their vertices [m] at the start; t: the first time [s]; rigid: names of those
    whose volume does not change.
    """
    at_start = [(body.surface, body.motion(t).x) for body in given if body.motion is not None]
    wet = find_wet([*at_start, *moved])
    found = [replace(body, surface=surface) for body, surface in zip(given, wet, strict=False)]
    starts = [points for _, points in moved]
    return found + [
        ImmersedBody(surface, None, deforms=surface.name not in rigid, start=start, sweeps=True)
        for surface, start in zip(wet[len(given) :], starts, strict=True)
    ]


def find_wet(surfaces: Sequence[tuple[ImmersedSurface, Array]]) -> list[ImmersedSurface]:
    """The surfaces, given with the positions of their vertices [m], with marked wet facets.

    Facets with their middle in another body are not wet until they come out, tied ones never. Those on the boundary of
    the box are: cuts leave them out as long as they are there (`off_boundary`). Marks that a surface has already stay.
    """
    found, every, positions = [], [surface for surface, _ in surfaces], [x for _, x in surfaces]
    for index, surface in enumerate(every):
        if surface.wet is None:
            free = np.ones(len(surface.facets), dtype=bool) if surface.tied is None else ~surface.tied
            hidden = hidden_facets(index, every, positions, free)
            surface = replace(surface, wet=free & ~hidden, hidden=hidden)
        elif surface.tied is not None:
            surface = replace(surface, wet=surface.wet & ~surface.tied)
        found.append(surface)
    return found
