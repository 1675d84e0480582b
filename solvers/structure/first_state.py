"""Schemes for the initial state: of massless nodes, and of loads that depend on the acceleration."""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from solvers.algebra.blocks import times
from solvers.api import Array
from solvers.structure.instant import MovingStructure
from solvers.structure.time_scheme import Statics


class SmoothAcceleration(Statics):
    """M (u - u_n) / dt^2 + C v + f_int(u) = f_ext(t), with the velocity v before the step."""

    def motion(self, structure: MovingStructure, dt: float) -> tuple[Array, Array]:
        a = (structure.now.u - structure.old.u) / dt**2
        a[structure.inertia.find_massless()] = 0.0
        return structure.now.v, a

    def rigid_force(self, structure: MovingStructure, dt: float) -> Array:
        now, rigid, frame = structure.now, structure.inertia.find_rigid(), structure.inertia.frame
        return now.rigid if rigid is None or frame is None else rigid.force_by_acceleration(frame, now.v, now.a)

    def rigid_factor(self, dt: float) -> float:
        return 1.0 / dt**2

    def balance(self, structure: MovingStructure) -> Array:
        now = structure.now
        return self.reaction(structure) + times(structure.inertia.assemble_mass(), now.a) + now.rigid + now.damping

    def dynamic_stiffness(self, structure: MovingStructure, dt: float) -> PETSc.Mat:
        matrix = structure.inertia.assemble_mass().copy()
        matrix.scale(1.0 / dt**2)
        return matrix


class FirstState(Statics):
    """f_int(u) + C v = f_ext(t) for massless nodes, in a short step dt from u_0.

    Without damping their positions are those of equilibrium. With damping they hardly move, and v = (u - u_0) / dt is
    their initial velocity. Velocities of other nodes, and what supports prescribe to massless ones, are given.
    """

    def __init__(self, *, damped: bool):
        """damped: whether the structure has damping."""
        self._damped = damped

    def motion(self, structure: MovingStructure, dt: float) -> tuple[Array, Array]:
        v, held = structure.now.v, structure.held
        if self._damped:
            v = held.part(v) + held.free_part(structure.now.u - structure.old.u) / dt
        return v.copy(), structure.now.a

    def balance(self, structure: MovingStructure) -> Array:
        return self.reaction(structure) + structure.now.damping

    def damping_slope(self, structure: MovingStructure, dt: float) -> Array | None:
        return np.full(structure.layout.size, 1.0 / dt)
