"""The discrete equations of the flow on one cut of the grid: residual, tangent, and the force on surfaces.

The residual is the sum of the forms over uncut cells, cut cells and cells of films (`cell_forms`), those over the faces
of the box (`outer_faces`), the penalty on poorly cut cells (a matrix times the flow), the terms of the
surfaces' velocity (`interface`), and seepage in closed contact. A cut is set by `set_cut`; all that depends on it is
updated by the first call that needs it.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers import fem
from solvers.api import Array, State
from solvers.fluid.cut.cut import Cut
from solvers.fluid.cut.film import film_cells
from solvers.fluid.cut.weights import Weights
from solvers.fluid.geometry.pieces import Pieces
from solvers.fluid.mesh.distributed_grid import DistributedGrid
from solvers.fluid.mesh.space import Unknowns, set_velocity
from solvers.fluid.settings.flow_settings import FlowSettings
from solvers.fluid.settings.time_scheme import FlowStep
from solvers.fluid.solve.cell_viscosity import CellViscosity
from solvers.fluid.solve.driving_force import DrivingForces
from solvers.fluid.solve.hanging_system import HangingSystem
from solvers.fluid.solve.outlet_terms import OutletTerms
from solvers.fluid.solve.tangent_matrix import TangentMatrix
from solvers.fluid.surfaces.surface import ImmersedSurface, by_facets, may_close, seeping
from solvers.fluid.terms import nitsche
from solvers.fluid.terms.boundary.outer_faces import OuterFaces, OuterOnCut
from solvers.fluid.terms.boundary.patches import Boundary, driven_periods, outlet_laws
from solvers.fluid.terms.boundary.windkessel import Outlets
from solvers.fluid.terms.cell_forms import cell_forms, coefficients
from solvers.fluid.terms.closed_contact.zone import ClosedZone, find_zone
from solvers.fluid.terms.closed_contact.zone_entries import with_zone
from solvers.fluid.terms.closed_contact.zone_seepage import ZoneSeepage
from solvers.fluid.terms.coupling_entries import InterfaceEntries, interface_entries
from solvers.fluid.terms.film_penalty import least_in_films
from solvers.fluid.terms.gap_terms import GapTerms
from solvers.fluid.terms.interface import InterfaceTerms
from solvers.fluid.terms.poorly_cut.ghost import Scales
from solvers.fluid.terms.poorly_cut.ghost_choice import choose_cut_penalty
from solvers.fluid.terms.shape_derivatives.cut_shape import CutDerivatives, FlowTerms, cut_derivatives
from solvers.fluid.terms.shape_derivatives.film_shape import FilmDerivatives, film_derivatives
from solvers.fluid.terms.slip_history import slip_of_facets
from solvers.mesh.distributed import Nodal


class FlowSystem:
    """Assembles the equations at the iterate `flow` (velocity and pressure), for the present step, scales and cut."""

    def __init__(
        self,
        grid: DistributedGrid,
        settings: FlowSettings,
        boundary: Boundary,
        unknowns: Unknowns,
        *,
        surfaces: Sequence[ImmersedSurface],
        blocked: bool,
    ):
        """surfaces: those of all bodies; blocked: store dense blocks (collective)."""
        self.with_bodies = with_bodies = bool(surfaces)
        self.grid, self.settings, self.boundary, self.unknowns = grid, settings, boundary, unknowns
        domain, space = grid.domain, unknowns.space
        self.flow, self.history, self._scale_velocity, self._force = (fem.function(space) for _ in range(4))
        self._alpha, self._scale_alpha, self._newton = (fem.constant(domain, value) for value in (0.0, 0.0, 1.0))
        self.weights = Weights(grid, settings.degree)
        scales, history, force = (unknowns.parts(f)[0] for f in (self._scale_velocity, self.history, self._force))
        driven = driven_periods(boundary.patches)
        parts = scales, history, None if settings.body_force is None and not driven else force
        self.terms = coefficients(domain, settings, *parts, alpha=(self._alpha, self._scale_alpha), newton=self._newton)
        self.viscosity = CellViscosity(unknowns, settings)
        self.on_cut = self.viscosity.on_cut(self.terms)  #: coefficients in cut cells
        self.driving = DrivingForces(
            unknowns, driven, (self.flow, self.history, self._force), self.terms, self.viscosity
        )
        #: gaps of a few cells, with first-order velocities
        with_gaps = with_bodies and settings.degree == 1
        self.gaps = GapTerms(grid, settings.viscosity, settings.density) if with_gaps else None
        of_faces = self.viscosity.on_faces(self.terms)
        self.cut_penalty = (
            choose_cut_penalty(unknowns, of_faces, settings.penalties, self.gaps) if with_bodies else None
        )
        of_gaps = None if self.gaps is None else self.gaps.scales
        of_cut = self.weights if with_bodies else None
        self.forms = cell_forms(unknowns, self.terms, self.flow, of_cut, of_gaps, on_cut=self.on_cut)
        self._hanging = (
            None if unknowns.hanging is None else HangingSystem(unknowns, unknowns.hanging, self.forms.tangents[0])
        )
        self.matrix = TangentMatrix(unknowns, self.cut_penalty, self._hanging, self.forms.tangents[0], blocked=blocked)
        self._outer = OuterFaces(grid, boundary, unknowns, self.terms, self.flow, settings.body_force)
        penalty = [] if self.cut_penalty is None else self.cut_penalty.integrals
        fem.compile_integrals([*self.forms.integrals(), *self._outer.integrals(), *penalty], "the flow")
        #: owned cells: uncut ones, cut ones, and those in films if there are any; forms over them and the outer faces
        self.cells: list[NDArray[np.int32]] = []
        self._residuals: list = []
        self._tangents: list = []
        self._outer_on_cut = OuterOnCut()
        self.outlets = OutletTerms(unknowns, Outlets(outlet_laws(boundary.patches)).lines)
        self.speed = np.zeros(len(grid.numbers))  #: largest |a| at the nodes of each local cell [m/s]
        self.fastest = 0.0  #: largest |a| of all cells [m/s]
        self.active_dofs = np.zeros(unknowns.local, dtype=bool)  #: dofs of active cells
        #: the cut penalty adds its matrix times the flow to the residual, minus this part of the history
        self._penalty_history = np.zeros(unknowns.local)
        self._out = np.zeros(unknowns.local)
        self.cut: Cut | None = None
        #: velocity of facets beside that of their vertices [m/s], with its derivative, `sweep`; None: zero
        self.sweep_velocity: Array | None = None
        #: sum_k beta_k s_{n-k} of the slip at the corners of facets [m/s^2], (facets, dim); None: zero
        self.slip_rate: Array | None = None
        self._moved = np.inf  #: largest motion of a vertex from the last cut to this one [m]
        #: of the facets of all surfaces: slip length [m] and transmissivity of a layer [m^3], None: no slip, no layer
        self.slip_length = by_facets(surfaces, [surface.slip_length for surface in surfaces])
        self.transmissivity = by_facets(surfaces, [surface.transmissivity for surface in surfaces])
        #: facets with fluid pressure in closed contact, and their transmissivity there [m^3]; None: none, no seepage
        self.may_close, self.seeping = may_close(surfaces), seeping(surfaces)
        self._interface: InterfaceTerms | None = None
        self._least = np.zeros(0)  #: least penalty of pieces in films [Pa s/m], zero where another is larger
        self._touched = True  #: surfaces cut cells, on any process; terms of surfaces that do not are zero
        self._zone: ClosedZone | None = None
        self._seepage: ZoneSeepage | None = None
        self._current = False  #: weights, interface and cut penalty belong to the present cut and scales

    # ------------------------------------------------------------------------------------------------- a new step

    def forget_roots(self) -> None:
        """Let the extension of the next cut choose its roots anew."""
        if self.cut_penalty is not None:
            self.cut_penalty.begin_step(np.zeros(self.unknowns.local, dtype=bool))

    def begin_step(self, step: FlowStep, rate: Array, missing: NDArray[np.bool_], velocity: Array) -> None:
        """Set the time derivative, the loads at the end of a step, and the scales (collective).

        Arrays are at local dofs. rate: the history in u_t = alpha u - rate [m/s^2]; missing: where the history is
        incomplete; velocity [m/s]: for the scales.
        """
        self._alpha.value = step.difference.alpha
        self._scale_alpha.value = step.difference.alpha if step.scale_alpha is None else step.scale_alpha
        if self.gaps is not None:
            self.gaps.begin_step(None if self.settings.steady else step.dt)
        self.history.x.array[:] = rate
        if self.cut_penalty is not None:
            self.cut_penalty.begin_step(missing)
        self.driving.begin_step()
        if self.settings.body_force is not None:
            set_velocity(self._force.x.array, self.unknowns.velocity, self.settings.body_force, step.t)
        self._outer.begin_step(step.t)
        self.set_scales(velocity)

    def set_scales(self, velocity: Array) -> None:
        """Set the velocity a [m/s], at local dofs, that scales stabilisation and penalties (collective)."""
        settings, unknowns = self.settings, self.unknowns
        self._scale_velocity.x.array[:], self._current = velocity, False
        self.viscosity.set_scales(velocity)
        speed = np.linalg.norm(velocity[unknowns.velocity.dofs], axis=1)
        by_dof = np.zeros(unknowns.local)
        by_dof[unknowns.velocity.dofs[:, 0]] = speed
        dofs = unknowns.cell_blocks if unknowns.block_size == 1 else unknowns.cell_blocks * unknowns.block_size
        self.speed = by_dof[dofs].max(axis=1) * settings.convection
        self.fastest = float(self.grid.comm.allreduce(self.speed.max(initial=0.0), op=MPI.MAX))
        if self.cut_penalty is not None:
            numbers = settings.viscosity, settings.density, float(self._scale_alpha.value)
            self.cut_penalty.set_scales(Scales(*numbers, self.speed, speed * settings.convection))

    def set_cut(self, cut: Cut) -> None:
        """Set the cut: cells, faces, active dofs, and a larger sparsity pattern if it needs one (collective)."""
        if cut is self.cut:
            return
        if self.cut is not None and self.cut.motion.x.shape == cut.motion.x.shape:
            self._moved = float(np.abs(cut.motion.x - self.cut.motion.x).max(initial=0.0))
        self.cut, self._current, grid = cut, False, self.grid
        active = np.zeros(len(grid.numbers), dtype=bool)
        active[cut.active] = True
        if self.with_bodies:
            before, self._touched = self._touched, grid.comm.allreduce(len(cut.pieces.cell) > 0, op=MPI.LOR)
            if before or self._touched:
                self._interface = None
        self.active_dofs = self.dofs_of(cut.active)
        pattern_changed = False
        if self.gaps is not None:
            self.gaps.set(cut)
        if self.cut_penalty is not None:
            pattern_changed = self.cut_penalty.set_cut(cut, self.boundary.dofs)
            self.active_dofs &= ~self.cut_penalty.undetermined
        self.cells = [some[some < grid.owned] for some in (cut.uncut, cut.cut)]
        if self.settings.films and (films := film_cells(grid, cut.cut, cut.creeping)) is not None:
            self.cells = [self.cells[0], np.setdiff1d(self.cells[1], films, assume_unique=True), films]
        cells = self.cells
        if self.gaps is not None and self.gaps.marked is not None:
            cells = [*cells, self.gaps.among(cells[1]), self.gaps.among(cells[0])]
        self._residuals, self._tangents = (
            [form.on(cell=some) for form, some in zip(integrals, cells, strict=False)]
            for integrals in (self.forms.residuals, self.forms.tangents)
        )
        self._outer_on_cut = self._outer.on_cut(cut, active)
        self.outlets.set(self._outer_on_cut.fluxes)
        self._tangents += self._outer_on_cut.tangents
        if self._hanging is not None:
            self._tangents[0] = self._hanging.set_cells(self.cells[0], self._outer_on_cut.hanging)
        self.matrix.fit(cut, changed=pattern_changed)

    def held(self) -> NDArray[np.bool_]:
        """Owned dofs with rows of the identity: prescribed, inactive, hanging, and those of nodes without fluid."""
        unknowns = self.unknowns
        held = ~self.active_dofs[: unknowns.owned]
        held[self.boundary.dofs[self.boundary.dofs < unknowns.owned]] = True
        if self.cut_penalty is not None:
            held |= self.cut_penalty.outside
        if unknowns.hanging is not None:
            held |= unknowns.hanging.dofs[: unknowns.owned]
        return held

    def dofs_near_surfaces(self) -> NDArray[np.bool_]:
        """Mask of the owned dofs of cut cells and of the cells around them (collective)."""
        assert self.cut is not None
        blocks = self.dofs_of(self.cut.cut)[:: self.unknowns.block_size]
        around = np.flatnonzero(blocks[self.unknowns.cell_blocks].any(axis=1)).astype(np.int32)
        return self.dofs_of(around)[: self.unknowns.owned]

    def dofs_behind_surfaces(self) -> NDArray[np.bool_]:
        """Mask of the owned dofs of cells behind surfaces to which the flow is extended alone (collective)."""
        assert self.cut is not None
        behind, with_fluid = self.cut.strip, np.concatenate([self.cut.cut, self.cut.uncut])
        return (self.dofs_of(behind) & ~self.dofs_of(with_fluid))[: self.unknowns.owned]

    def dofs_of(self, cells: NDArray[np.int32]) -> NDArray[np.bool_]:
        """Mask of the local dofs that belong to some cells; every process passes its local ones (collective)."""
        blocks = np.zeros(self.unknowns.local // self.unknowns.block_size, dtype=bool)
        blocks[self.unknowns.cell_blocks[cells]] = True
        blocks = fem.sum_ghosts(self.unknowns.space, blocks.astype(float)) > 0.0
        return self.unknowns.expand(blocks)

    def assemble_interface(self) -> InterfaceTerms:
        """Terms of the surfaces on the present cut (collective)."""
        self._follow()
        assert self._interface is not None
        return self._interface

    def shape_derivatives(self, *, improved: bool) -> tuple[CutDerivatives | None, FilmDerivatives | None]:
        """Derivatives by the motion of surfaces: of all pieces, and those that replace them in films (collective).

        None in steady flows, where the first increments would be too large, and for second degree until the step has an
        increment. improved: it has.
        """
        at, cut, settings, degree = self.assemble_interface(), self.cut, self.settings, self.settings.degree
        assert cut is not None
        if degree > 1 and not improved:
            return None, None
        flow, of_all = self.flow.x.array, None
        g = at.at_corners(cut.motion.v, self.sweep_velocity)
        if not settings.steady:
            assert self.forms.moving is not None
            # with fluid pressure in closed contact the zone ends where the flow does, and their pressures cancel
            moved = self._moved if improved and self.may_close is None else np.inf
            terms = settings.convection, settings.penalties, self.forms.moving, degree, self.gaps
            state = FlowTerms(flow, settings.density, float(self._alpha.value), *terms, moved, g)
            of_all = cut_derivatives(at, self.weights, self.grid, cut, state)
        if self.forms.films is None:
            return of_all, None
        return of_all, film_derivatives(at, self.unknowns, self.weights, cut, self.forms.films, g, self._least)

    def assemble_zone(self) -> ClosedZone | None:
        """Fluid pressure in closed contact; None if no contact is closed (collective)."""
        self._follow()
        return self._zone

    def assemble_seepage(self) -> ZoneSeepage | None:
        """Seepage through closed contact; None if there is none (collective)."""
        self._follow()
        return self._seepage

    def _follow(self) -> None:
        """Update weights, interface and cut penalty to the present cut and scales (collective)."""
        changed = self.with_bodies and self.viscosity.update(self.flow.x.array)
        if self._current and not changed:
            return
        assert self.cut is not None
        cut = self.cut
        if self.with_bodies and (self._touched or self._interface is None):
            penalty = self._interface_penalties(cut.pieces, cut)
            self.weights.set(cut, penalty)
            assert self.forms.surfaces is not None
            self._interface = InterfaceTerms(
                self.grid,
                self.unknowns,
                self.weights,
                cut,
                self.forms.surfaces,
                self.viscosity.of(cut.cut[cut.pieces.cell]),
                penalty,
                self.slip_length,
                self.transmissivity,
                self._slip_inertia(cut.pieces, cut),
            )
            if self.may_close is not None:
                zone = self._zone = find_zone(cut, self._interface, self.may_close, self.grid.comm)
                self._seepage = None
                if zone is not None and self.seeping is not None:
                    self._seepage = ZoneSeepage(zone, self.seeping / self.settings.viscosity)
        self.matrix.assemble_penalty(self._penalty_history)
        if self.driving.given:
            self.driving.assemble(self._residuals, cut, self.weights, self.dofs_near_surfaces())
        self._current = True

    def end_step(self) -> None:
        """Accept the step (collective)."""
        if self.gaps is not None:
            assert self.forms.flow_in_gaps is not None
            self.gaps.end_step(self.forms.flow_in_gaps)
        self.settle()

    def settle(self) -> None:
        """Set the values of nodes without fluid by extension (collective)."""
        if self.cut_penalty is not None:
            owned = self.unknowns.owned
            self.flow.x.array[:owned] = self.cut_penalty.settle(self.flow.x.array[:owned])
            self.flow.x.scatter_forward()

    def _interface_penalties(self, pieces: Pieces, cut: Cut) -> Array:
        """P of pieces [Pa s/m], shape (pieces, dim, dim)."""
        settings, cells = self.settings, cut.cut[pieces.cell]
        g = cut.motion.v[cut.facets[pieces.facet]].mean(axis=1)
        flow = self.viscosity.of(cells), settings.density, float(self._alpha.value)
        speeds, sizes = (self.speed[cells], g * settings.convection), self.grid.sizes[cells]
        reduced = 1.0 if self.gaps is None else self.gaps.lengths(cells)
        least, shape = least_in_films(cut, self.grid), (settings.penalties, settings.degree, pieces.normal, sizes)
        self._least = np.where(least > nitsche.viscous_penalty(*shape, reduced), flow[0] * least, 0.0)
        return nitsche.penalties(flow, *shape, *speeds, reduced, least)

    def _slip_inertia(self, pieces: Pieces, cut: Cut) -> Array | None:
        """rho gamma_t h sum_k beta_k s_{n-k} at the corners of pieces [Pa], (pieces, dim); None: zero."""
        if self.slip_rate is None:
            return None
        settings, sizes = self.settings, self.grid.sizes[cut.cut[pieces.cell]]
        mass = nitsche.slip_mass(settings.density, settings.penalties, pieces.normal, sizes)
        return mass[:, None] * self.slip_rate[pieces.facet]

    def slip(self) -> Array:
        """Slip (u - g) . n at the corners of all facets [m/s], (facets, dim) (collective)."""
        assert self.cut is not None
        at, g = self.assemble_interface(), self.cut.motion.v
        return slip_of_facets(at, self.flow.x.array, at.at_corners(g, self.sweep_velocity), len(self.cut.facets))

    # --------------------------------------------------------------------------------------- residual and tangent

    def residual(self) -> Array:
        """Residual at owned dofs (collective): forces [N] in momentum rows, flow rates [m^3/s] in continuity rows."""
        self._follow()
        assert self.cut is not None
        np.negative(self._penalty_history, out=self._out)
        for form in [*self._residuals, *self._outer_on_cut.residuals]:
            fem.assemble_vector(form, self._out)
        if self._interface is not None and self._touched:
            self._out += self._interface.velocity_terms(self.cut.motion.v, self.sweep_velocity)
            for terms in self._interface.cell_blocks:
                self._out += terms.rows(self.flow.x.array)
        if self._seepage is not None:
            self._seepage.add_rows(self._out, self.flow.x.array)
        self._add_covered(self._out)
        fem.add_ghosts(self.unknowns.space, self._out)
        owned = self.unknowns.owned
        rows, flow, penalty = self._out[:owned], self.flow.x.array[:owned], self.matrix.penalty
        if self._hanging is not None:
            rows = self._hanging.table.rows(rows)
        return rows + self.outlets.rows(flow) + (0.0 if penalty is None else penalty.times(flow))

    def tangent(self, identity: NDArray[np.bool_], *, picard: bool) -> PETSc.Mat:
        """d(residual)/d(flow) without the parts of outlets and driving forces; the next call overwrites it.

        identity: owned dofs with such rows; picard: u . grad u is linearised without its second term, about the
        velocity of `set_scales`.
        """
        self._follow()
        self._newton.value = 0.0 if picard else 1.0
        matrix = self.matrix.values
        matrix.zeroEntries()
        if self.matrix.penalty is not None:
            self.matrix.penalty.add_to(matrix)
        for form in self._tangents:
            fem.assemble_matrix(matrix, form)
        if self._hanging is not None:
            self._hanging.add(matrix)
        for dofs, blocks in self._outer.slopes(self._outer_on_cut, *self._outer_scales()):
            for at, block in zip(dofs.reshape(len(dofs), -1).astype(PETSc.IntType), blocks, strict=True):
                matrix.setValuesLocal(at, at, block.reshape(len(at), -1), PETSc.InsertMode.ADD_VALUES)
        for dofs, block in () if self._interface is None else chain(*self._interface.cell_blocks):
            matrix.setValuesLocal(dofs, dofs, block, PETSc.InsertMode.ADD_VALUES)
        self._newton.value = 1.0
        matrix.assemble()
        if self._seepage is not None:
            matrix = self._seepage.added_to(matrix, self.unknowns)
        start = matrix.getOwnershipRange()[0]
        # multigrid converts the matrix; on several processes PETSc then drops the option for columns of other processes
        matrix.setOption(PETSc.Mat.Option.KEEP_NONZERO_PATTERN, True)
        matrix.zeroRows((start + np.flatnonzero(identity)).astype(PETSc.IntType), 1.0)
        return matrix

    def save(self) -> State:
        """Velocity [m/s], pressure [Pa] and sparsity pattern, by nodes and cells that this process owns.

        With first-order velocities the flow in gaps, which is the same on all processes. Velocities of facets beside
        those of their vertices follow from earlier steps, and are set after a cut.
        """
        unknowns, grid, flow = self.unknowns, self.grid, self.flow.x.array
        in_gaps = {} if self.gaps is None else {"gaps": self.gaps.memory}
        return in_gaps | {
            "flow": unknowns.to_nodes(flow, unknowns.velocity),
            "pressure": unknowns.to_nodes(flow, unknowns.pressure),
            "pattern": Nodal(self.matrix.state(), grid.original[: grid.owned]),
            "sweep_velocity": np.empty(0) if self.sweep_velocity is None else self.sweep_velocity,
        }

    def restore(self, state: State) -> None:
        """Restore a saved state, but for the velocity of facets (collective)."""
        unknowns, flow = self.unknowns, self.flow.x.array
        flow[:] = unknowns.from_nodes(state["flow"].values, unknowns.velocity)
        flow[:] += unknowns.from_nodes(state["pressure"].values, unknowns.pressure)
        self.matrix.restore(state["pattern"].values)
        if self.gaps is not None:
            self.gaps.memory = state["gaps"]

    # -------------------------------------------------------------------------------------------------- reactions

    def interface_entries(
        self, held: NDArray[np.bool_], vertices: NDArray[np.int64], alpha: float, swept: Array | None, *, improved: bool
    ) -> InterfaceEntries:
        """Derivatives of rows and force by the motion of some vertices, see `coupling_entries` (collective).

        held: owned dofs with rows of the identity; alpha [1/s]: dg/dd; improved: see `shape_derivatives`.
        """
        unknowns, flow = self.unknowns, self.flow.x.array
        mark = np.pad(held.astype(float), (0, unknowns.local - unknowns.owned))
        with_ghosts = fem.share_owned(unknowns.space, mark) > 0.5
        operator, shape = self.assemble_interface(), self.shape_derivatives(improved=improved)
        found = interface_entries(operator, unknowns, flow, alpha, with_ghosts, vertices, shape, swept)
        zone = self.assemble_zone()
        return found if zone is None else with_zone(found, zone, unknowns, flow, vertices)

    def suction(self, facets: NDArray[np.bool_]) -> float:
        """Largest pressure below zero [Pa] in the cells of some facets (collective)."""
        assert self.cut is not None
        pieces = self.cut.pieces
        cells = self.cut.cut[pieces.cell[facets[pieces.facet]]]
        lowest = float(self.flow.x.array[self.unknowns.cell_pressure[cells]].mean(axis=1).min(initial=0.0))
        return float(self.grid.comm.allreduce(-lowest, op=MPI.MAX))

    def surface_force(self) -> Array:
        """Force [N] of the fluid on the vertices of all surfaces, shape (n, dim) (collective)."""
        assert self.cut is not None
        force = self.assemble_interface().force(self.flow.x.array, self.cut.motion.v, self.sweep_velocity)
        return self.grid.comm.allreduce(force) + self.zone_force()

    def force_on_facets(self) -> tuple[Array, Array]:
        """(force [N] on each facet without that of closed contact, (facets, dim); its wet area) (collective)."""
        assert self.cut is not None
        found = self.assemble_interface().force_on_facets(
            self.flow.x.array, self.cut.motion.v, len(self.cut.facets), self.sweep_velocity
        )
        force, area = (self.grid.comm.allreduce(part) for part in found)
        return force, area

    def sweep_power(self) -> float:
        """Power [W] of the force of the fluid on what facets move beside their vertices (collective)."""
        assert self.cut is not None
        if self.sweep_velocity is None:
            return 0.0
        power = self.assemble_interface().power_on_facets(self.flow.x.array, self.cut.motion.v, self.sweep_velocity)
        return float(self.grid.comm.allreduce(power))

    def zone_force(self) -> Array:
        """The part of `surface_force` that acts in closed contact (collective)."""
        assert self.cut is not None
        force = np.zeros_like(self.cut.motion.x)
        if (zone := self.assemble_zone()) is not None:
            force[zone.facets.vertices] = zone.force(zone.pressure(self.flow.x.array))
        return force

    def outer_rows(self) -> Array:
        """Rows of tractions and outflow alone, at local dofs; the contributions to ghosts are not yet added up."""
        out = np.zeros(self.unknowns.local)
        for form in self._outer_on_cut.residuals:
            fem.assemble_vector(form, out)
        self._add_covered(out)
        out[: self.unknowns.owned] += self.outlets.rows(self.flow.x.array[: self.unknowns.owned])
        return out

    def _add_covered(self, out: Array) -> None:
        self._outer.add_covered(self._outer_on_cut, out, self.flow.x.array, *self._outer_scales())

    def _outer_scales(self) -> tuple[float | Array, float, Array]:
        density = self.settings.density if self.settings.convection else 0.0
        return self.viscosity.of(np.arange(len(self.grid.sizes))), density, self._scale_velocity.x.array
