"""The structure at one time, and what time schemes see of it."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Protocol

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from solvers.api import Array
from solvers.blocks import Layout
from solvers.constraint import Constraint
from solvers.structure.body import Body
from solvers.structure.held import Held


@dataclass
class Instant:
    """The structure at one time: owned dofs of all bodies, one body after the other."""

    u: Array  #: displacement [m]
    v: Array  #: velocity [m/s]
    a: Array  #: acceleration [m/s^2]
    internal: Array  #: internal force [N]
    loads: Array  #: loads of its own [N]
    surface: Array  #: load by another field [N]
    constraint: Array  #: contact force [N]

    @classmethod
    def zeros(cls, size: int) -> Instant:
        return cls(*(np.zeros(size) for _ in fields(cls)))

    @property
    def external(self) -> Array:
        """All loads [N]."""
        return self.loads + self.surface

    def copy(self) -> Instant:
        return Instant(**{name: array.copy() for name, array in vars(self).items()})


class Moving(Protocol):
    """Bodies with their state at both ends of a step."""

    comm: MPI.Comm
    bodies: list[Body]
    layout: Layout
    held: Held
    constraint: Constraint | None
    now: Instant
    old: Instant

    @property
    def mass(self) -> PETSc.Mat:
        """Mass matrix of all bodies [kg]."""
        ...
