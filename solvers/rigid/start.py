"""The start of rigid bodies in a flow: a step that finds their initial acceleration (`coupling.start`)."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from solvers.api import Array
from solvers.generalised_alpha import BACKWARD_EULER
from solvers.rigid import motion
from solvers.rigid.field import RigidBodies


class RigidStart:
    """Implements `StartOfSolid`. One step is enough, because rigid bodies do not oscillate."""

    steps = 1
    took_impulse = False

    def __init__(self, field: RigidBodies):
        self.field, self._initial = field, list(field.now)
        self._apart: Collection[str] = ()

    def begin(self) -> None:
        """Nothing: no step took an impulse."""

    def leave_out(self, names: Collection[str]) -> None:
        self._apart = names

    def velocity(self) -> Array:
        """Velocities of all vertices [m/s], shape (n, dim)."""
        field, found = self.field, []
        for body, now in zip(field.bodies, field.now, strict=True):
            found.append(now.v[:3] + np.cross(motion.spin(now), body.arms(now.R, body.points)))
        return np.concatenate(found)[:, : field.dim]

    def acceleration(self) -> float:
        """Upper bound of the accelerations of vertices [m/s^2]."""
        largest = 0.0
        for body, now in zip(self.field.bodies, self.field.now, strict=True):
            if body.name in self._apart:
                continue
            a, turning = np.split(motion.acceleration(body, now), 2)
            arm = np.linalg.norm(body.arms(now.R, body.points), axis=1).max()
            largest = max(largest, float(np.linalg.norm(a) + np.linalg.norm(turning) * arm))
        return largest

    def gained(self, t: float, dt: float) -> float:
        return self.acceleration() * dt

    @contextmanager
    def step(self, t: float, dt: float) -> Iterator[None]:
        """Begin a start step from rest, so that a = (u - u_n) / dt^2; held components have their accelerations."""
        field = self.field
        self._initial = list(field.now)
        own, increments = field.scheme, np.zeros((len(field.bodies), 6))
        for index, (body, now) in enumerate(zip(field.bodies, field.now, strict=True)):
            held = body.held_components
            increments[index, held] = dt**2 * motion.acceleration(body, now)[held]
            field.now[index] = replace(now, v=np.zeros(6), p=np.zeros(6))
        field.scheme = BACKWARD_EULER
        try:
            field.begin_step(t - dt, dt, increments)
            yield
        finally:
            field.scheme = own

    def strike(self, dt: float) -> None:
        """Impacts have their own law."""

    def repeat(self) -> None:
        """Not called: there is one step."""

    def end(self) -> None:
        """Restore positions and velocities; rates of momentum are those of the start step."""
        field = self.field
        parts = zip(field.bodies, self._initial, field.now, strict=True)
        field.now = [start if body.name in self._apart else replace(start, p=now.p) for body, start, now in parts]
        field.old = list(field.now)

    def take_impulse(self, step: Callable[[], float], *, always: bool) -> bool:
        """True: the whole body has another velocity at once. Positions are restored."""
        dt, field = step(), self.field
        parts = zip(field.bodies, self._initial, field.now, field.old, field.increments(), strict=True)
        changed = []
        for body, initial, now, old, u in parts:
            v = initial.v.copy()
            if body.name not in self._apart:
                v[:3] += (now.shift - old.shift) / dt
                v[3:] += initial.R.T @ u[3:] / dt
            changed.append(replace(initial, v=v))
        field.now = changed
        field.old = list(field.now)
        return True
