"""The start of a coupled flow: its velocity after an impulse, or its initial rate, by which it is extrapolated back."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import chain

import numpy as np
from mpi4py import MPI

from solvers.fluid.flow.field import Fluid
from solvers.fluid.settings.time_scheme import Difference
from solvers.fluid.surfaces.surface import Motion
from solvers.values import evaluate_components

#: Difference of the velocity of boundary or bodies from the initial flow, relative to the largest in the first step,
#: above which the flow starts impulsively. Velocities of supports and motions are differences, hence not exactly zero.
JUMP = 1e-6

#: Length of a start step over that of the first step of the run. It is short, so that friction hardly changes the flow.
#: From 0.1 to 0.0001 the velocity of a falling sphere after the first step changes by 0.25 %. From 0.1 to 0.001 the
#: first rate of a disc in fluid of its density changes by less than 0.03 % (docs/verification_coupling.md).
START_STEP = 0.01


class FlowStart:
    """Short steps of backward Euler from the initial velocity, with the loads at the start."""

    share = START_STEP

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

    def jump(self, surfaces: Mapping[str, Motion], gained: float) -> float:
        """Largest difference [m/s] of velocities of boundary, bodies and rates from the flow's at an impulsive start.

        0.0: they agree as far as they are known. surfaces: motions of coupled bodies by name; others are as prescribed.
        Those outside of the box do not count. gained: velocity [m/s] that coupled bodies gain in the first step.
        (collective)
        """
        fluid, t, initial = self.fluid, self.fluid.current.t, self.fluid.settings.initial_velocity
        end = t + fluid.current.dt
        on_boundary, there = fluid.parts.boundary.velocity(t), fluid.history.past[0].velocity[fluid.parts.boundary.dofs]
        pairs, later = [(on_boundary, there)], [np.array([gained]), fluid.parts.boundary.velocity(end)]
        for body in fluid.bodies:
            motion = surfaces[body.surface.name] if body.motion is None else body.motion(t)
            if fluid.outside({body.surface.name: motion}):
                continue
            flow = np.zeros_like(motion.x) if initial is None else evaluate_components(initial, motion.x.T, t).T
            pairs.append((motion.v, flow))
            if body.motion is not None:
                later.append(body.motion(end).v)
        if fluid.system.driving.given:
            fluid.system.assemble_interface()  # and what belongs to the cut
            velocity = fluid.history.past[0].velocity[: fluid.size]
            pairs.append(fluid.system.driving.speeds(velocity, t))
            later.append(fluid.system.driving.speeds(velocity, end)[0])
        jump = max(np.abs(a - b).max(initial=0.0) for a, b in pairs)
        speed = max(np.abs(some).max(initial=0.0) for some in chain(later, *pairs))
        jump, speed = (fluid.comm.allreduce(float(size), op=MPI.MAX) for size in (jump, speed))
        return jump if jump > JUMP * speed else 0.0

    @contextmanager
    def step(self, t: float, short: float, of_solid: float) -> Iterator[None]:
        """A short start step: a context in which the flow can be solved for the motion of coupled surfaces.

        Positions and loads are those of t. Velocities of boundary and prescribed bodies are those at the end of the
        step. A coupled surface that is displaced by of_solid^2 a gets the velocity a short.
        """
        rate = short / of_solid**2
        with self.fluid.moving.with_later_velocities(short):
            self.fluid.begin_start_step(t, short, Difference(rate, (rate,)))
            yield

    def end(self, dt: float, before: Sequence[Mapping[str, Motion]]) -> None:
        """Restore the initial velocity, and extrapolate those before it by the rate of the last start step.

        before: motions of coupled surfaces at the times before the start, newest first. Prescribed ones are
        extrapolated by their acceleration at the start.
        """
        self.fluid.end_start(dt, START_STEP * dt, before)

    def end_impulse(self, dt: float) -> None:
        """Take the velocity of the last start step for the initial one; dt [s]: length of the first step."""
        self.fluid.end_impulse(dt)

    @property
    def counts_earlier(self) -> bool:
        """Whether the formulas of the next steps count velocities from before the last."""
        return self.accelerates and len(self.fluid.history.steps) > 0

    def forget_earlier(self) -> None:
        """Let the next steps count no velocity from before the last, as those after the initial one."""
        self.fluid.history.forget_earlier()

    def forget_step(self) -> None:
        """Let the first step start from the present history."""
        self.fluid.forget_step()
