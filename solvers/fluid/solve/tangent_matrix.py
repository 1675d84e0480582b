"""The matrix of the flow: allocated for the couplings of a cut and the next ones, anew where those are not enough."""

from __future__ import annotations

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from solvers import fem
from solvers.api import Array
from solvers.fluid.cut.cut import Cut
from solvers.fluid.mesh.space import Unknowns
from solvers.fluid.solve.hanging_system import HangingSystem
from solvers.fluid.terms.matrix import Pattern, choose_pattern, create_matrix, fits, pattern_of, quick_copy
from solvers.fluid.terms.poorly_cut.ghost import CutPenalty
from solvers.fluid.terms.poorly_cut.penalty_matrix import PenaltyMatrix


class TangentMatrix:
    """A matrix for the tangents of one discretisation; its values are those that were added last."""

    def __init__(
        self,
        unknowns: Unknowns,
        cut_penalty: CutPenalty | None,
        hanging: HangingSystem | None,
        of_cells: fem.Integral,
        *,
        blocked: bool,
    ):
        """of_cells: a form over cells with all couplings within a cell; blocked: store dense blocks."""
        self._unknowns, self._cut_penalty, self._hanging = unknowns, cut_penalty, hanging
        self._of_cells, self._blocked = of_cells, blocked
        self.values = PETSc.Mat()  #: with all entries of the pattern
        self.pattern: Pattern | None = None  #: None: not allocated yet
        #: the ghost penalty within this pattern; None: to be assembled, or none
        self.penalty: PenaltyMatrix | None = None

    def fit(self, cut: Cut, *, changed: bool) -> None:
        """Allocate the matrix anew if a cut has couplings that it lacks (collective).

        changed: the couplings of the cut penalty are others.
        """
        if not fits(self._unknowns, self.pattern, cut):
            self._allocate(choose_pattern(self._unknowns, cut, by_faces=self._by_faces))
        elif changed:
            assert self.pattern is not None
            self._allocate(self.pattern)

    def state(self) -> Array:
        """The pattern as two flags per owned cell: couplings in the cell, and across its faces."""
        grid, pattern = self._unknowns.grid, self.pattern
        if pattern is None:
            return np.zeros((grid.owned, 2))
        return np.stack([pattern.cells, pattern.reach], axis=1)[: grid.owned].astype(float)

    def restore(self, state: Array) -> None:
        """Allocate the matrix of a saved state: rounding in a direct solver depends on the pattern (collective)."""
        grid = self._unknowns.grid
        both = np.zeros((2, len(grid.numbers)))
        both[:, : grid.owned] = state.T
        cells, reach = (fem.share_owned(fem.cellwise_space(grid.domain), column) > 0.5 for column in both)
        self._allocate(pattern_of(self._unknowns, cells, reach, by_faces=self._by_faces))

    def assemble_penalty(self, history: Array) -> None:
        """Assemble the cut penalty if scales, cut or pattern changed, and its term of earlier steps (collective)."""
        cut_penalty, comm = self._cut_penalty, self._unknowns.grid.comm
        if cut_penalty is None or not comm.allreduce(self.penalty is None or cut_penalty.stale, op=MPI.LOR):
            return
        if self.penalty is None:
            assert self.pattern is not None
            self.penalty = PenaltyMatrix(self._unknowns, cut_penalty, self.pattern, blocked=self._blocked)
        self.penalty.assemble(history)

    @property
    def _by_faces(self) -> bool:
        return self._cut_penalty is not None and self._cut_penalty.by_faces

    def _allocate(self, pattern: Pattern) -> None:
        self.pattern, self.values, self.penalty = pattern, self._filled(pattern), None

    def _filled(self, pattern: Pattern) -> PETSc.Mat:
        """A matrix with all entries of a pattern; their values are arbitrary."""
        more = None if self._cut_penalty is None else self._cut_penalty.extra_entries()
        if self._hanging is not None:
            more = self._hanging.extra_entries() + (0 if more is None else more)
        matrix = create_matrix(self._unknowns, pattern, more, blocked=self._blocked)
        cells = np.flatnonzero(pattern.cells[: self._unknowns.grid.owned]).astype(np.int32)
        if self._hanging is not None:
            cells = self._hanging.others(cells)
            self._hanging.fill(matrix)
        fem.assemble_matrix(matrix, self._of_cells.on(cell=cells))
        if self._cut_penalty is not None:
            self._cut_penalty.fill(matrix, pattern)
        diagonal = matrix.createVecLeft()
        diagonal.set(1.0)
        matrix.setDiagonal(diagonal, addv=PETSc.InsertMode.ADD_VALUES)
        matrix.assemble()
        return quick_copy(matrix)
