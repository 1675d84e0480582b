"""The state of a structure at one time, and the interface of structures for time schemes."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Protocol

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from solvers.algebra.blocks import Layout
from solvers.api import Array, Step
from solvers.constraint import Constraint
from solvers.structure.body import Body
from solvers.structure.body_pieces import BodyPieces
from solvers.structure.held import Held
from solvers.structure.inertia import ElasticInertia


@dataclass
class Instant:
    """The state of a structure at one time; arrays over the owned dofs of all bodies, body by body."""

    u: Array  #: displacement [m]
    v: Array  #: velocity [m/s]
    a: Array  #: acceleration [m/s^2]
    internal: Array  #: internal force [N]
    loads: Array  #: loads of its own [N]
    surface: Array  #: load by another field [N]
    constraint: Array  #: contact force [N]
    damping: Array  #: force of damping [N]
    mean: Array  #: displacement of the last step over its length [m/s]
    rigid: Array  #: inertia force [N] that the moved mass lacks, see `rigid_inertia.py`

    @classmethod
    def zeros(cls, size: int) -> Instant:
        return cls(*(np.zeros(size) for _ in fields(cls)))

    @property
    def external(self) -> Array:
        """All loads [N]."""
        return self.loads + self.surface

    def copy(self) -> Instant:
        return Instant(**{name: array.copy() for name, array in vars(self).items()})


class DampingForce(Protocol):
    """A force that depends on the velocity."""

    @property
    def symmetric(self) -> bool:
        """Whether its derivative by the displacement is symmetric if velocities are proportional to displacements."""
        ...

    def force(self, v: Array) -> Array:
        """Force [N] at owned dofs of the velocity v [m/s], at the present displacement."""
        ...

    def add_tangent(self, matrix: PETSc.Mat, v: Array, slope: Array, weight: float) -> None:
        """Add its derivative by the displacement; slope: that of the weighted velocity [1/s], weight: of the force."""
        ...


class MovingStructure(Protocol):
    """A structure with its state at both ends of a step."""

    comm: MPI.Comm
    bodies: list[Body]
    layout: Layout
    pieces: BodyPieces
    inertia: ElasticInertia
    held: Held
    constraint: Constraint | None
    now: Instant
    old: Instant
    residual_force: Array
    current: Step
    dim: int
    last_length: float  #: of the last accepted step [s], 0 at the start
    extrapolation: Array  #: of the velocities of massless dofs in this step, at owned dofs

    @property
    def damping(self) -> DampingForce | None:
        """The damping, None without any."""
        ...
