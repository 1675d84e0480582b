"""The first state of a coupled run: accelerations of both fields that belong together.

The acceleration of a structure alone, and no force at the start, would make solids in a fluid of their own density
begin 1.7 times too fast. A body that is let go also rings: within an instant only its boundary feels the fluid. What a
step of length h does not resolve has to be in balance from the start on. One step of backward Euler to the same time,

    M (u - u_0) / h^2 + f_int(u) = f_ext(t) + f_fluid,   rho (w - w_0) / k + ... = 0,   w = v_0 + k (u - u_0) / h^2,

gives an acceleration a = (u - u_0) / h^2 in which motions of frequency omega have the share F = 1 / (1 + (omega h)^2).
n such steps, each from where the last one ended and from the same velocities, leave F^n. The run starts with

    u_0 + sum_k (du_k - du_n),   a = du_n / h^2,   the force of the last step,

which changes slow motions by a term of the order of h^4, whole bodies not at all.
"""

from __future__ import annotations

from collections.abc import Callable

from coupling.coupled import Coupled
from solvers.api import StepFailed

#: Note for the user.
NO_BALANCE = (
    "the first accelerations of flow and solid were not found together ({}); the run starts with that of the solid "
    "alone, and its first steps are less accurate"
)


def start_together(
    coupled: Coupled, t: float, dt: float, solve: Callable[[], object], *, with_solid: bool = False
) -> None:
    """From the initial state to the one that the first step of length dt [s] starts from (collective).

    solve: bring both fields into balance at the end of a step that they have begun; with_solid: as one system.
    Flows that start at once keep the initial state: they have no acceleration. So do solids without inertia, and flows
    by backward Euler: their velocities are those of the middle of a step. So do bodies that the start would move by a
    cell or more, away from the first place of the fluid, and, with a note for the user, those for which no balance is
    found.
    """
    if coupled.start is None:
        return
    start, interface = coupled.start, coupled.interface
    velocity = start.solid.velocity()
    if start.flow.at_once(interface.at_start(velocity)):
        return
    if start.solid.steps * dt**2 * start.solid.acceleration() >= start.flow.smallest_cell:
        return
    initial = coupled.save()
    try:
        for _ in range(start.solid.steps):
            place = interface.displacement()
            with start.flow.step(t, dt):
                interface.begin_start(coupled.flow.current.difference, velocity)
                with start.solid.step(t, dt):
                    solve()
        acceleration = (interface.displacement() - place) / dt**2
        force = coupled.force()
    except StepFailed as failure:
        coupled.restore(initial)
        coupled.notes.append(NO_BALANCE.format(failure.reason))
        return
    start.solid.end()
    start.flow.end(dt)
    interface.end_start(dt, velocity, acceleration)
    coupled.flow.move(interface.move(interface.now), with_solid=with_solid)
    coupled.balance.given = coupled.solid.reduced(force)
