"""The start of elastic bodies in a flow: start steps that remove accelerations which time steps do not resolve."""

from __future__ import annotations

from collections.abc import Collection
from contextlib import AbstractContextManager

import numpy as np
from mpi4py import MPI

from coupling.elastic import Elastic
from solvers.api import Array
from solvers.structure.first_state import SmoothAcceleration

#: n steps leave the share (1 + n x) / (1 + x)^n, x = (omega dt)^2, of a motion of frequency omega.
STEPS = 6


class ElasticStart:
    """Implements `StartOfSolid`."""

    steps = STEPS
    impulsive = False  #: the impulse would go to the surface alone, and waves that steps do not resolve take it further

    def __init__(self, elastic: Elastic):
        self.elastic, self._structure = elastic, elastic.structure
        self._initial = elastic.structure.now
        self._apart = np.zeros(elastic.size, dtype=bool)  #: owned dofs of bodies outside of the flow

    def leave_out(self, names: Collection[str]) -> None:
        bodies = self._structure.bodies
        self._apart = np.concatenate([np.full(body.size, body.name in names) for body in bodies])
        self._initial = self._structure.now.copy()

    def velocity(self) -> Array:
        return self.elastic.at_vertices(self._structure.now.v)

    def acceleration(self) -> float:
        largest = float(np.abs(self._structure.now.a[~self._apart]).max(initial=0.0))
        return self._structure.comm.allreduce(largest, op=MPI.MAX)

    def step(self, t: float, dt: float) -> AbstractContextManager[None]:
        """Begin a start step in which supports have their prescribed accelerations."""
        structure = self._structure
        accelerated = structure.now.u + dt**2 * structure.now.a
        held = structure.held.stopped(np.empty(0, dtype=np.int64), accelerated)
        return structure.by(SmoothAcceleration(), held, t, dt)

    def end(self) -> None:
        """Set the displacement u_0 + sum_k (du_k - du_n), see `coupling.start`."""
        now, old, initial, apart = self._structure.now, self._structure.old, self._initial, self._apart
        now.a[apart] = initial.a[apart]
        self._structure.take_start(np.where(apart, initial.u, now.u - self.steps * (now.u - old.u)))

    def end_impulse(self, dt: float) -> None:
        """Not for `impulsive` False."""
        raise NotImplementedError
