"""Surfaces in the flow: closed, of segments or triangles, with the solid inside."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array

#: What fills closed contact: nothing, fluid with the pressure of its rim, or fluid that passes through it, too.
Zone = Literal["dry", "wetted", "seeping"]


@dataclass(frozen=True)
class ImmersedSurface:
    """One body's surface; the right-hand normal of each facet points out of the solid."""

    name: str
    facets: NDArray[np.int64]  #: vertices of segments or triangles, shape (m, dim)
    vertices: int
    wet: NDArray[np.bool_] | None = None  #: facets that the fluid touches; the others only close the solid; None: all
    may_part: NDArray[np.bool_] | None = None  #: facets in contact: those on the boundary of the box may leave it
    slip_length: float = 0.0  #: shear stress = mu / slip_length times the velocity along it [m]; 0: the flow sticks
    transmissivity: float = 0.0  #: fluid passes along it in a thin layer, this / mu grad p [m^3]; 0: there is none
    zone: Zone = "dry"  #: what facets in contact feel where no fluid is


@dataclass(frozen=True)
class Motion:
    """Where the vertices of a surface are and how they move."""

    x: Array  #: positions [m], shape (n, dim)
    v: Array  #: velocities [m/s], shape (n, dim)


def together(
    surfaces: Sequence[ImmersedSurface], motions: Sequence[Motion], dim: int
) -> tuple[NDArray[np.int64], Motion]:
    """All surfaces as one: (facets, motion), vertices of one surface after those of the other."""
    if not surfaces:
        return np.empty((0, dim), dtype=np.int64), Motion(np.empty((0, dim)), np.empty((0, dim)))
    starts = offsets(surfaces)[:-1]
    facets = np.concatenate([s.facets + start for s, start in zip(surfaces, starts, strict=True)])
    return facets, Motion(np.concatenate([m.x for m in motions]), np.concatenate([m.v for m in motions]))


def wetness(surfaces: Sequence[ImmersedSurface]) -> NDArray[np.bool_]:
    """Which facets of all surfaces the fluid touches."""
    parts = [np.ones(len(s.facets), dtype=bool) if s.wet is None else s.wet for s in surfaces]
    return np.concatenate([*parts, np.empty(0, dtype=bool)])


def may_close(surfaces: Sequence[ImmersedSurface]) -> NDArray[np.bool_] | None:
    """Which facets of all surfaces feel fluid in closed contact; None if none do."""
    if all(surface.zone == "dry" for surface in surfaces):
        return None
    parts = [
        np.zeros(len(s.facets), dtype=bool) if s.zone == "dry" or s.may_part is None else s.may_part for s in surfaces
    ]
    return np.concatenate(parts) & wetness(surfaces)


def seeping(surfaces: Sequence[ImmersedSurface]) -> Array | None:
    """Transmissivity [m^3] of the facets of all surfaces where contact is closed; None if all are zero."""
    return by_facets(surfaces, [s.transmissivity if s.zone == "seeping" else 0.0 for s in surfaces])


def by_facets(surfaces: Sequence[ImmersedSurface], numbers: Sequence[float]) -> Array | None:
    """Numbers of surfaces for all of their facets; None if all are zero."""
    if not any(numbers):
        return None
    return np.concatenate([np.full(len(s.facets), number) for s, number in zip(surfaces, numbers, strict=True)])


def offsets(surfaces: Sequence[ImmersedSurface]) -> NDArray[np.int64]:
    """First vertex of each surface among all, and their number."""
    return np.concatenate([[0], np.cumsum([s.vertices for s in surfaces])]).astype(np.int64)
