"""Surfaces of elastic bodies in the fluid: closed, of segments or triangles, with the wet facets marked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from coupling.contact_surfaces import global_dofs
from solvers.api import Array
from solvers.blocks import Layout
from solvers.fluid.immersed import ImmersedBody
from solvers.fluid.inside import winding
from solvers.fluid.surface import ImmersedSurface, Motion
from solvers.skin import Skin
from solvers.structure.field import Structure

#: Distance to the face of the box, in sizes of the box, below which a facet is on it.
ON_BOX = 1e-9

#: Winding number above which the middle of a facet is in another body; on its surface it is one half.
INSIDE = 0.75


@dataclass(frozen=True)
class WettedSurface:
    """The surface of one body; the same on every process."""

    name: str  #: of the body in structure and fluid
    points: Array  #: reference positions [m] of its vertices, shape (n, dim)
    dofs: NDArray[np.int64]  #: their global dofs in the structure, shape (n, dim)
    facets: NDArray[np.int64]  #: vertices of segments or triangles, shape (m, dim)
    wet: NDArray[np.bool_] | None = None  #: facets that the fluid touches; None: found by `find_wet`
    may_part: NDArray[np.bool_] | None = None  #: facets in contact: what they lie on may let them go

    @property
    def at_start(self) -> tuple[ImmersedSurface, Array]:
        """The surface in the flow, and positions of its vertices [m]."""
        return ImmersedSurface(self.name, self.facets, len(self.points), self.wet, self.may_part), self.points


def wetted_surface(structure: Structure, index: int, skin: Skin) -> WettedSurface:
    """A skin with the dofs of its body, the one of that index among all of the structure (collective)."""
    bodies, constraint = structure.bodies, structure.constraint
    body = bodies[index]
    layout = Layout(body.domain.comm, [other.size for other in bodies])
    dofs = global_dofs(layout, index, body, skin.nodes)
    touching = np.empty(0, dtype=np.int64) if constraint is None else constraint.touching_dofs()
    may_part = np.isin(dofs[:, 0], touching)[skin.facets].all(axis=1)
    return WettedSurface(body.name, skin.points, dofs, skin.facets, skin.wet, may_part)


def immerse(
    moved: Sequence[tuple[ImmersedSurface, Array]],
    given: Sequence[ImmersedBody],
    box: tuple[Array, Array],
    t: float = 0.0,
    *,
    deform: bool = True,
) -> list[ImmersedBody]:
    """All bodies for the fluid, first the given ones, whose motion is known, then those that a solid moves.

    moved: surfaces with the positions of their vertices [m] at the start; box: lowest and highest corner [m]; t: the
    first time [s]; deform: the volume of those that are moved may change.
    """
    at_start = [(body.surface, body.motion(t).x) for body in given if body.motion is not None]
    wet = find_wet([*at_start, *moved], box)
    found = [replace(body, surface=surface) for body, surface in zip(given, wet, strict=False)]
    return found + [ImmersedBody(surface, None, deforms=deform) for surface in wet[len(given) :]]


def find_wet(surfaces: Sequence[tuple[ImmersedSurface, Array]], box: tuple[Array, Array]) -> list[ImmersedSurface]:
    """Surfaces, given with the positions of their vertices [m], with the facets marked that the fluid touches.

    It does not touch facets in other bodies, where bodies are one piece, nor those on the box's boundary, unless they
    are in contact with something there. What a surface says itself of its facets stays.
    """
    low, high = box
    found = []
    for index, (surface, x) in enumerate(surfaces):
        if surface.wet is None:
            middles = x[surface.facets].mean(axis=1)
            distance = np.abs(np.concatenate([middles - low, middles - high], axis=1)).min(axis=1)
            wet = distance > ON_BOX * (high - low).max()
            if surface.may_part is not None:
                wet |= surface.may_part
            for other, (body, at) in enumerate(surfaces):
                if other == index:
                    continue
                near = np.all((middles > at.min(axis=0)) & (middles < at.max(axis=0)), axis=1)
                motion = Motion(at, np.zeros_like(at))
                for facet in np.flatnonzero(near & wet):
                    wet[facet] = winding(middles[facet], motion, body.facets) < INSIDE
            surface = replace(surface, wet=wet)
        found.append(surface)
    return found
