"""The interface `CutPenalty` of the terms that stabilise poorly cut cells and extend the flow behind the surface.

`FacePenalty`, for q1q1, penalises jumps of derivatives across faces. `ExtensionPenalty`, for q2q1, penalises the
distance to the polynomial of a well-cut cell. Jumps act as an artificial viscosity along bodies. The distance does not,
and results do not depend on its factor. With q1q1 this advantage is small, and the pressure, which is extended with its
gradient in one cell, depends more on the position of the cut (docs/verification_fluid.md).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers import fem
from solvers.api import Array
from solvers.fluid.cut.cut import Cut
from solvers.fluid.terms.matrix import Pattern


@dataclass(frozen=True)
class Scales:
    """Scales of the terms of the momentum equation at the last iterate."""

    viscosity: float  #: [Pa s]
    density: float  #: [kg/m^3]
    alpha: float  #: d(u_t)/du [1/s]
    cell_speed: Array  #: largest velocity in each local cell [m/s]
    speed: Array  #: at each local node of the velocity [m/s]


class CutPenalty(Protocol):
    """A symmetric matrix for one cut, and the nodes whose values are extended from others."""

    @property
    def by_faces(self) -> bool:
        """Whether it couples the unknowns of cells with a common face."""
        ...

    @property
    def integrals(self) -> list[fem.Integral]:
        """Forms to compile."""
        ...

    @property
    def outside(self) -> NDArray[np.bool_]:
        """Mask of owned dofs that are no unknowns: `settle` sets their values."""
        ...

    @property
    def undetermined(self) -> NDArray[np.bool_]:
        """Mask of local dofs of active cells that no equation determines."""
        ...

    def begin_step(self, unknown: NDArray[np.bool_]) -> None:
        """Start a step; unknown: mask of local dofs without the velocities of earlier steps that it needs."""
        ...

    def set_scales(self, scales: Scales) -> None: ...

    def set_cut(self, cut: Cut, prescribed: NDArray[np.int64]) -> bool:
        """Set the cut (collective); prescribed: local dofs with given values. True if `extra_entries` has changed."""
        ...

    @property
    def stale(self) -> bool:
        """Whether cut or scales have changed since the last `assemble`."""
        ...

    def extra_entries(self) -> NDArray[np.int64] | None:
        """Count of entries in each owned row in addition to those of the pattern (collective)."""
        ...

    def fill(self, matrix: PETSc.Mat, pattern: Pattern) -> None:
        """Insert all entries that it may have, with arbitrary values (collective)."""
        ...

    def assemble(self, matrix: PETSc.Mat, history: Array) -> None:
        """Add its matrix, and set its term of the earlier steps at local dofs (collective)."""
        ...

    def settle(self, values: Array) -> Array:
        """Values at owned dofs, with those of `outside` extended from the others (collective)."""
        ...
