"""The start of elastic bodies in a flow: what a step resolves accelerates, the rest of their deformation is at rest."""

from __future__ import annotations

from contextlib import AbstractContextManager

import numpy as np
from mpi4py import MPI

from coupling.elastic import Elastic
from solvers.api import Array
from solvers.structure.first_state import SmoothAcceleration

#: n steps leave (1 + n x) / (1 + x)^n, x = (omega dt)^2, of a motion of frequency omega.
STEPS = 6


class ElasticStart:
    """A `StartOfSolid`."""

    steps = STEPS

    def __init__(self, elastic: Elastic):
        self.elastic, self._structure = elastic, elastic.structure

    def velocity(self) -> Array:
        return self.elastic.at_vertices(self._structure.now.v)

    def acceleration(self) -> float:
        largest = float(np.abs(self._structure.now.a).max(initial=0.0))
        return self._structure.comm.allreduce(largest, op=MPI.MAX)

    def step(self, t: float, dt: float) -> AbstractContextManager[None]:
        """Supports accelerate as they are asked to."""
        structure = self._structure
        accelerated = structure.now.u + dt**2 * structure.now.a
        held = structure.held.stopped(np.empty(0, dtype=np.int64), accelerated)
        return structure.by(SmoothAcceleration(), held, t, dt)

    def end(self) -> None:
        """Less the displacement that the last acceleration would have made in each of the steps."""
        now, old = self._structure.now, self._structure.old
        self._structure.take_start(now.u - self.steps * (now.u - old.u))
