"""Facets hidden in other bodies: the fluid does not act on them until they come out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.fluid.surfaces.inside import windings
from solvers.fluid.surfaces.surface import ImmersedSurface, Motion

#: Winding number above which the middle of a facet is in another body; on the surface of the body it is one half.
#: From 0.51 to 0.99 results are the same.
HIDDEN = 0.75


def hidden_facets(
    index: int, surfaces: Sequence[ImmersedSurface], positions: Sequence[Array], those: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Mask of the facets of one surface, among `those`, with their middle in the body of another one.

    positions: of the vertices of each surface [m].
    """
    middles = positions[index][surfaces[index].facets].mean(axis=1)
    found = np.zeros(len(middles), dtype=bool)
    for other, (surface, x) in enumerate(zip(surfaces, positions, strict=True)):
        if other == index:
            continue
        near = np.all((middles > x.min(axis=0)) & (middles < x.max(axis=0)), axis=1)
        some = np.flatnonzero(near & those & ~found)
        found[some] = windings(middles[some], Motion(x, np.zeros_like(x)), surface.facets) >= HIDDEN
    return found


class HiddenFacets:
    """Facets that are hidden at the start, and which of them have come out; within a step none goes back."""

    def __init__(self, surfaces: Sequence[ImmersedSurface]):
        self._surfaces = list(surfaces)
        self._some = [
            index for index, surface in enumerate(surfaces) if surface.hidden is not None and surface.hidden.any()
        ]
        self._last: list[Array] = []
        self._out: dict[int, NDArray[np.bool_]] = {}  #: by surface, at the last positions

    def outside(self, motions: Sequence[Motion]) -> dict[int, NDArray[np.bool_]]:
        """By number of the surface, those of its facets that were hidden at the start and are not now."""
        if self._some:
            positions = [motion.x for motion in motions]
            moved = [
                not self._last or not np.array_equal(x, y)
                for x, y in zip(positions, self._last or positions, strict=True)
            ]
            for index in self._some if any(moved) else []:
                hidden = self._surfaces[index].hidden
                assert hidden is not None
                self._out[index] = hidden & ~hidden_facets(index, self._surfaces, positions, hidden)
            self._last = positions
        return self._out
