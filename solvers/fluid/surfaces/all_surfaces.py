"""The surfaces of all bodies as one, with vertices and facets numbered surface by surface."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.fluid.surfaces.hidden import HiddenFacets
from solvers.fluid.surfaces.surface import ImmersedSurface, Motion, offsets, together, wetness


class AllSurfaces:
    """What does not change while the surfaces move, and which facets of theirs are wet."""

    def __init__(self, surfaces: Sequence[ImmersedSurface], dim: int):
        self._surfaces, self._dim = list(surfaces), dim
        starts = offsets(surfaces)
        self._vertices = {s.name: slice(a, b) for s, a, b in zip(surfaces, starts, starts[1:], strict=False)}
        self._facets = np.concatenate([[0], np.cumsum([len(s.facets) for s in surfaces])]).astype(np.int64)
        self._at_start, self._hidden = wetness(surfaces), HiddenFacets(surfaces)
        self.wet = self._at_start.copy()  #: mask of the facets that the fluid acts on
        self.wet_in_unions = wetness(surfaces, unions=True)  #: the same where the solid is the union of the bodies

    def together(self, motions: Sequence[Motion]) -> tuple[NDArray[np.int64], Motion]:
        """(facets, motion) of all surfaces, from the motion of each."""
        return together(self._surfaces, motions, self._dim)

    def begin_step(self) -> None:
        """Let facets that go back into other bodies be hidden again."""
        self.wet[:] = self._at_start

    def follow(self, motions: Sequence[Motion]) -> None:
        """Mark facets as wet that were hidden at the start and have come out, by the motion of each surface."""
        for index, outside in self._hidden.outside(motions).items():
            self.wet[self._facets[index] : self._facets[index + 1]] |= outside

    def vertices_of(self, names: Sequence[str]) -> NDArray[np.int64]:
        """Numbers of the vertices of some surfaces, in the order of the names."""
        parts = [self._vertices[name] for name in names]
        return np.concatenate([np.arange(part.start, part.stop, dtype=np.int64) for part in parts])

    def by_name(self, values: Array) -> dict[str, Array]:
        """Values at the vertices of each surface, from those at all vertices."""
        return {name: values[part] for name, part in self._vertices.items()}
