"""The discrete equations of the flow on one cut: residual, tangent, and the stress that bodies feel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import ufl
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers import fem
from solvers.api import Array
from solvers.fluid import forms
from solvers.fluid.cut import Cut
from solvers.fluid.dependent import Combinations
from solvers.fluid.grid import DistributedGrid
from solvers.fluid.interface import Interface
from solvers.fluid.matrix import create_matrix
from solvers.fluid.patches import Boundary, Value
from solvers.fluid.pieces import Pieces
from solvers.fluid.space import Unknowns
from solvers.fluid.time import Difference
from solvers.fluid.weights import Weights


@dataclass(frozen=True)
class FlowSettings:
    """What the user says of the flow, besides grid, patches and bodies."""

    density: float  #: [kg/m^3]
    viscosity: float  #: [Pa s]
    element: Literal["q1q1", "q2q1"] = "q1q1"
    convection: bool = True  #: False: Stokes
    scheme: Literal["steady", "backward_euler", "bdf2"] = "bdf2"
    body_force: tuple[Value, ...] | None = None  #: [N/m^3]
    initial_velocity: tuple[Value, ...] | None = None  #: [m/s]
    penalties: forms.Penalties = forms.Penalties()

    @property
    def degree(self) -> int:
        return 1 if self.element == "q1q1" else 2

    @property
    def steady(self) -> bool:
        return self.scheme == "steady"


class FlowSystem:
    """Assembles the flow at the function `flow` (velocity and pressure) for the cut that `set_cut` took last."""

    def __init__(
        self,
        grid: DistributedGrid,
        settings: FlowSettings,
        boundary: Boundary,
        unknowns: Unknowns,
        *,
        with_bodies: bool,
        blocked: bool,
    ):
        self.with_bodies, self._blocked = with_bodies, blocked
        self.grid, self.settings, self.boundary, self.unknowns = grid, settings, boundary, unknowns
        domain, space = grid.domain, unknowns.space
        self.flow, self._history, self._scale_velocity, self._force = (fem.function(space) for _ in range(4))
        self._alpha = fem.constant(domain, 0.0)
        self._newton = fem.constant(domain, 1.0)
        self.weights = Weights(grid, settings.degree)
        self._compile()
        self._out = np.zeros(unknowns.local)
        #: nodal values by unknowns
        self.combinations = Combinations(unknowns)
        self._penalty = np.zeros(unknowns.owned)  #: of the unknowns of dependent nodes
        self._plain: PETSc.Mat | None = None  #: couplings of nodal values in cells with dependent nodes
        self._combined: PETSc.Mat | None = None  #: the same of unknowns
        self._matrix: PETSc.Mat | None = None
        self._cells: list[NDArray[np.int32]] = []  #: without dependent nodes, and with some, of the present pattern
        self._fresh_pattern = True
        self.active_dofs = np.zeros(unknowns.local, dtype=bool)  #: local dofs with a value that means something
        self.cut: Cut | None = None

    # ------------------------------------------------------------------------------------------------- the forms

    def _compile(self) -> None:
        settings, unknowns, domain = self.settings, self.unknowns, self.grid.domain
        (u, p), (a, _), (history, _), (force, _) = (
            unknowns.parts(f) for f in (self.flow, self._scale_velocity, self._history, self._force)
        )
        test, trial = ufl.TestFunction(unknowns.space), ufl.TrialFunction(unknowns.space)
        v, q = unknowns.parts(test)
        rho, mu = fem.constant(domain, settings.density), fem.constant(domain, settings.viscosity)
        if settings.body_force is None:
            force = ufl.as_vector([fem.constant(domain, 0.0)] * self.grid.dim)
        self.terms = forms.Flow(
            rho=rho,
            mu=mu,
            alpha=self._alpha,
            a=a,
            newton=self._newton,
            history=history,
            force=force,
            convection=settings.convection,
            steady=settings.steady,
            degree=settings.degree,
            mesh=domain.mesh.ufl_domain(),
        )
        flow = self.terms
        everywhere = forms.bulk(flow, u, p, v, q) + forms.residual_based(flow, u, p, v, q)
        dx = fem.measure(domain, "dx", 2 * settings.degree + 1)
        dx_cut = fem.measure(domain, "dx", self.weights.degree)
        cell_forms = [everywhere * dx]
        if self.with_bodies:
            on_interface = forms.interface(flow, self.weights, u, p, v, q)
            cell_forms.append(self.weights.fluid * everywhere * dx_cut + on_interface * dx_cut)
        self._residuals = [fem.Integral(domain, form) for form in cell_forms]
        self._tangents = [fem.Integral(domain, ufl.derivative(form, self.flow, trial)) for form in cell_forms]
        self._compile_outer_faces(v, u, trial)
        fem.compile_integrals(self._integrals(), "the flow")

    def _integrals(self) -> list[fem.Integral]:
        found = [*self._residuals, *self._tangents, *(form for *_, form in self._tractions)]
        found += [self._outflow_form, self._outflow_tangent] if self._outflow else []
        return found

    def _compile_outer_faces(self, v, u, trial) -> None:
        domain, ds = self.grid.domain, fem.measure(self.grid.domain, "ds", 2 * self.settings.degree + 1)
        patches = self.boundary.patches
        self._tractions = []
        for number, patch in enumerate(patches):
            if patch.kind in ("traction", "pressure"):
                t = fem.function(self.unknowns.space)
                given = self.unknowns.parts(t)[0]
                term = forms.traction(given, v) if patch.kind == "traction" else forms.pressure(self.terms, given[0], v)
                self._tractions.append((number, t, fem.Integral(domain, term * ds)))
        self._outflow = [number for number, patch in enumerate(patches) if patch.kind == "outflow"]
        if self._outflow:
            form = forms.outflow(self.terms, u, v) * ds
            self._outflow_form = fem.Integral(domain, form)
            self._outflow_tangent = fem.Integral(domain, ufl.derivative(form, self.flow, trial))

    # ------------------------------------------------------------------------------------------------- a new step

    def set_time(self, t: float, difference: Difference, history: Array) -> None:
        """Loads at time t; u_t = alpha u - history [m/s^2], local dofs."""
        self._alpha.value = difference.alpha
        self._history.x.array[:] = history
        nodes = self.unknowns.velocity
        if self.settings.body_force is not None:
            _set_velocity(self._force, nodes, self.settings.body_force, t)
        for number, function, _ in self._tractions:
            value = self.boundary.patches[number].value
            assert value is not None
            _set_velocity(function, nodes, value, t)

    def set_scales(self, velocity: Array) -> None:
        """Take local velocity dofs [m/s] that scale stabilisation and penalties from now on (collective)."""
        settings, unknowns = self.settings, self.unknowns
        self._scale_velocity.x.array[:] = velocity
        speed = np.linalg.norm(velocity[unknowns.velocity.dofs], axis=1)
        by_dof = np.zeros(unknowns.local)
        by_dof[unknowns.velocity.dofs[:, 0]] = speed
        self._speeds = speed if settings.convection else np.zeros(len(speed))
        dofs = unknowns.cell_blocks if unknowns.block_size == 1 else unknowns.cell_blocks * unknowns.block_size
        self.speed = by_dof[dofs].max(axis=1) if settings.convection else np.zeros(len(self.grid.numbers))
        self.fastest = float(self.grid.comm.allreduce(self.speed.max(initial=0.0), op=MPI.MAX))

    def set_cut(self, cut: Cut) -> None:
        """Take a cut; cells, faces and the matrix follow (collective)."""
        before, self.cut, grid = self.cut, cut, self.grid
        if self._combined is not None:
            self._combined.destroy()
            self._combined = None
        active = np.zeros(len(grid.numbers), dtype=bool)
        active[cut.active] = True
        was_active = None if before is None else self.active_dofs
        self.active_dofs = self.dofs_of(cut.active)
        pressure = self.unknowns.pressure.dofs[:, 0]
        self.active_dofs[pressure] = self.dofs_of(np.concatenate([cut.uncut, cut.cut]))[pressure]
        new_pattern = self.combinations.set(cut, self.boundary.dofs) if self.with_bodies else before is None
        self.active_dofs &= ~self.combinations.lost
        self._settle(was_active)
        cells = [some[some < grid.owned] for some in (cut.uncut, cut.cut)]
        dependent = self._has_dependent_nodes(cells[1])
        self._residual_forms = [form.on(cell=some) for form, some in zip(self._residuals, cells, strict=False)]
        free = [cells[0], cells[1][~dependent]]
        self._tangent_forms = [form.on(cell=some) for form, some in zip(self._tangents, free, strict=False)]
        self._dependent_forms = [self._tangents[-1].on(cell=cells[1][dependent])] if self.with_bodies else []
        self._add_outer_faces(active, cells[1][dependent])
        cells = [np.sort(np.concatenate(free)), cells[1][dependent]]
        same = self._matrix is not None and not new_pattern and all(map(np.array_equal, cells, self._cells))
        if not grid.comm.allreduce(same, op=MPI.LAND):
            self._cells, self._fresh_pattern = cells, True

    def _settle(self, was_active: NDArray[np.bool_] | None) -> None:
        """Values of eliminated nodes, and first ones of nodes that were not there, are what the extension says."""
        owned = self.unknowns.owned
        fresh = np.zeros(owned, dtype=bool) if was_active is None else ~was_active[:owned]
        self.flow.x.array[:owned] = self.combinations.settle(self.flow.x.array[:owned], fresh)
        self.flow.x.scatter_forward()

    def _has_dependent_nodes(self, cells: NDArray[np.int32]) -> NDArray[np.bool_]:
        unknowns, marks = self.unknowns, self.combinations.dependent
        velocity, pressure = unknowns.cell_velocity[cells], unknowns.cell_pressure[cells]
        return marks[velocity].any(axis=(1, 2)) | marks[pressure].any(axis=1)

    def dofs_of(self, cells: NDArray[np.int32]) -> NDArray[np.bool_]:
        """Which local dofs belong to some local cells or, on other processes, to theirs (collective)."""
        blocks = np.zeros(self.unknowns.local // self.unknowns.block_size, dtype=bool)
        blocks[self.unknowns.cell_blocks[cells]] = True
        blocks = fem.sum_ghosts(self.unknowns.space, blocks.astype(float)) > 0.0
        return self.unknowns.expand(blocks)

    def _add_outer_faces(self, active, dependent: NDArray[np.int32]) -> None:
        boundary = self.boundary
        kept = [np.sort(f[active[c]]) for f, c in zip(boundary.facets, boundary.cells, strict=True)]
        for number, _, form in self._tractions:
            self._residual_forms.append(form.on(exterior_facet=kept[number]))
        if self._outflow:
            faces = np.sort(np.concatenate([kept[number] for number in self._outflow]))
            self._residual_forms.append(self._outflow_form.on(exterior_facet=faces))
            at = [boundary.facets[number][np.isin(boundary.cells[number], dependent)] for number in self._outflow]
            special = np.intersect1d(faces, np.concatenate(at))
            self._tangent_forms.append(self._outflow_tangent.on(exterior_facet=np.setdiff1d(faces, special)))
            if len(special):
                self._dependent_forms.append(self._outflow_tangent.on(exterior_facet=special))

    def set_penalties(self) -> None:
        """Weights of the interface and the penalty of dependent nodes, after the cut or the scales changed."""
        assert self.cut is not None
        if self.with_bodies:
            penalty = self._interface_penalties(self.cut.pieces, self.cut)
            self.weights.set(self.cut, penalty)
            self.interface = Interface(
                self.grid, self.unknowns, self.weights, self.cut, self.settings.viscosity, penalty
            )
            self._penalty = self._extension_penalty()

    def _extension_penalty(self) -> Array:
        """d_i of the unknowns of dependent nodes [kg/s; m^4 s/kg in rows of the pressure], owned dofs.

        phi = mu + rho |a| h + rho alpha h^2 scales as the equations do; with the share k that a node keeps of its own,

            d = phi V / h^2 (1 - k) / k  of the velocity,   d = V / phi (1 - k) / k  of the pressure.
        """
        settings, unknowns, weight = self.settings, self.unknowns, self.combinations.weight
        rho, alpha = settings.density, float(self._alpha.value)
        penalty = np.zeros(unknowns.owned)
        speeds = (self._speeds, self._speeds[unknowns.at_pressure])
        for nodes, speed in zip((unknowns.velocity, unknowns.pressure), speeds, strict=True):
            dofs = nodes.dofs[: nodes.owned]
            h, volume = nodes.sizes[: nodes.owned].min(axis=1), nodes.sizes[: nodes.owned].prod(axis=1)
            phi = settings.viscosity + rho * speed[: nodes.owned] * h + rho * alpha * h**2
            scale = phi * volume / h**2 if nodes is unknowns.velocity else volume / phi
            penalty[dofs] = settings.penalties.extension * scale[:, None] * weight[dofs]
        return penalty

    def pressure_sizes(self) -> Array:
        """int q dx over the fluid of the pressure function of each owned unknown [m^dim] (collective)."""
        assert self.cut is not None
        cut, unknowns, weights = self.cut, self.unknowns, self.weights
        volume, (psi, _) = self.grid.sizes.prod(axis=1), weights.pressure_table
        uncut, mine = cut.uncut[cut.uncut < self.grid.owned], cut.cut < self.grid.owned
        cells = np.concatenate([uncut, cut.cut[mine]])
        fluid = np.concatenate([np.ones((len(uncut), len(weights.rule))), cut.fluid[mine][:, weights.order]])
        parts = volume[cells, None] * ((fluid * weights.rule) @ psi)
        size = np.bincount(unknowns.cell_pressure[cells].ravel(), parts.ravel(), unknowns.local).astype(float)
        fem.add_ghosts(unknowns.space, size)
        return self.combinations.collect(size[: unknowns.owned])

    def _interface_penalties(self, pieces: Pieces, cut: Cut) -> Array:
        """P = s I + s_n n n^T of pieces [Pa s/m], shape (pieces, dim, dim).

        s = gamma mu C_T / h + rho max(0, -g . n), s_n = rho (gamma_b |a| + gamma_t h alpha).
        """
        settings, factors, n = self.settings, self.settings.penalties, pieces.normal
        cells = cut.cut[pieces.cell]
        h, rho = self.grid.sizes[cells].min(axis=1), settings.density
        s = factors.nitsche * settings.viscosity * forms.TRACE[self.grid.dim, settings.degree] / h
        if settings.convection:
            g = cut.motion.v[cut.facets[pieces.facet]].mean(axis=1)
            s = s + rho * np.maximum(0.0, -np.einsum("pi,pi->p", g, n))
        normal = rho * (factors.convection * self.speed[cells] + factors.mass * h * float(self._alpha.value))
        return s[:, None, None] * np.eye(self.grid.dim) + normal[:, None, None] * n[:, :, None] * n[:, None, :]

    # --------------------------------------------------------------------------------------- residual and tangent

    def residual(self) -> Array:
        """Equations of the owned unknowns, T^T r + d w: forces [N] of velocity rows, volume rates of pressure rows."""
        assert self.cut is not None
        self._out[:] = 0.0
        for form in self._residual_forms:
            fem.assemble_vector(form, self._out)
        if self.with_bodies:
            self._out += self.interface.velocity_terms(self.cut.motion.v)
        fem.add_ghosts(self.unknowns.space, self._out)
        owned, combinations = self.unknowns.owned, self.combinations
        return combinations.collect(self._out[:owned]) + self._penalty * combinations.distance(
            self.flow.x.array[:owned]
        )

    def tangent(self, identity: Array, *, picard: bool) -> PETSc.Mat:
        """d(residual)/d(unknowns), with rows of the identity at the marked owned dofs; the next call overwrites it.

        Picard: the velocity that carries momentum is taken as known; right if it is that of `set_scales`.
        """
        self._newton.value = 0.0 if picard else 1.0
        combined = self._combine_dependent()
        if self._fresh_pattern:
            if self._matrix is not None:
                self._matrix.destroy()
            more = None if combined is None else np.diff(combined[0]).astype(np.int64)
            self._matrix = create_matrix(self.unknowns, self._cells[0], more, blocked=self._blocked)
            self._fresh_pattern = False
        matrix = self._matrix
        assert matrix is not None
        matrix.zeroEntries()
        for form in self._tangent_forms:
            fem.assemble_matrix(matrix, form)
        self._newton.value = 1.0
        if combined is not None:
            matrix.setValuesCSR(*combined, addv=PETSc.InsertMode.ADD_VALUES)
        diagonal = matrix.createVecLeft()
        diagonal.array[:] = self._penalty
        matrix.setDiagonal(diagonal, addv=PETSc.InsertMode.ADD_VALUES)
        matrix.assemble()
        start = matrix.getOwnershipRange()[0]
        matrix.zeroRows((start + np.flatnonzero(identity)).astype(PETSc.IntType), 1.0)
        return matrix

    def _combine_dependent(self):
        """T^T A T of cells with dependent nodes, owned rows as (starts, columns, values); None without any."""
        T = self.combinations.matrix
        if T is None:
            return None
        if self._fresh_pattern:
            if self._plain is not None:
                self._plain.destroy()
            self._plain = create_matrix(self.unknowns, self._cells[1], blocked=False)
        assert self._plain is not None
        self._plain.zeroEntries()
        for form in self._dependent_forms:
            fem.assemble_matrix(self._plain, form)
        self._plain.assemble()
        self._combined = self._plain.ptap(T, result=self._combined)
        return self._combined.getValuesCSR()

    # -------------------------------------------------------------------------------------------------- reactions

    def surface_force(self) -> Array:
        """Force [N] of the fluid on the vertices of all surfaces, shape (n, dim) (collective)."""
        assert self.cut is not None
        return self.grid.comm.allreduce(self.interface.force(self.flow.x.array, self.cut.motion.v))

    def outer_rows(self) -> Array:
        """Rows of tractions and outflow alone at local dofs, the ghosts' share still there."""
        out = np.zeros(self.unknowns.local)
        for form in self._residual_forms[len(self._residuals) :]:
            fem.assemble_vector(form, out)
        return out


def _set_velocity(function, nodes, value: Sequence[Value], t: float) -> None:
    points = np.zeros((3, len(nodes.points)))
    points[: nodes.points.shape[1]] = nodes.points.T
    for axis, component in enumerate(value):
        function.x.array[nodes.dofs[:, axis]] = component(points, t)
