"""The wetted surfaces: nodes that structure and fluid share, their motion and their load."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from coupling.wetted import WettedSurface
from solvers.api import Array, State
from solvers.fluid.surface import Motion
from solvers.fluid.time import Difference
from solvers.rows import gather_at
from solvers.structure.field import Structure


@dataclass(frozen=True)
class DrySide:
    """The line that closes the solid behind a wetted surface with two ends, 2D.

    It goes from the end of the surface along corners that stay in their place to its start.
    """

    name: str  #: of its surface in the fluid
    behind: str  #: name of the wetted surface
    ends: tuple[int, int]  #: vertices of that at its end and at its start
    corners: Array  #: positions [m], shape (n, dim)

    def motion(self, wetted: Motion) -> Motion:
        """That of its vertices: those of the wetted surface's ends first and last."""
        end, start = self.ends
        x = np.concatenate([wetted.x[[end]], self.corners, wetted.x[[start]]])
        v = np.concatenate([wetted.v[[end]], np.zeros_like(self.corners), wetted.v[[start]]])
        return Motion(x, v)


class Interface:
    """All wetted surfaces, vertices of one after those of the other; `dry_sides` close those with two ends.

    The velocity that the fluid sees follows from the displacements by the fluid's own time rule,
    g = alpha d_{n+1} - beta_0 d_n - beta_1 d_{n-1}, so that fluid and surface sweep the same volume.
    """

    def __init__(self, structure: Structure, surfaces: Sequence[WettedSurface], dry_sides: Sequence[DrySide] = ()):
        self.structure, self.surfaces, self.dry_sides = structure, list(surfaces), list(dry_sides)
        self.dofs = np.concatenate([surface.dofs for surface in surfaces])
        self.points = np.concatenate([surface.points for surface in surfaces])
        self.now, self.old, self.older = (np.zeros_like(self.points) for _ in range(3))
        self._difference = Difference(0.0, 0.0, 0.0)

    @property
    def comm(self):
        return self.structure.comm

    def begin_step(self, difference: Difference) -> None:
        """Remember the displacements of the last two times."""
        self.older, self.old = self.old, self.now.copy()
        self._difference = difference

    def displacement(self) -> Array:
        """Displacement [m] of the vertices as the structure has it now, shape (n, dim) (collective)."""
        return self.gather(self.structure.now.u)

    def gather(self, owned: Array) -> Array:
        """Values at the vertices from those at owned dofs of the structure, shape (n, dim) (collective)."""
        return gather_at(self.comm, owned, self.structure.layout.start, self.dofs)

    def velocity(self, d: Array) -> Array:
        """Velocity [m/s] of the vertices for displacements d at the end of the step."""
        rule = self._difference
        return rule.alpha * d - rule.beta_0 * self.old - rule.beta_1 * self.older

    def move(self, d: Array) -> dict[str, Motion]:
        """Take displacements d [m] and say how each surface moves."""
        self.now = d.copy()
        motions = self._by_surface(self.points + d, self.velocity(d))
        return motions | {side.name: side.motion(motions[side.behind]) for side in self.dry_sides}

    def _by_surface(self, x: Array, v: Array) -> dict[str, Motion]:
        ends = np.cumsum([len(surface.points) for surface in self.surfaces])[:-1]
        parts = zip(self.surfaces, np.split(x, ends), np.split(v, ends), strict=True)
        return {surface.name: Motion(x, v) for surface, x, v in parts}

    def join(self, by_surface: dict[str, Array]) -> Array:
        """Values at all vertices from those of each surface."""
        return np.concatenate([by_surface[surface.name] for surface in self.surfaces])

    def spread(self, force: Array) -> Array:
        """Forces [N] on vertices as owned dofs of the structure."""
        structure = self.structure
        local = self.dofs - structure.layout.start
        mine = (local >= 0) & (local < structure.layout.size)
        total = np.zeros(structure.layout.size)
        np.add.at(total, local[mine], force[mine])
        return total

    def save(self) -> State:
        return {"now": self.now.copy(), "old": self.old.copy()}

    def restore(self, state: State) -> None:
        self.now, self.old = state["now"].copy(), state["old"].copy()
