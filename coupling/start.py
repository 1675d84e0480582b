"""The initial state of a coupled run: velocities of both fields that agree, and consistent accelerations.

Where rigid bodies or the boundary have another velocity than the flow at their surface, the flow starts impulsively: an
impulse of the pressure gives both the velocity that they share. It is found by one step of backward Euler of a length k
in which nothing moves,

    M (v - v_0) / k = f_fluid,    rho (w - w_0) / k + ... = 0,    w = v on the surface,

so that momentum is kept. Without it, a body that is thrown into fluid at rest would have its own velocity in the first
step's displacement and that of the fluid at its end, oscillate, and BDF2 would lose half of the difference of the first
two velocities of the fluid. Such a flow has no acceleration at the start.

Else the accelerations have to agree.

With the acceleration of the structure alone, and no force of the fluid, a solid in a fluid of its own density would
start 1.7 times too fast. An elastic body would also oscillate, because the force of the fluid acts on its boundary
only. Motions that steps of length h do not resolve have to be in equilibrium from the start. One step of backward Euler
to the same time,

    M (u - u_0) / h^2 + f_int(u) = f_ext(t) + f_fluid,   rho (w - w_0) / k + ... = 0,   w = v_0 + k (u - u_0) / h^2,

gives an acceleration a = (u - u_0) / h^2 in which motions of frequency omega have the share F = 1 / (1 + (omega h)^2).
n such steps, each from the displacement of the last one and from the same velocities, leave the share F^n. The run
starts with

    u_0 + sum_k (du_k - du_n),   a = du_n / h^2,   the force of the last step,

which changes slow motions by a term of order h^4, and rigid motions not at all.

The grid is cut at the first position of the bodies during the start, so that they must not move by a cell there:
n h^2 a < the shortest edge, with the acceleration a of the solid alone. Where h = dt is too long for that, h = dt / 2^m
is the first part of the first step (`coupling.divided`).
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from coupling.coupled import Coupled
from coupling.divided import lengths
from coupling.ports import Start
from solvers.api import Array, StepFailed

#: Note for the user.
NO_BALANCE = (
    "the first accelerations of flow and solid were not found together ({}); the run starts with that of the solid "
    "alone, and its first steps are less accurate"
)
NO_IMPULSE = (
    "the velocities that flow and solid share after the impulsive start were not found together ({}); the first steps "
    "are less accurate"
)


def start_together(
    coupled: Coupled, t: float, dt: float, solve: Callable[[], object], *, with_solid: bool = False
) -> None:
    """Compute the state from which the first step of length dt [s] starts (collective).

    solve: solves a step of both fields that has begun; with_solid: as one system.
    The initial state is kept in these cases: the solid has no inertia; the flow starts impulsively around elastic
    bodies; the flow uses backward Euler, whose velocities are those of the middle of a step, and does not start
    impulsively; a start step does not converge, with a note to the user.
    """
    if coupled.start is None:
        return
    flow, solid, interface = coupled.start.flow, coupled.start.solid, coupled.interface
    velocity, initial = solid.velocity(), coupled.save()
    surfaces = interface.at_start(velocity)
    at_once = flow.at_once(surfaces)
    solid.leave_out(coupled.flow.outside(surfaces))
    try:
        if at_once and solid.impulsive:
            _share_momentum(coupled, coupled.start, t, dt, velocity, solve)
        elif flow.accelerates and not at_once:
            _share_acceleration(coupled, coupled.start, t, dt, velocity, solve)
        else:
            return
    except StepFailed as failure:
        coupled.restore(initial)
        coupled.notes.append((NO_IMPULSE if at_once else NO_BALANCE).format(failure.reason))
        return
    flow.forget_step()
    coupled.flow.move(interface.move(interface.now), with_solid=with_solid)


def _share_momentum(
    coupled: Coupled, start: Start, t: float, dt: float, velocity: Array, solve: Callable[[], object]
) -> None:
    """Set the velocities after the impulse; velocity: of the vertices before it [m/s]."""
    short = start.flow.share * dt
    with start.flow.step(t, short, short):
        coupled.interface.begin_start(coupled.flow.current.difference, velocity)
        with start.solid.step(t, short):
            solve()
    start.solid.end_impulse(short)
    start.flow.end_impulse(dt)
    coupled.interface.initialise()
    coupled.solid.load(np.zeros_like(velocity))


def _share_acceleration(
    coupled: Coupled, start: Start, t: float, dt: float, velocity: Array, solve: Callable[[], object]
) -> None:
    """Set accelerations and the flow before the start; velocity: of the vertices [m/s]."""
    interface = coupled.interface
    moved = start.solid.steps * dt**2 * start.solid.acceleration()
    if moved > start.flow.smallest_cell:
        dt = lengths(dt, dt * math.sqrt(start.flow.smallest_cell / moved))[0]
    for _ in range(start.solid.steps):
        before = interface.displacement()
        with start.flow.step(t, start.flow.share * dt, dt):
            interface.begin_start(coupled.flow.current.difference, velocity)
            with start.solid.step(t, dt):
                solve()
    acceleration = (interface.displacement() - before) / dt**2
    force = coupled.force()
    start.solid.end()
    interface.end_start(dt, velocity, acceleration)
    start.flow.end(dt, [interface.at_start(velocity, past) for past in interface.past])
    coupled.balance.given = coupled.solid.reduced(force)
