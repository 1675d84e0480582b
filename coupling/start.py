"""The initial state of a coupled run: velocities of both fields that agree, and consistent accelerations.

Formulas and exceptions: docs/theory_coupling.md, Start. Without an impulse, a body that is thrown into fluid at rest
would have its own velocity in the first step's displacement and that of the fluid at its end, oscillate, and BDF2 would
lose half of the difference of the first two velocities of the fluid. With the acceleration of the structure alone, a
solid in a fluid of its own density would start 1.7 times too fast.

The grid is cut at the first position of the bodies during the start, so that they must not move by a cell there.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np

from coupling.coupled import Coupled
from coupling.divided import lengths
from coupling.ports import Start
from solvers.api import Array, StepFailed

#: Way in the first step, in cells, below which a body counts as at rest: its acceleration may be rounding. From 1e-9 to
#: 1e-3 discs of the density of the fluid and of twice that start alike; less than this way only the place can be wrong.
REST = 1e-6

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
    coupled: Coupled,
    t: float,
    dt: float,
    solve: Callable[[], object],
    *,
    roughly: Callable[[], object] | None = None,
    with_solid: bool = False,
) -> None:
    """Compute the state from which the first step of length dt [s] starts (collective).

    solve: solves a step of both fields that has begun; roughly: to a per cent, None: `solve`; with_solid: together.
    The initial state is kept in these cases: the solid has no inertia; the flow starts impulsively around elastic
    bodies, which take the first step by backward Euler; the flow around elastic bodies uses backward Euler, whose
    velocities are those of the middle of a step, and does not start impulsively; a start step does not converge, with
    a note to the user.
    """
    if coupled.start is not None:
        flow, solid = coupled.start.flow, coupled.start.solid
        jump = flow.jump(coupled.interface.at_start(solid.velocity()), solid.gained(t, dt))
        _start(coupled, coupled.start, t, dt, solve, roughly or solve, with_solid=with_solid, jump=jump)


def start_again(
    coupled: Coupled, t: float, dt: float, solve: Callable[[], object], *, with_solid: bool = False
) -> None:
    """Start anew for a step of length dt [s], after one that took the impulse of an impulsive start (collective)."""
    assert coupled.start is not None
    solid = coupled.start.solid
    solid.begin()
    if not _start(coupled, coupled.start, t, dt, solve, solve, with_solid=with_solid, jump=0.0):
        solid.take_impulse(lambda: dt, always=False)  # in one more step: its acceleration is that of the impulse still


def start_at_jump(
    coupled: Coupled, t: float, dt: float, solve: Callable[[], object], *, with_solid: bool = False
) -> None:
    """Start anew at t [s], where given velocities jump, for a step of length dt [s] (collective)."""
    assert coupled.start is not None
    load = coupled.force()
    coupled.start.flow.forget_earlier()
    _start(coupled, coupled.start, t, dt, solve, solve, with_solid=with_solid, jump=math.inf, load=load)


def _start(
    coupled: Coupled,
    start: Start,
    t: float,
    dt: float,
    solve: Callable[[], object],
    roughly: Callable[[], object],
    *,
    with_solid: bool,
    jump: float,
    load: Array | None = None,
) -> bool:
    """Start; False: a start step does not converge.

    jump: velocity [m/s] of an impulsive start, zero: none; load: on the vertices [N] without the impulse, None: zero;
    the others as in `start_together`.
    """
    flow, solid, interface = start.flow, start.solid, coupled.interface
    velocity, initial = solid.velocity(), coupled.save()
    surfaces = interface.at_start(velocity)
    solid.leave_out(coupled.flow.outside(surfaces))
    try:
        if jump > 0.0:
            step = partial(_impulse, coupled, start, t, dt, velocity, solve)
            if not solid.take_impulse(step, always=load is not None):
                return True
            flow.end_impulse(dt)
            interface.initialise()
            coupled.solid.load(np.zeros_like(velocity) if load is None else load)
        elif flow.accelerates or solid.steps == 1:
            _share_acceleration(coupled, start, t, dt, velocity, solve, roughly)
        else:
            return True
    except StepFailed as failure:
        coupled.restore(initial)
        coupled.notes.append((NO_IMPULSE if jump > 0.0 else NO_BALANCE).format(failure.reason))
        return False
    flow.forget_step()
    coupled.flow.move(interface.move(interface.now), with_solid=with_solid)
    return True


def _impulse(
    coupled: Coupled, start: Start, t: float, dt: float, velocity: Array, solve: Callable[[], object]
) -> float:
    """Solve a start step with the impulse, and return its length [s]; velocity: of the vertices before it [m/s]."""
    short = start.flow.share * dt
    with start.flow.step(t, short, short):
        coupled.interface.begin_start(coupled.flow.difference, velocity)
        with start.solid.step(t, short):
            solve()
    return short


def _share_acceleration(
    coupled: Coupled,
    start: Start,
    t: float,
    dt: float,
    velocity: Array,
    solve: Callable[[], object],
    roughly: Callable[[], object],
) -> None:
    """Set accelerations and the flow before the start; velocity: of the vertices [m/s]."""
    interface = coupled.interface
    moved = start.solid.steps * dt**2 * start.solid.acceleration()
    if moved > start.flow.smallest_cell:
        dt = lengths(dt, dt * math.sqrt(start.flow.smallest_cell / moved))[0]
    if start.solid.steps == 1:  # free bodies, which the flow may brake
        dt = lengths(dt, dt / max(1.0, _decay(coupled, start, t, dt, velocity, roughly)))[0]
        coupled.longest_first = dt
    acceleration = _acceleration(coupled, start, t, dt, start.flow.share * dt, velocity, solve)
    force = coupled.force()
    start.solid.end()
    interface.end_start(dt, velocity, acceleration)
    start.flow.end(dt, [interface.at_start(velocity, past) for past in interface.past])
    coupled.balance.given = coupled.solid.reduced(force)


def _acceleration(
    coupled: Coupled, start: Start, t: float, dt: float, short: float, velocity: Array, solve: Callable[[], object]
) -> Array:
    """Take the start steps, and return the acceleration [m/s^2] of the vertices; short: step of the flow [s]."""
    interface = coupled.interface
    for number in range(start.solid.steps):
        if number > 0:
            start.solid.repeat()
        before = interface.displacement()
        with start.flow.step(t, short, dt):
            interface.begin_start(coupled.flow.difference, velocity)
            with start.solid.step(t, dt):
                solve()
    return (interface.displacement() - before) / dt**2


def _decay(
    coupled: Coupled, start: Start, t: float, dt: float, velocity: Array, roughly: Callable[[], object]
) -> float:
    """L dt of the body that the flow brakes most, by the rate L; zero if it is not found. The state is kept.

    Its acceleration is a / (1 + L k) in a step k of backward Euler of the flow: `late` in k = dt, and `soon` in one
    that is short. A first step should not be longer than 1 / L.
    """
    initial, accelerations = coupled.save(), []
    for k in (start.flow.share * dt, dt):
        try:
            accelerations.append(_acceleration(coupled, start, t, dt, k, velocity, roughly))
        except StepFailed:
            return 0.0
        finally:
            coupled.restore(initial)
    soon, late = (
        [float(np.linalg.norm(motion.v, axis=1).max()) for motion in coupled.interface.at_start(a).values()]
        for a in accelerations
    )
    least = REST * start.flow.smallest_cell / dt**2
    return max((a / b - 1.0 for a, b in zip(soon, late, strict=True) if min(a, b) > least), default=0.0)
