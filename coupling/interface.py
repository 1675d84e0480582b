"""The wetted surfaces: nodes that structure and fluid share, their motion and their load."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array, State
from solvers.fluid.surface import Motion
from solvers.fluid.time import Difference
from solvers.rows import gather_at
from solvers.structure.field import Structure


@dataclass(frozen=True)
class Wetted:
    """The surface of one body; the same on every process."""

    name: str  #: of the body in structure and fluid
    points: Array  #: reference positions [m] of its vertices, shape (n, dim)
    dofs: NDArray[np.int64]  #: their global dofs in the structure, shape (n, dim)


class Interface:
    """All wetted surfaces, vertices of one after those of the other.

    The velocity that the fluid sees follows from the displacements by the fluid's own time rule,
    g = alpha d_{n+1} - beta_0 d_n - beta_1 d_{n-1}, so that fluid and surface sweep the same volume.
    """

    def __init__(self, structure: Structure, surfaces: Sequence[Wetted]):
        self.structure, self.surfaces = structure, list(surfaces)
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
        return gather_at(self.comm, self.structure.now.u, self.structure.layout.start, self.dofs)

    def velocity(self, d: Array) -> Array:
        """Velocity [m/s] of the vertices for displacements d at the end of the step."""
        rule = self._difference
        return rule.alpha * d - rule.beta_0 * self.old - rule.beta_1 * self.older

    def move(self, d: Array) -> dict[str, Motion]:
        """Take displacements d [m] and say how each surface moves."""
        self.now = d.copy()
        return self._by_surface(self.points + d, self.velocity(d))

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
