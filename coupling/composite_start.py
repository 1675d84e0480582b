"""The start of elastic and rigid bodies together in a flow (`coupling.start`)."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager

import numpy as np

from coupling.composite import Composite
from coupling.elastic_start import ElasticStart
from solvers.api import Array
from solvers.rigid.start import RigidStart


class CompositeStart:
    """Implements `StartOfSolid`: both parts take each step together, from which either finds its acceleration.

    Rigid bodies need one step. They take each step of the elastic ones from their first position.
    """

    took_impulse = False  #: no step of the run does

    def __init__(self, solid: Composite):
        self._rigid_bodies = solid.rigid
        self._elastic, self._rigid = ElasticStart(solid.elastic), RigidStart(solid.rigid)
        self._parts = self._elastic, self._rigid
        self.steps = self._elastic.steps
        self._first = list(solid.rigid.now)  #: states of the rigid bodies before the start steps

    def begin(self) -> None:
        for part in self._parts:
            part.begin()

    def leave_out(self, names: Collection[str]) -> None:
        self._first = list(self._rigid_bodies.now)
        for part in self._parts:
            part.leave_out(names)

    def velocity(self) -> Array:
        return np.concatenate([part.velocity() for part in self._parts])

    def acceleration(self) -> float:
        return max(part.acceleration() for part in self._parts)

    def gained(self, t: float, dt: float) -> float:
        return max(part.gained(t, dt) for part in self._parts)

    @contextmanager
    def step(self, t: float, dt: float) -> Iterator[None]:
        """Begin a start step of both; the caller solves it within the context."""
        with self._rigid.step(t, dt), self._elastic.step(t, dt):
            yield

    def strike(self, dt: float) -> None:
        """Both keep their schemes."""

    def repeat(self) -> None:
        self._rigid_bodies.now = list(self._first)

    def end(self) -> None:
        for part in self._parts:
            part.end()

    def take_impulse(self, step: Callable[[], float], *, always: bool) -> bool:
        """True: rigid bodies take their velocities, free elastic ones the rigid part of theirs. Momentum is kept."""
        dt = step()
        self._rigid.take_impulse(lambda: dt, always=always)
        self._elastic.share_impulse(dt)
        return True
