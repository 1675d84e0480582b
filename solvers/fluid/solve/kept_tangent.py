"""The tangent of a flow where it was linearised last in a step, which later iterates may keep."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers.algebra.rounding import rounding_error
from solvers.api import Array
from solvers.fluid.solve.system import FlowSystem


class KeptTangent:
    """The latest tangent of the step, the dofs that it holds, and the rounding error of the residual there.

    Each linearisation overwrites the matrix of the one before. Nothing is kept from step to step.
    """

    def __init__(self, system: FlowSystem):
        self._system = system
        self.rounding: Array | None = None  #: of the residual at owned dofs; None before this step linearises
        self.diagonal = np.zeros(system.unknowns.owned)  #: its magnitude at owned dofs
        self._slopes = np.zeros(0)  # of the driving forces
        self._held = np.zeros(system.unknowns.owned, dtype=bool)
        self._prepared: PETSc.Mat | None = None  # at the present iterate, if it is assembled already
        self._matrix: PETSc.Mat | None = None  # of the last increment

    def begin_step(self) -> None:
        """Forget the tangent of the last step. A resumed run, whose state does not have it, must start alike."""
        self.rounding = self._prepared = self._matrix = None

    def linearise(self, held: NDArray[np.bool_], values: Array, *, picard: bool) -> PETSc.Mat:
        """The tangent at the present iterate (collective).

        held: owned dofs with rows of the identity; values: those whose rounding enters the residual, at owned dofs;
        picard: of Picard's method.
        """
        self._held = held.copy()
        matrix = self._system.tangent(held, picard=picard)
        self.diagonal = np.abs(matrix.getDiagonal().array)
        # an entry is a sum over the 2^dim cells at a node, whose terms may cancel
        self.rounding = 2.0**self._system.grid.dim * rounding_error(matrix, values)
        self.rounding += self._system.outlets.rounding(values)
        self._slopes = self._system.driving.slopes(matrix, held)
        return matrix

    def added_product(self, held: NDArray[np.bool_]) -> Callable[[Array], Array] | None:
        """The part of low rank that the matrix lacks, as a product with owned values; None: zero."""
        outlets, driving = self._system.outlets.product(held), self._system.driving.product(held, self._slopes)
        if outlets is None or driving is None:
            return outlets or driving
        return lambda x: outlets(x) + driving(x)

    def rounding_error(self, linearise: Callable[[], PETSc.Mat]) -> Array:
        """`rounding` where this step linearised last; where it has not, at the present iterate."""
        if self.rounding is None:
            self._prepared = linearise()
        assert self.rounding is not None
        return self.rounding

    def add_rounding(self, error: Array) -> None:
        """Add other rounding errors at owned dofs; call it after `linearise`."""
        assert self.rounding is not None
        self.rounding = self.rounding + error

    def of_increment(self, linearise: Callable[[], PETSc.Mat], *, keep: bool) -> PETSc.Mat:
        """The tangent of the next increment: that of the last one if it is kept, else that of the present iterate."""
        if self._matrix is None or not keep:
            self._matrix = self._prepared or linearise()
        self._prepared = None
        return self._matrix

    def holds(self, held: NDArray[np.bool_]) -> bool:
        """Whether its rows of the identity on this process are these."""
        return bool(np.array_equal(held, self._held))
