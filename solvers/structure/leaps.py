"""The sentinel of bodies that leap: farther in one step than what drives them explains."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from solvers.algebra.blocks import times
from solvers.api import Array, FailureKind, Finding, State
from solvers.structure.field import Structure
from solvers.structure.time_scheme import Statics


class Leaps:
    """Compares the way c of the mean node of each body in a step with what is asked of it:

        |c| <= size + max |u_p| + max |obstacles| + |v| dt + |f| / m dt^2

    u_p: prescribed displacements in the step; v: mean velocity at its start; f: loads, m: mass, in dynamics only. In
    contact, Newton's method may converge to a state far behind an obstacle, where nothing touches.
    """

    def __init__(self, structure: Structure, driven: Callable[[], float]):
        """driven: the largest way of an obstacle in the step [m]."""
        self._structure, self._driven = structure, driven
        self._sizes = self._counts = np.zeros(0)  # largest extent [m] and number of nodes, by body
        self._masses: Array | None = None  # [kg], in dynamics

    def start(self, t: float) -> None:
        """Sizes [m], numbers of nodes and masses [kg] of the bodies."""
        structure, comm = self._structure, self._structure.comm
        low = np.array([body.points.min(axis=1, initial=np.inf) for body in structure.bodies])
        high = np.array([body.points.max(axis=1, initial=-np.inf) for body in structure.bodies])
        high, low = np.max(comm.allgather(high), axis=0), np.min(comm.allgather(low), axis=0)
        self._sizes = (high - low).max(axis=1)
        ones = np.ones(structure.layout.size)
        self._counts = self._sums(ones)[:, 0]
        if not isinstance(structure.time, Statics):
            self._masses = self._sums(times(structure.inertia.assemble_mass(), ones))[:, 0]

    def _sums(self, values: Array) -> Array:
        """Sums of values at owned dofs over the nodes of each body, shape (bodies, dim) (collective)."""
        parts = self._structure.split(values)
        return self._structure.comm.allreduce(
            np.array([part.reshape(-1, self._structure.dim).sum(axis=0) for part in parts])
        )

    def _lengths(self, values: Array) -> Array:
        return np.linalg.norm(self._sums(values), axis=1)

    def look(self, t: float, dt: float) -> list[Finding]:
        """Bodies that have leapt in the step of length dt [s] that ends at t."""
        structure = self._structure
        moved = structure.now.u - structure.old.u
        ways = self._lengths(moved) / self._counts
        if (ways <= self._sizes).all():
            return []
        held = [float(np.abs(part).max(initial=0.0)) for part in structure.split(structure.held.part(moved))]
        asked = np.max(structure.comm.allgather(held), axis=0) + self._driven()
        if self._masses is not None:
            asked = asked + self._lengths(structure.old.v) / self._counts * dt
            asked = asked + self._lengths(structure.now.external) / self._masses * dt**2
        return [
            Finding(
                "leap",
                body.name,
                float(way),
                f"{body.name} moved by {way:.3g} in one step, {way / size:.3g} times its size: it may have passed "
                "through what should hold it, or nothing holds it; take a smaller 'step', or support it",
                FailureKind.PASSAGE,
            )
            for body, way, size, allowed in zip(structure.bodies, ways, self._sizes, asked, strict=True)
            if way > size + allowed
        ]

    def save(self) -> State:
        return {}

    def restore(self, state: State) -> None:
        """It keeps nothing from step to step."""
