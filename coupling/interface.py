"""The interface: vertices of the wetted surfaces, which solid and fluid share, and their motion."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from coupling.ports import Solid
from coupling.sealing_layer import SealingLayer
from solvers.api import Array, State
from solvers.exchange import STEADY, Difference, Motion


@dataclass(frozen=True)
class DrySide:
    """The surface that closes the solid behind a wetted surface, from its ends to fixed corners."""

    name: str  #: name of this surface in the fluid
    behind: str  #: name of the wetted surface
    ends: NDArray[np.int64]  #: vertices of the wetted surface from which it starts; none if that is closed
    corners: Array  #: positions [m], shape (n, dim)
    facets: NDArray[np.int64]  #: numbers of its vertices: of the ends, then of the corners

    def motion(self, wetted: Motion) -> Motion:
        """Motion of its vertices: the ends move with the wetted surface."""
        x = np.concatenate([wetted.x[self.ends], self.corners])
        return Motion(x, np.concatenate([wetted.v[self.ends], np.zeros_like(self.corners)]))


class Interface:
    """All wetted surfaces, with vertices surface by surface; `dry_sides` close those with fluid on one side.

    The velocity of the surface in the fluid follows from the displacements by the difference formula of the fluid,
    g = alpha d_{n+1} - sum_k beta_k d_{n-k}, so that fluid and surface sweep the same volume.
    """

    def __init__(
        self,
        solid: Solid,
        times: int,
        dry_sides: Sequence[DrySide] = (),
        layers: Mapping[str, SealingLayer] = {},
    ):
        """times: count of earlier displacements in the difference formula; layers: of surfaces, by their names."""
        self.solid, self.surfaces, self.dry_sides = solid, list(solid.surfaces), list(dry_sides)
        self.layers = dict(layers)
        self.points = np.concatenate(list(solid.surfaces.values()))
        self._ends = np.cumsum([len(points) for points in solid.surfaces.values()])[:-1]
        self.now = np.zeros_like(self.points)
        self.past = [self.now] * max(1, times)  #: displacements [m] at earlier times, newest first
        self.begun = self.now  #: displacements [m] at the start of the step
        self._difference = STEADY

    def initialise(self) -> None:
        """Set all displacements to those of the solid at the start."""
        self.now = self.displacement()
        self.past = [self.now] * len(self.past)

    def begin_start(self, difference: Difference, velocity: Array) -> None:
        """Begin a start step: g = velocity + alpha (d - d_0), with the present displacement d_0 and velocity [m/s]."""
        self.begun = self.displacement()
        self.past[0], self._difference = self.begun - velocity / difference.alpha, difference

    def end_start(self, dt: float, velocity: Array, acceleration: Array) -> None:
        """End the start: extrapolate displacements back by velocity [m/s] and acceleration [m/s^2], in steps dt [s]."""
        self.now, self._difference = self.displacement(), STEADY
        times = [-k * dt for k in range(1, len(self.past) + 1)]
        self.past = [self.now + t * velocity + 0.5 * t**2 * acceleration for t in times]

    def begin_step(self, difference: Difference) -> None:
        """Store the displacements at the start of a step; difference: its formula."""
        self.past = [self.now, *self.past][: len(self.past)]
        self.begun, self._difference = self.now, difference

    def displacement(self) -> Array:
        """Present displacement [m] of the vertices, shape (n, dim) (collective)."""
        return self.solid.displacement()

    def velocity(self, d: Array) -> Array:
        """Velocity [m/s] of the vertices for displacements d at the end of the step."""
        rule = self._difference
        g = rule.alpha * d
        for beta, past in zip(rule.beta, self.past, strict=False):
            g = g - beta * past
        return g

    def move(self, d: Array) -> dict[str, Motion]:
        """Set displacements d [m] at the end of the step; returns the motion of each surface."""
        self.now = d.copy()
        return self._motions(d, self.velocity(d))

    def at_start(self, velocity: Array, d: Array | None = None) -> dict[str, Motion]:
        """Motion of each surface with given velocities [m/s] of the vertices; d: displacements [m], None: present."""
        return self._motions(self.now if d is None else d, velocity)

    def _motions(self, d: Array, velocity: Array) -> dict[str, Motion]:
        motions = self._by_surface(self.points + d, velocity)
        return motions | {side.name: side.motion(motions[side.behind]) for side in self.dry_sides}

    def _by_surface(self, x: Array, v: Array) -> dict[str, Motion]:
        parts = zip(self.surfaces, np.split(x, self._ends), np.split(v, self._ends), strict=True)
        return {name: Motion(self.layers[name].cover(x) if name in self.layers else x, v) for name, x, v in parts}

    def vertices_of(self, names: Collection[str]) -> NDArray[np.bool_]:
        """Mask of the vertices of some surfaces, shape (n,)."""
        counts = [len(points) for points in self.solid.surfaces.values()]
        return np.array([name in names for name in self.surfaces]).repeat(counts)

    def join(self, by_surface: dict[str, Array]) -> Array:
        """Values at all vertices from those of each surface."""
        return np.concatenate([by_surface[name] for name in self.surfaces])

    def save(self) -> State:
        return {"now": self.now.copy(), "past": {str(k): d.copy() for k, d in enumerate(self.past)}}

    def restore(self, state: State) -> None:
        self.now = state["now"].copy()
        self.past = [state["past"][str(k)].copy() for k in range(len(self.past))]
