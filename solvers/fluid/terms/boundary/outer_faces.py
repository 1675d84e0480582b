"""The terms of patches of the box in the equations of the flow: stresses that act on it from outside."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import ufl
from numpy.typing import NDArray

from solvers import fem
from solvers.api import Array
from solvers.fluid.cut.cut import Cut
from solvers.fluid.mesh.distributed_grid import DistributedGrid
from solvers.fluid.mesh.space import Unknowns, set_velocity
from solvers.fluid.terms import forms
from solvers.fluid.terms.boundary.covered_faces import CoveredFaces, covered_faces
from solvers.fluid.terms.boundary.patch_kinds import PATCH_KINDS, PatchKind
from solvers.fluid.terms.boundary.patches import Boundary, Patch, periodic_axes
from solvers.values import Value, evaluate

PRESSURE_PATCH = PATCH_KINDS["pressure"]


@dataclass(frozen=True)
class Term:
    """The form of one patch with a value, or of all patches of a kind without values."""

    kind: PatchKind
    patches: tuple[int, ...]
    value: Any  #: function of the flow's space with the given value as its velocity; None without one
    given: Sequence[Value] | None  #: the value
    face: str | None  #: face of the box, such as 'x-', on which the form is; None: all of the patches
    residual: fem.Integral
    tangent: fem.Integral | None  #: None for forms without u


@dataclass(frozen=True)
class OuterOnCut:
    """Forms over the outer faces that bodies do not cover, and the faces that they cover in part."""

    residuals: tuple[Any, ...] = ()  #: forms over faces with fluid that no body covers
    tangents: tuple[Any, ...] = ()  #: their derivatives by the flow
    hanging: tuple[Any, ...] = ()  #: the same at cells with hanging nodes
    covered: tuple[tuple[Term, CoveredFaces], ...] = ()  #: faces that bodies cover in part
    fluxes: tuple[Array, ...] = ()  #: int n . v over the wet part of each outlet with a law, at local dofs


class OuterFaces:
    """All terms of the patches on one grid."""

    def __init__(
        self,
        grid: DistributedGrid,
        boundary: Boundary,
        unknowns: Unknowns,
        flow: forms.Coefficients,
        function: Any,
        body_force: Sequence[Value] | None = None,
    ):
        """flow: coefficients of the forms; function: velocity and pressure; body_force [N/m^3] (collective)."""
        self.grid, self.boundary, self.unknowns = grid, boundary, unknowns
        ds, test = fem.measure(grid.domain, "ds", 2 * unknowns.degree + 1), ufl.TestFunction(unknowns.space)
        u, v, n = unknowns.parts(function)[0], unknowns.parts(test)[0], ufl.FacetNormal(flow.mesh)

        def term(
            kind: PatchKind, patches: tuple[int, ...], given: Sequence[Value] | None = None, face: str | None = None
        ) -> Term:
            function_of_value = None if given is None else fem.function(unknowns.space)
            value: Any = None if given is None else unknowns.parts(function_of_value)[0]
            assert kind.form is not None
            form = kind.form(flow, u, value[0] if kind.value == "number" else value, n, v) * ds
            slope = ufl.derivative(form, function, ufl.TrialFunction(unknowns.space)) if kind.depends_on_flow else None
            tangent = None if slope is None else fem.Integral(grid.domain, slope)
            return Term(kind, patches, function_of_value, given, face, fem.Integral(grid.domain, form), tangent)

        with_form = [(n, patch) for n, patch in enumerate(boundary.patches) if patch.record.form is not None]
        self.terms = [term(patch.record, (n,), patch.value) for n, patch in with_form if patch.record.value]
        for kind in dict.fromkeys(patch.record for _, patch in with_form if not patch.record.value):
            self.terms.append(term(kind, tuple(n for n, patch in with_form if patch.record == kind)))
        if body_force is not None:
            periods = periodic_axes(boundary.patches)  # a periodic pressure balances no force along them
            at_rest = [0.0 if axis in periods else component for axis, component in enumerate(body_force)]
            for number, face, middle in self._outflows():
                self.terms.append(term(PRESSURE_PATCH, (number,), [_hydrostatic(at_rest, middle)], face))

        self._unit_pressures = [
            term(PRESSURE_PATCH, (number,), [1.0]) for number, patch in enumerate(boundary.patches) if patch.outlet
        ]
        for unit in self._unit_pressures:
            set_velocity(unit.value.x.array, unknowns.velocity, [1.0], 0.0)

    def _outflows(self) -> Iterator[tuple[int, str, Array]]:
        """(patch, face of the box, middle [m] of its part there) of the patches of outflow (collective)."""
        for number, patch in enumerate(self.boundary.patches):
            for face in patch.faces if patch.record == PATCH_KINDS["outflow"] else ():
                cells = self.boundary.cells[number]
                middles = fem.facet_midpoints(self.grid.domain, self.boundary.facets[number])
                on = self.grid.on_face(middles, face) & (cells < self.grid.owned)
                areas = np.delete(self.grid.sizes[cells[on]], "xyz".index(face[0]), axis=1).prod(axis=1)
                sums = self.grid.comm.allreduce(np.append(areas @ middles[on], areas.sum()))
                if sums[-1] > 0.0:
                    yield number, face, sums[:-1] / sums[-1]

    def integrals(self) -> list[fem.Integral]:
        """Forms to compile."""
        terms = [*self.terms, *self._unit_pressures]
        return [form for term in terms for form in (term.residual, term.tangent) if form is not None]

    def begin_step(self, t: float) -> None:
        """Set the given values to those at a time [s]."""
        nodes = self.unknowns.velocity
        for term in self.terms:
            if term.given is not None:
                set_velocity(term.value.x.array, nodes, term.given, t)

    def on_cut(self, cut: Cut, active: NDArray[np.bool_]) -> OuterOnCut:
        """The forms over outer faces on a cut; active: mask of local cells with unknowns."""
        residuals, tangents, hanging, covered = [], [], [], []
        for term in self.terms:
            facets, cells, with_fluid = self._wet(term, cut, active)
            residuals.append(term.residual.on(exterior_facet=np.sort(facets)))
            if term.tangent is not None:
                apart = (
                    np.zeros(len(cells), dtype=bool)
                    if self.unknowns.hanging is None
                    else self.unknowns.hanging.cells[cells]
                )
                tangents.append(term.tangent.on(exterior_facet=np.sort(facets[~apart])))
                if self.unknowns.hanging is not None:
                    hanging.append(term.tangent.on(exterior_facet=np.sort(facets[apart])))
            covered += [(term, part) for part in with_fluid]
        for term, _ in covered:
            if (term.kind.slope if term.kind.depends_on_flow else term.kind.stress) is None:
                raise CannotBeCovered([self.boundary.patches[n] for n in term.patches])
        fluxes = tuple(self._flux(unit, cut, active) for unit in self._unit_pressures)
        return OuterOnCut(tuple(residuals), tuple(tangents), tuple(hanging), tuple(covered), fluxes)

    def _wet(
        self, term: Term, cut: Cut, active: NDArray[np.bool_]
    ) -> tuple[NDArray[np.int32], NDArray[np.int32], list[CoveredFaces]]:
        """(facets with fluid that no body covers, their cells, those covered in part) of the patches of a term."""
        by_patch = self.boundary.facets, self.boundary.cells
        facets, cells = (np.concatenate([parts[n] for n in term.patches]) for parts in by_patch)
        if term.face is not None:
            on = self.grid.on_face(fem.facet_midpoints(self.grid.domain, facets), term.face)
            facets, cells = facets[on], cells[on]
        points, known = 2 * self.unknowns.degree + 1, self.boundary.wet_faces
        uncovered, parts = covered_faces(self.grid, self.unknowns, cut, points, facets, cells, known)
        wet = active[cells] & uncovered
        with_fluid = [part.only(active) for part in parts]
        return facets[wet], cells[wet], [part for part in with_fluid if len(part.cells)]

    def _flux(self, unit: Term, cut: Cut, active: NDArray[np.bool_]) -> Array:
        """int n . v over the wet part of a patch at local dofs; contributions to ghosts are not added up."""
        found = np.zeros(self.unknowns.local)
        facets, _, covered = self._wet(unit, cut, active)
        fem.assemble_vector(unit.residual.on(exterior_facet=np.sort(facets)), found)
        for part in covered:
            dofs, load = part.load(part.along_normal(np.ones(part.weights.shape)))
            np.add.at(found, dofs, load)
        return found

    def add_covered(self, on_cut: OuterOnCut, out: Array, flow: Array, mu: float | Array, rho: float, a: Array) -> None:
        """Add the residual over the wet part of covered faces to local dofs; for mu, rho, a see `slopes`."""
        for term, part in on_cut.covered:
            if term.kind.stress is not None and term.value is not None:
                dofs, load = part.load(term.kind.stress(part, part.velocity(term.value.x.array)))
                np.subtract.at(out, dofs, load)
        for dofs, block in self.slopes(on_cut, mu, rho, a):
            np.add.at(out, dofs, np.einsum("caibk,cbk->cai", block, flow[dofs]))

    def slopes(
        self, on_cut: OuterOnCut, mu: float | Array, rho: float, a: Array
    ) -> Iterator[tuple[NDArray[np.int32], Array]]:
        """(local dofs, derivatives by the flow) of terms with u over the wet part of covered faces.

        mu [Pa s] (by local cells if it varies); rho [kg/m^3], zero without convection; a [m/s]: velocity of the
        step before, at local dofs.
        """
        for term, part in on_cut.covered:
            if term.kind.slope is not None:
                values = None if term.value is None else part.velocity(term.value.x.array)
                viscosity = mu if isinstance(mu, float) else mu[part.cells, None]
                slope = term.kind.slope(part, viscosity, rho * part.velocity(a), values)
                yield self.unknowns.cell_velocity[part.cells], slope


def _hydrostatic(body_force: Sequence[Value], middle: Array) -> Value:
    """Pressure [Pa] b . (x - x_0) of fluid at rest under the body force b in the middle x_0 of a face, zero there."""

    def pressure(x: Array, t: float) -> Array:
        at = np.pad(middle, (0, 3 - len(middle)))[:, None]
        force = [float(np.asarray(evaluate(component, at, t)).ravel()[0]) for component in body_force]
        return np.asarray(sum(b * (x[axis] - middle[axis]) for axis, b in enumerate(force)))

    return pressure


class CannotBeCovered(ValueError):
    """A body covers part of a patch whose kind has neither `stress` nor `slope` for covered faces."""

    def __init__(self, patches: list[Patch]):
        super().__init__("a body covers part of " + ", ".join(f"patch '{patch.name}'" for patch in patches))
