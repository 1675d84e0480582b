"""The start of elastic bodies in a flow: start steps that remove accelerations which time steps do not resolve."""

from __future__ import annotations

from collections.abc import Callable, Collection
from contextlib import AbstractContextManager

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from coupling.elastic import Elastic
from solvers.api import Array
from solvers.structure.dynamics import Dynamics
from solvers.structure.first_state import SmoothAcceleration

#: n steps leave the share (1 + n x) / (1 + x)^n, x = (omega dt)^2, of a motion of frequency omega.
STEPS = 6

#: Part of the velocity that is not rigid, relative, up to which a body moves rigidly: rounding of expressions.
RIGID = 1e-9


class ElasticStart:
    """Implements `StartOfSolid`."""

    steps = STEPS

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

    def gained(self, t: float, dt: float) -> float:
        """That of supports, twice the change of their mean velocity."""
        structure, held = self._structure, self._structure.held
        mean = (held.displacement(t + dt) - held.displacement(t)) / dt
        largest = float(np.abs(mean - held.part(structure.now.v)).max(initial=0.0))
        return 2.0 * structure.comm.allreduce(largest, op=MPI.MAX)

    def step(self, t: float, dt: float) -> AbstractContextManager[None]:
        """Begin a start step in which supports have their prescribed accelerations."""
        structure = self._structure
        accelerated = structure.now.u + dt**2 * structure.now.a
        held = structure.held.stopped(np.empty(0, dtype=np.int64), accelerated)
        return structure.by(SmoothAcceleration(), held, t, dt)

    def begin(self) -> None:
        self.elastic.impulse = "none"
        self.elastic.choose_scheme()

    def end(self) -> None:
        """Set the displacement u_0 + sum_k (du_k - du_n), see `coupling.start`."""
        now, old, initial, apart = self._structure.now, self._structure.old, self._initial, self._apart
        now.a[apart] = initial.a[apart]
        self._structure.take_start(np.where(apart, initial.u, now.u - self.steps * (now.u - old.u)))

    def take_impulse(self, step: Callable[[], float], *, always: bool) -> bool:
        """False: it acts on the surface, and waves that steps need not resolve carry it on.

        Backward Euler damps what deforms. It is for bodies without supports that move as rigid ones, until the impulse.
        always: for others, too, since the step before may have another length, so that its acceleration counts wrongly.
        """
        self.elastic.impulse = "next" if always or self._moves_freely() else "none"
        return False

    def _moves_freely(self) -> bool:
        """Whether no piece in the flow is held, and each has the velocity of a rigid body (collective)."""
        structure, apart = self._structure, self._apart
        v = np.where(apart, 0.0, structure.now.v)
        strained = np.abs(v - self._rigid_part(v)).max(initial=0.0)
        held = (self._held_pieces()[structure.pieces.of_nodes.repeat(structure.dim)] & ~apart).any()
        found = strained, np.abs(v).max(initial=0.0), held
        strained, largest, held = (structure.comm.allreduce(float(value), op=MPI.MAX) for value in found)
        return bool(strained <= RIGID * largest and not held)

    def _held_pieces(self) -> NDArray[np.bool_]:
        """Mask of the pieces with supports (collective)."""
        pieces, free = self._structure.pieces, self._structure.held.free_part(np.ones(self.elastic.size))
        at = pieces.of_nodes.repeat(self._structure.dim)[free != 1.0]
        return self._structure.comm.allreduce(np.bincount(at, minlength=pieces.count)) > 0

    def _rigid_part(self, v: Array) -> Array:
        """The rigid motion of each piece with the momenta of the velocity v [m/s], at owned dofs."""
        inertia = self._structure.inertia.of_pieces()
        frame = inertia.frame(self._initial.u)
        return inertia.joined(frame, inertia.split(frame, v), np.zeros_like(v))

    @property
    def took_impulse(self) -> bool:
        return self.elastic.impulse == "last"

    def strike(self, dt: float) -> None:
        """Take the impulse of an impact in the next two steps, of length dt [s], if damping ends all that it excites.

        A body that arrives within a step takes the rest of its impulse in the second one.

        A motion of the frequency w is overdamped if beta w > 2. So are all with w dt > 1, which steps do not resolve,
        if beta > 2 dt. Other bodies keep their scheme, which conserves what an elastic rebound needs.
        """
        time = self._structure.time
        if isinstance(time, Dynamics) and time.damping.stiffness > 2.0 * dt:
            self.elastic.impulse = "next two"

    def repeat(self) -> None:
        """A further step starts where the last one ended."""

    def share_impulse(self, dt: float) -> None:
        """Give free pieces the rigid motion that has the momenta of a start step of length dt [s].

        The displacement is restored. Beside rigid bodies that are thrown, the impulse acts on the surfaces of elastic
        ones, too. Waves take it further, but steps do not resolve them.
        """
        structure, initial = self._structure, self._initial
        rigid = self._rigid_part(np.where(self._apart, 0.0, (structure.now.u - initial.u) / dt))
        held = self._held_pieces()[structure.pieces.of_nodes.repeat(structure.dim)]
        structure.now.v = initial.v + np.where(held, 0.0, rigid)
        structure.now.a = initial.a.copy()
        structure.take_start(initial.u)
