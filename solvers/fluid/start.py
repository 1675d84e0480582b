"""The start of a coupled flow: its velocity after an impulse, or its initial rate, by which it is extrapolated back."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
from mpi4py import MPI

from solvers.api import Array
from solvers.fluid.bodies.immersed import ImmersedBody
from solvers.fluid.bodies.surface import Motion
from solvers.fluid.field import Fluid
from solvers.fluid.time_scheme import Difference, FlowStep
from solvers.values import evaluate_components

#: Difference of the velocity of boundary or bodies from the initial flow, relative to the largest one, above which the
#: flow starts impulsively.
JUMP = 1e-6

#: Length of a start step over that of the first step of the run. It is short, so that friction hardly changes the flow.
#: From 0.1 to 0.0001 the velocity of a falling sphere after the first step changes by 0.25 %. From 0.1 to 0.001 the
#: first rate of a disc in fluid of its density changes by less than 0.03 % (docs/verification_coupling.md).
SHARE = 0.01


class FlowStart:
    """Short steps of backward Euler from the initial velocity, with the loads at the start."""

    share = SHARE

    def __init__(self, fluid: Fluid):
        self.fluid = fluid

    @property
    def smallest_cell(self) -> float:
        """Shortest edge of a cell [m]."""
        return self.fluid.smallest_cell

    @property
    def accelerates(self) -> bool:
        """Whether its time scheme uses the acceleration at the start."""
        return self.fluid.scheme.times > 1

    def at_once(self, surfaces: Mapping[str, Motion]) -> bool:
        """Whether the flow starts impulsively: boundary or bodies have another velocity than the flow (collective).

        surfaces: motions of coupled bodies by name; others are as prescribed. Those outside of the box do not count.
        """
        fluid, t, initial = self.fluid, self.fluid.current.t, self.fluid.settings.initial_velocity
        on_boundary, there = fluid.boundary.velocity(t), fluid.history.past[0].velocity[fluid.boundary.dofs]
        pairs = [(on_boundary, there)]
        for body in fluid.bodies:
            motion = surfaces[body.surface.name] if body.motion is None else body.motion(t)
            if fluid.outside({body.surface.name: motion}):
                continue
            flow = np.zeros_like(motion.x) if initial is None else evaluate_components(initial, motion.x.T, t).T
            pairs.append((motion.v, flow))
        jump = max(np.abs(a - b).max(initial=0.0) for a, b in pairs)
        speed = max(np.abs(some).max(initial=0.0) for pair in pairs for some in pair)
        jump, speed = (fluid.comm.allreduce(float(size), op=MPI.MAX) for size in (jump, speed))
        return jump > JUMP * speed

    @contextmanager
    def step(self, t: float, short: float, of_solid: float) -> Iterator[None]:
        """A short start step: a context in which the flow can be solved for the motion of coupled surfaces.

        Positions and loads are those of t. Velocities of boundary and prescribed bodies are those at the end of the
        step. A coupled surface that is displaced by of_solid^2 a gets the velocity a short.
        """
        fluid = self.fluid
        bodies, rate = fluid.bodies, short / of_solid**2
        fluid.bodies = [b if b.motion is None else _with_later_velocity(b, b.motion, short) for b in bodies]
        try:
            fluid.begin_step(t - short, short)
            fluid.sweep.past = ()  # nothing moves
            fluid.prescribe(t + short)
            fluid.current = FlowStep(t, short, Difference(rate, (rate,)))
            yield
        finally:
            fluid.bodies = bodies

    def end(self, dt: float, before: Sequence[Mapping[str, Motion]]) -> None:
        """Restore the initial velocity, and extrapolate those before it by the rate of the last start step.

        before: motions of coupled surfaces at the times before the start, newest first. Prescribed ones are
        extrapolated by their acceleration at the start.
        """
        fluid = self.fluid
        fluid.sweep.past = tuple(self._positions(k * dt, dt, moved) for k, moved in enumerate(before, 1))
        found, start = fluid.system.active_dofs.copy(), fluid.history.past[0].velocity
        fluid.history.continue_back(dt, np.where(found, fluid.velocity() - start, 0.0) / (SHARE * dt), found)
        moving = fluid.unknowns.velocity_mask
        fluid.flow[moving] = start[moving]
        fluid.current = FlowStep(fluid.current.t, dt, fluid.history.difference(dt))

    def _positions(self, back: float, dt: float, coupled: Mapping[str, Motion]) -> Array:
        """Positions [m] of all vertices at a time `back` [s] before the start."""
        fluid, t, short = self.fluid, self.fluid.current.t, SHARE * dt
        found = [np.empty((0, fluid.dim))]
        for body in fluid.bodies:
            if body.motion is None:
                found.append(coupled[body.surface.name].x)
                continue
            now, later = body.motion(t), body.motion(t + short)
            found.append(now.x - back * now.v + 0.5 * back**2 * (later.v - now.v) / short)
        return np.concatenate(found)

    def end_impulse(self, dt: float) -> None:
        """Take the velocity of the last start step for the initial one; dt [s]: length of the first step."""
        fluid = self.fluid
        fluid.history.start(fluid.velocity(), fluid.system.active_dofs.copy())
        fluid.current = FlowStep(fluid.current.t, dt, fluid.history.difference(dt))

    def forget_step(self) -> None:
        """Let the first step start from the present history."""
        self.fluid.forget_step()


def _with_later_velocity(body: ImmersedBody, motion: Callable[[float], Motion], dt: float) -> ImmersedBody:
    """The body with the velocity that it has dt [s] later."""
    return replace(body, motion=lambda t: Motion(motion(t).x, motion(t + dt).v))
