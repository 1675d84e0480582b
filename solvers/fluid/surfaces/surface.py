"""Surfaces in the flow: closed surfaces of segments or triangles around solids."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.exchange import Motion

#: Closed contact: without fluid, with the fluid pressure of its rim, or with seepage through it in addition.
Zone = Literal["dry", "wetted", "seeping"]


@dataclass(frozen=True)
class ImmersedSurface:
    """The surface of one body. The right-hand normal of each facet points out of the solid."""

    name: str
    facets: NDArray[np.int64]  #: vertices of segments or triangles, shape (m, dim)
    vertices: int
    wet: NDArray[np.bool_] | None = None  #: facets that the fluid acts on; the others only close the solid; None: all
    in_contact: NDArray[np.bool_] | None = None  #: facets that take part in contact
    slip_length: float = 0.0  #: b [m]: the shear stress is mu / b times the tangential velocity; 0: no slip
    transmissivity: float = 0.0  #: kappa [m^3]: the flux of a layer along it is kappa / mu grad p; 0: no layer
    zone: Zone = "dry"  #: fluid in closed contact
    #: dry facets with their middle in another body: wet, too, where the solid is the union of bodies
    hidden: NDArray[np.bool_] | None = None
    tied: NDArray[np.bool_] | None = None  #: dry facets that lie on another body for ever; None: no one does


def together(
    surfaces: Sequence[ImmersedSurface], motions: Sequence[Motion], dim: int
) -> tuple[NDArray[np.int64], Motion]:
    """All surfaces as one: (facets, motion), with the vertices surface by surface."""
    if not surfaces:
        return np.empty((0, dim), dtype=np.int64), Motion(np.empty((0, dim)), np.empty((0, dim)))
    starts = offsets(surfaces)[:-1]
    facets = np.concatenate([s.facets + start for s, start in zip(surfaces, starts, strict=True)])
    return facets, Motion(np.concatenate([m.x for m in motions]), np.concatenate([m.v for m in motions]))


def wetness(surfaces: Sequence[ImmersedSurface], *, unions: bool = False) -> NDArray[np.bool_]:
    """Mask of the facets of all surfaces that the fluid acts on.

    unions: the solid is the union of the bodies, so that parts of facets in other bodies are left out by the cut.
    """
    parts = [np.ones(len(s.facets), dtype=bool) if s.wet is None else s.wet for s in surfaces]
    if unions:
        parts = [wet if s.hidden is None else wet | s.hidden for wet, s in zip(parts, surfaces, strict=True)]
    return np.concatenate([*parts, np.empty(0, dtype=bool)])


def tied(surfaces: Sequence[ImmersedSurface]) -> NDArray[np.bool_] | None:
    """Mask of the facets of all surfaces that are tied to another one; None if there are none."""
    if all(surface.tied is None for surface in surfaces):
        return None
    return np.concatenate([np.zeros(len(s.facets), dtype=bool) if s.tied is None else s.tied for s in surfaces])


def dry_contact(surfaces: Sequence[ImmersedSurface]) -> NDArray[np.bool_] | None:
    """Mask of the facets of all surfaces without fluid in closed contact; None if there are none."""
    if not any(surface.zone == "dry" and surface.in_contact is not None for surface in surfaces):
        return None
    parts = [
        s.in_contact if s.zone == "dry" and s.in_contact is not None else np.zeros(len(s.facets), dtype=bool)
        for s in surfaces
    ]
    return np.concatenate(parts)


def may_close(surfaces: Sequence[ImmersedSurface]) -> NDArray[np.bool_] | None:
    """Mask of the facets of all surfaces with fluid pressure in closed contact; None if there are none."""
    if all(surface.zone == "dry" for surface in surfaces):
        return None
    parts = [
        np.zeros(len(s.facets), dtype=bool) if s.zone == "dry" or s.in_contact is None else s.in_contact
        for s in surfaces
    ]
    return np.concatenate(parts) & wetness(surfaces)


def seeping(surfaces: Sequence[ImmersedSurface]) -> Array | None:
    """Transmissivity [m^3] of the facets of all surfaces where contact is closed; None if all are zero."""
    return by_facets(surfaces, [s.transmissivity if s.zone == "seeping" else 0.0 for s in surfaces])


def by_facets(surfaces: Sequence[ImmersedSurface], numbers: Sequence[float]) -> Array | None:
    """One number per surface repeated for its facets; None if all numbers are zero."""
    if not any(numbers):
        return None
    return np.concatenate([np.full(len(s.facets), number) for s, number in zip(surfaces, numbers, strict=True)])


def offsets(surfaces: Sequence[ImmersedSurface]) -> NDArray[np.int64]:
    """Index of the first vertex of each surface among those of all, and at the end their count."""
    return np.concatenate([[0], np.cumsum([s.vertices for s in surfaces])]).astype(np.int64)
