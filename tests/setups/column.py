"""Somebody else's flow for the couplings: a column of fluid between a moving wall and an open end, with two unknowns.

It knows nothing of `solvers.fluid`. With the mass M = rho A L of the column, its velocity u and its pressure p at the
wall, whose mean velocity is g,

    A (u - g) = 0,    M u_t - A p = 0,

so that its force on the wall is -M u_t: the wall has the mass of the column in addition to its own.
"""

from __future__ import annotations

import math

import numpy as np
from petsc4py import PETSc

from solvers.algebra.sparse import sparse_from_entries
from solvers.api import StepInfo
from solvers.exchange import Difference, InterfaceEntries
from solvers.mesh.tessellation import area_vectors
from solvers.timing import Timer


class Column:
    """Implements `Flow` on one process: a column along x in front of the facets of a surface that look there."""

    name, size, steady, renewals, times = "column", 2, False, 0, 2
    far, iterative, longest_step = False, None, math.inf

    def __init__(self, surface: str, points, facets, *, density: float, length: float, velocity: float = 0.0):
        """velocity: of column and wall at the start [m/s]."""
        self.surface, self.dim, self.timer, self.notes = surface, points.shape[1], Timer(), []
        facing = np.maximum(area_vectors(points[facets])[:, 0], 0.0) / self.dim
        areas = np.bincount(facets.ravel(), np.repeat(facing, self.dim), len(points))
        self.area, self.shares = areas.sum(), areas / areas.sum()
        self.mass = density * self.area * length
        self.unknowns, self.last, self.rows = np.array([velocity, 0.0]), np.zeros(2), np.zeros(2)
        self.past, self.steps, self.wall = [velocity, velocity], 0, velocity
        self.difference, self.ended = Difference(0.0), 0.0  # M u_t of the last step

    def initialise(self, t, dt): ...

    def begin_step(self, t, dt):
        """Backward Euler twice, then BDF2 with equal steps."""
        first = Difference(1.0 / dt, (1.0 / dt,))
        self.difference = first if self.steps < 2 else Difference(1.5 / dt, (2.0 / dt, -0.5 / dt))

    def predict(self, *, with_pressure=False):
        self.last = np.zeros(2)

    def end_step(self):
        self.ended = self.momentum_rate()
        self.past, self.steps = [self.unknowns[0], self.past[0]], self.steps + 1

    def move(self, surfaces, *, with_solid=False):
        self.wall = self.shares @ surfaces[self.surface].v[:, 0]

    def momentum_rate(self):
        """M u_t [N]."""
        earlier = sum(beta * u for beta, u in zip(self.difference.beta, self.past, strict=False))
        return self.mass * (self.difference.alpha * self.unknowns[0] - earlier)

    def matrix(self):
        return np.array([[self.area, 0.0], [self.mass * self.difference.alpha, -self.area]])

    # ---------------------------------------------------------------------------- the system that Newton solves

    def follow(self): ...

    def residual(self):
        u, p = self.unknowns
        self.rows = np.array([self.area * (u - self.wall), self.momentum_rate() - self.area * p])
        return np.array([np.hypot(self.mass * self.difference.alpha / self.area * self.rows[0], self.rows[1])])

    def forces(self):
        return np.abs([max(self.mass * self.difference.alpha * self.wall, self.area * self.unknowns[1], key=abs)])

    def advance(self, *, keep=False, reduction=0.0):
        return self.update(np.linalg.solve(self.matrix(), self.right_side()))

    def solve(self):
        first = self.residual()
        self.advance()
        return StepInfo(1, (float(first[0]), float(self.residual()[0])))

    def linearise(self):
        values = self.matrix().ravel()
        arrays = np.array([0, 2, 4], dtype=PETSc.IntType), np.array([0, 1, 0, 1], dtype=PETSc.IntType), values
        return PETSc.Mat().createAIJ((2, 2), csr=arrays, comm=PETSc.COMM_SELF)

    def right_side(self):
        return -self.rows

    def update(self, increment):
        self.last, self.unknowns = increment.copy(), self.unknowns + increment
        return np.array([np.linalg.norm(increment) / max(np.linalg.norm(self.unknowns), 1e-300)])

    def retreat(self, fraction):
        self.unknowns = self.unknowns - fraction[0] * self.last

    def linked(self):
        return np.zeros(1, dtype=np.int64)

    def only_rounding(self):
        return self.residual() <= 8.0 * np.finfo(float).eps * self.forces()

    def keeps_tangent(self):
        return True

    def settled(self):
        return True

    def cycle(self):
        return ""

    def astray(self, risen):
        return np.zeros(1, dtype=bool)

    def worst(self):
        return None

    def rounded(self):
        return self.unknowns

    def add_rounding(self, error): ...

    # ---------------------------------------------------------------------------------------------- the surface

    def force(self):
        found = np.zeros((len(self.shares), self.dim))
        found[:, 0] = -self.area * self.unknowns[1] * self.shares
        return {self.surface: found}

    def added_product(self):
        return None

    def interface_entries(self, surfaces):
        assert list(surfaces) == [self.surface]
        n = self.dim * len(self.shares)
        along, zero = self.dim * np.arange(len(self.shares)), np.zeros(len(self.shares), dtype=np.int64)
        weights = self.area * self.shares
        return InterfaceEntries(
            sparse_from_entries(along, zero, -self.difference.alpha * weights, (n, 2)),
            sparse_from_entries(along, zero + 1, -weights, (n, 2)),
            sparse_from_entries(zero[:0], zero[:0], weights[:0], (n, n)),
        )

    def balances(self):
        force = np.zeros(self.dim)
        force[0] = -self.ended
        return force, 0.0, 0.0

    def unsolved(self):
        return abs(self.rows[1]), abs(self.rows[0])

    # ------------------------------------------------------------------------- what other flows have and this has not

    def outside(self, surfaces):
        return set()

    def has_films(self):
        return False

    def release(self):
        return False

    def squeezed(self):
        return np.zeros(0)

    def add_levels(self, distance): ...

    def suction(self):
        return 0.0

    def save(self):
        return {"unknowns": self.unknowns.copy(), "past": list(self.past), "steps": self.steps}

    def restore(self, state):
        self.unknowns, self.past, self.steps = state["unknowns"].copy(), list(state["past"]), state["steps"]
