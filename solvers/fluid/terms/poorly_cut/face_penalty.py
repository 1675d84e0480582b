"""The ghost penalty by jumps across faces of poorly cut cells, `forms.ghost_penalty`."""

from __future__ import annotations

import numpy as np
import ufl
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers import fem
from solvers.api import Array
from solvers.fluid.cut.cut import Cut
from solvers.fluid.mesh.space import Unknowns
from solvers.fluid.settings.penalties import Penalties
from solvers.fluid.terms import forms
from solvers.fluid.terms.gap_terms import GapTerms
from solvers.fluid.terms.matrix import Pattern
from solvers.fluid.terms.poorly_cut.ghost import Scales
from solvers.fluid.terms.poorly_cut.seam_penalty import SeamPenalty


class FacePenalty:
    """Implements `CutPenalty`."""

    by_faces = True

    def __init__(
        self,
        unknowns: Unknowns,
        flow: forms.Coefficients,
        penalties: Penalties,
        gaps: GapTerms,
        seams: SeamPenalty | None = None,
    ):
        """gaps: those of the present cut when it is set; seams: across the ends of periods; None: there are none."""
        self.unknowns, self._grid, self._gaps = unknowns, unknowns.grid, gaps
        self._seams = seams
        domain = self._grid.domain
        self.outside = np.zeros(unknowns.owned, dtype=bool)
        self.undetermined = np.zeros(unknowns.local, dtype=bool)
        self._phi, self._convective, self._has_history = (fem.function(fem.cellwise_space(domain)) for _ in range(3))
        test, trial = ufl.TestFunction(unknowns.space), ufl.TrialFunction(unknowns.space)
        dS = fem.measure(domain, "dS", 2 * unknowns.degree)
        scales = forms.GhostScales(self._phi, self._convective, self._has_history)
        form = forms.ghost_penalty(flow, penalties, scales, *unknowns.parts(trial), *unknowns.parts(test)) * dS
        self._form, history = fem.Integral(domain, ufl.lhs(form)), ufl.rhs(form)
        self._history = None if history.empty() else fem.Integral(domain, history)
        in_gaps = forms.ghost_penalty_in_gaps(
            flow, penalties, scales, gaps.scales, *unknowns.parts(trial), *unknowns.parts(test)
        )
        self._in_gaps = fem.Integral(domain, in_gaps * dS)  # compiled when there is a gap
        self._faces = np.empty(0, dtype=np.int32)
        self._marked: NDArray[np.bool_] | None = None
        self.stale = True

    @property
    def integrals(self) -> list[fem.Integral]:
        return [self._form] if self._history is None else [self._form, self._history]

    def begin_step(self, unknown: NDArray[np.bool_]) -> None:
        self._has_history.x.array[:] = ~unknown[self.unknowns.cell_velocity].any(axis=(1, 2))

    def set_scales(self, scales: Scales) -> None:
        h = self._grid.sizes.min(axis=1)
        convective = scales.cell_speed * h
        phi = scales.viscosity / scales.density + convective + scales.alpha * h**2
        self._phi.x.array[:], self._convective.x.array[:] = phi, convective**2 / phi
        self.stale = True

    def set_cut(self, cut: Cut, prescribed: NDArray[np.int64]) -> bool:
        marked = self._gaps.marked
        self.stale |= not np.array_equal(self._faces, cut.ghost_faces) or marked is not self._marked
        self._faces, self._marked = cut.ghost_faces, marked
        if self._seams is not None:
            self.stale |= self._seams.set_cut(cut)
        return False

    def extra_entries(self) -> NDArray[np.int64] | None:
        return None if self._seams is None else self._seams.entries()

    def fill(self, matrix: PETSc.Mat, pattern: Pattern) -> None:
        faces = self._grid.find_interior_faces()[0][pattern.faces]
        fem.assemble_matrix(matrix, self._form.on(interior_facet=faces))
        if self._seams is not None:
            self._seams.fill(matrix)

    def assemble(self, matrix: PETSc.Mat, history: Array) -> None:
        self.stale = False
        history[:] = 0.0
        if self._seams is not None:
            self._seams.assemble_matrix(matrix, self._form)
            if self._history is not None:
                self._seams.assemble_vector(self._history, history)
            if self._marked is not None:
                self._seams.assemble_matrix(matrix, self._in_gaps)
        if not len(self._faces):
            return
        fem.assemble_matrix(matrix, self._form.on(interior_facet=self._faces))
        if self._history is not None:
            fem.assemble_vector(self._history.on(interior_facet=self._faces), history)
        if self._marked is not None:
            faces, sides = self._grid.find_interior_faces()
            beside = np.isin(self._faces, faces[self._gaps.narrow[sides].any(axis=1)])
            fem.assemble_matrix(matrix, self._in_gaps.on(interior_facet=self._faces[beside]))

    def settle(self, values: Array) -> Array:
        return values
