"""What continues the flow into poorly cut cells and behind the surface, as the discrete equations see it.

`FacePenalty`: jumps of derivatives across faces, for q1q1. `ExtensionPenalty`: the distance to the polynomial of a
well-cut cell, for q2q1. Jumps are an artificial viscosity along bodies; the distance is not, and results do not depend
on its factor. With q1q1 that gain is small, and the pressure, which is continued by its gradient in one cell, depends
more on where the cut falls (docs/verification_fluid.md).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers import fem
from solvers.api import Array
from solvers.fluid.cut import Cut
from solvers.fluid.matrix import Pattern


@dataclass(frozen=True)
class Scales:
    """What the equations are like before an iterate."""

    viscosity: float  #: [Pa s]
    density: float  #: [kg/m^3]
    alpha: float  #: d(u_t)/du [1/s]
    cell_speed: Array  #: largest velocity in each local cell [m/s]
    speed: Array  #: at each local node of the velocity [m/s]


class GhostPenalty(Protocol):
    """A symmetric matrix of one cut, and nodes that it continues the flow to; arrays of owned dofs."""

    @property
    def by_faces(self) -> bool:
        """It couples the unknowns of cells with a common face."""
        ...

    @property
    def integrals(self) -> list[fem.Integral]:
        """What is to be compiled."""
        ...

    @property
    def outside(self) -> NDArray[np.bool_]:
        """Owned dofs that are no unknowns: `settle` says what they are."""
        ...

    @property
    def undetermined(self) -> NDArray[np.bool_]:
        """Local dofs of active cells that nothing determines."""
        ...

    def begin_step(self, unknown: NDArray[np.bool_]) -> None:
        """`unknown`: local dofs whose velocity before no step has found."""
        ...

    def set_scales(self, scales: Scales) -> None: ...

    def set_cut(self, cut: Cut, prescribed: NDArray[np.int64]) -> bool:
        """Take a cut; True if `extra_entries` has changed. `prescribed`: local dofs with given values (collective)."""
        ...

    @property
    def stale(self) -> bool:
        """Cut or scales are others than those of the last `assemble`."""
        ...

    def extra_entries(self) -> NDArray[np.int64] | None:
        """Entries in each owned row besides those of the pattern (collective)."""
        ...

    def fill(self, matrix: PETSc.Mat, pattern: Pattern) -> None:
        """Insert all entries that it may have, with any values (collective)."""
        ...

    def assemble(self, matrix: PETSc.Mat, history: Array) -> None:
        """Add its matrix, and set what it has of the times behind at local dofs (collective)."""
        ...

    def settle(self, values: Array) -> Array:
        """Owned values with those of `outside` (collective)."""
        ...
