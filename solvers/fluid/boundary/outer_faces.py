"""The terms of patches of the box in the equations of the flow: stresses that act on it from outside."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import ufl
from numpy.typing import NDArray

from solvers import fem
from solvers.api import Array
from solvers.fluid import forms
from solvers.fluid.background.grid import DistributedGrid
from solvers.fluid.background.space import Unknowns, set_velocity
from solvers.fluid.boundary.covered_faces import CoveredFaces, covered_faces
from solvers.fluid.boundary.patch_kinds import PatchKind
from solvers.fluid.boundary.patches import Boundary, Patch
from solvers.fluid.cutting.cut import Cut


@dataclass(frozen=True)
class Term:
    """The form of one patch with a value, or of all patches of a kind without values."""

    kind: PatchKind
    patches: tuple[int, ...]
    value: Any  #: function of the flow's space with the given value as its velocity; None without one
    residual: fem.Integral
    tangent: fem.Integral | None  #: None for forms without u


@dataclass(frozen=True)
class OuterOnCut:
    """Forms over the outer faces that bodies do not cover, and the faces that they cover in part."""

    residuals: tuple[Any, ...] = ()  #: forms over faces with fluid that no body covers
    tangents: tuple[Any, ...] = ()  #: their derivatives by the flow
    hanging: tuple[Any, ...] = ()  #: the same at cells with hanging nodes
    covered: tuple[tuple[Term, CoveredFaces], ...] = ()  #: faces that bodies cover in part


class OuterFaces:
    """All terms of the patches on one grid."""

    def __init__(
        self, grid: DistributedGrid, boundary: Boundary, unknowns: Unknowns, flow: forms.Coefficients, function: Any
    ):
        """flow: coefficients of the forms; function: velocity and pressure."""
        self.grid, self.boundary, self.unknowns = grid, boundary, unknowns
        ds, test = fem.measure(grid.domain, "ds", 2 * unknowns.degree + 1), ufl.TestFunction(unknowns.space)
        u, v, n = unknowns.parts(function)[0], unknowns.parts(test)[0], ufl.FacetNormal(flow.mesh)

        def term(kind: PatchKind, patches: tuple[int, ...], given: Any) -> Term:
            value: Any = None if given is None else unknowns.parts(given)[0]
            assert kind.form is not None
            form = kind.form(flow, u, value[0] if kind.value == "number" else value, n, v) * ds
            slope = ufl.derivative(form, function, ufl.TrialFunction(unknowns.space)) if kind.depends_on_flow else None
            tangent = None if slope is None else fem.Integral(grid.domain, slope)
            return Term(kind, patches, given, fem.Integral(grid.domain, form), tangent)

        with_form = [(n, patch) for n, patch in enumerate(boundary.patches) if patch.record.form is not None]
        self.terms = [
            term(patch.record, (n,), fem.function(unknowns.space)) for n, patch in with_form if patch.record.value
        ]
        for kind in dict.fromkeys(patch.record for _, patch in with_form if not patch.record.value):
            self.terms.append(term(kind, tuple(n for n, patch in with_form if patch.record == kind), None))

    def integrals(self) -> list[fem.Integral]:
        """Forms to compile."""
        return [form for term in self.terms for form in (term.residual, term.tangent) if form is not None]

    def begin_step(self, t: float) -> None:
        """Set the given values to those at a time [s]."""
        nodes = self.unknowns.velocity
        for term in self.terms:
            if term.value is not None:
                value = self.boundary.patches[term.patches[0]].value
                assert value is not None
                set_velocity(term.value.x.array, nodes, value, t)

    def on_cut(self, cut: Cut, active: NDArray[np.bool_]) -> OuterOnCut:
        """The forms over outer faces on a cut; active: mask of local cells with unknowns."""
        residuals, tangents, hanging, covered, points = [], [], [], [], 2 * self.unknowns.degree + 1
        by_patch = self.boundary.facets, self.boundary.cells
        for term in self.terms:
            facets, cells = (np.concatenate([parts[n] for n in term.patches]) for parts in by_patch)
            uncovered, parts = covered_faces(self.grid, self.unknowns, cut, points, facets, cells)
            wet = active[cells] & uncovered
            residuals.append(term.residual.on(exterior_facet=np.sort(facets[wet])))
            if term.tangent is not None:
                apart = (
                    np.zeros(len(wet), dtype=bool)
                    if self.unknowns.hanging is None
                    else self.unknowns.hanging.cells[cells]
                )
                tangents.append(term.tangent.on(exterior_facet=np.sort(facets[wet & ~apart])))
                if self.unknowns.hanging is not None:
                    hanging.append(term.tangent.on(exterior_facet=np.sort(facets[wet & apart])))
            with_fluid = [part.only(active) for part in parts]
            covered += [(term, part) for part in with_fluid if len(part.cells)]
        for term, _ in covered:
            if (term.kind.slope if term.kind.depends_on_flow else term.kind.stress) is None:
                raise CannotBeCovered([self.boundary.patches[n] for n in term.patches])
        return OuterOnCut(tuple(residuals), tuple(tangents), tuple(hanging), tuple(covered))

    def add_covered(self, on_cut: OuterOnCut, out: Array, flow: Array, mu: float, rho: float, a: Array) -> None:
        """Add the residual over the wet part of covered faces to local dofs; for mu, rho, a see `slopes`."""
        for term, part in on_cut.covered:
            if term.kind.stress is not None and term.value is not None:
                dofs, load = part.load(term.kind.stress(part, part.velocity(term.value.x.array)))
                np.subtract.at(out, dofs, load)
        for dofs, block in self.slopes(on_cut, mu, rho, a):
            np.add.at(out, dofs, np.einsum("caibk,cbk->cai", block, flow[dofs]))

    def slopes(self, on_cut: OuterOnCut, mu: float, rho: float, a: Array) -> Iterator[tuple[NDArray[np.int32], Array]]:
        """(local dofs, derivatives by the flow) of terms with u over the wet part of covered faces.

        mu [Pa s]; rho [kg/m^3], zero without convection; a [m/s]: velocity of the step before, at local dofs.
        """
        for term, part in on_cut.covered:
            if term.kind.slope is not None:
                values = None if term.value is None else part.velocity(term.value.x.array)
                yield self.unknowns.cell_velocity[part.cells], term.kind.slope(part, mu, rho * part.velocity(a), values)


class CannotBeCovered(ValueError):
    """A body covers part of a patch whose kind has neither `stress` nor `slope` for covered faces."""

    def __init__(self, patches: list[Patch]):
        super().__init__("a body covers part of " + ", ".join(f"patch '{patch.name}'" for patch in patches))
