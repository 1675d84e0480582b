"""Probes of rigid bodies: functions without arguments that return values by component."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from solvers.api import Array
from solvers.rigid import motion
from solvers.rigid.contact import RigidContact
from solvers.rigid.field import RigidBodies

Probe = Callable[[], dict[str, float]]


def at_point(bodies: RigidBodies, index: int, quantity: str, point: Sequence[float]) -> Probe:
    """Probe of the displacement [m] or velocity [m/s] of a point of a body; point: its position at the start [m]."""
    body, at = bodies.bodies[index], np.array([point], dtype=float)

    def probe() -> dict[str, float]:
        now = bodies.now[index]
        arm = body.arms(now.R, at)[0]
        if quantity == "velocity":
            return _components((now.v[:3] + np.cross(motion.spin(now), arm))[: bodies.dim])
        return _components((now.shift + arm - body.arms(np.eye(3), at)[0])[: bodies.dim])

    return probe


def of_body(bodies: RigidBodies, index: int, quantity: str) -> Probe:
    """Probe of the mass [kg], centre [m], momentum [kg m/s] or angular_momentum [kg m^2/s] about the origin."""
    body = bodies.bodies[index]

    def probe() -> dict[str, float]:
        now = bodies.now[index]
        if quantity == "mass":
            return {"": body.inertia.gravitational_mass}
        to_mass, about = now.R @ body.inertia.offset, np.pad(body.inertia.centre, (0, 3 - bodies.dim)) + now.shift
        centre, momentum = about + to_mass, motion.momentum(body, now.R, now.v)
        momentum[:3] += body.inertia.mass * np.cross(motion.spin(now), to_mass)
        if quantity == "angular_momentum":
            total = momentum[3:] + np.cross(about, momentum[:3])
            return _components(total) if bodies.dim == 3 else {"": float(total[2])}
        return _components((centre if quantity == "centre" else momentum)[: bodies.dim])

    return probe


def on_given(contact: RigidContact, name: str, body: int | None) -> Probe:
    """Probe of the contact_force [N] on an obstacle or wall; see `RigidContact.on_given`."""
    return lambda: _components(contact.on_given(name, body))


def _components(values: Array) -> dict[str, float]:
    return {axis: float(value) for axis, value in zip("xyz", values, strict=False)}
