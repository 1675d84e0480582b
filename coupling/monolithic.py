"""Monolithic coupling: one Newton iteration for structure and fluid, contact condensed, the cut following each iterate.

    [ K + w alpha M_G    -w C^T S ] [du]       [ r_s ]        w: weight of the load in the structure's balance
    [ alpha C                A    ] [dw]  =  - [ r_f ]        C, S, M: see solvers.fluid.interface, g = alpha d - ...

To alpha C and M_G come the derivatives with respect to the shape of the fluid's domain (solvers.fluid.shape): in steady
flows, where alpha = 0, they are the whole dependence of the fluid on du; in time they halve the number of Newton steps.
Source: Schott, Ager, Wall, Int. J. Numer. Meth. Engng 119 (2019) 757-796.
"""

from __future__ import annotations

import math

import numpy as np
from petsc4py import PETSc

from coupling.blocks import Blocks
from coupling.coupled import Coupled
from solvers import linear
from solvers.api import Array, State, StepFailed, StepInfo
from solvers.fluid.field import Fluid
from solvers.fluid.shape import shape_derivatives
from solvers.lagged import LaggedFactors
from solvers.newton import Tolerance, converge
from solvers.rounding import rounding_error
from solvers.rows import Numbering, from_entries
from solvers.structure.field import Structure


class Monolithic:
    """A Scheme, and the system that Newton's method solves."""

    name = "fluid-structure system"

    def __init__(self, coupled: Coupled, tolerance: Tolerance = Tolerance()):
        self.coupled, self.tolerance = coupled, tolerance
        structure, fluid = coupled.structure, coupled.fluid
        self.comm, fluid.solved_with_bodies = structure.comm, True
        self._numbering = Numbering(self.comm, structure.layout.size, fluid.unknowns.owned)
        # in time the matrix of the first guess is too far from the later ones to serve for all of them
        self._direct = LaggedFactors(self.comm, fresh=math.inf if fluid.settings.steady else 2)
        self._farther: Structure | Fluid = fluid
        self._krylov: PETSc.KSP | None = None
        self._preconditioned_by: PETSc.Mat | None = None
        self._fresh_iterations = self._linear_iterations = 0
        #: rounding errors of the residuals of structure and fluid [N], as far as this step knows
        self._noise: Array | None = None
        self._prepared: Blocks | None = None  #: the matrix at the present iterate, if it is there already

    # ------------------------------------------------------------------------------------------------- steps

    def initialise(self, t: float, dt: float) -> None:
        """Both fields at the first time."""
        self.coupled.initialise(t, dt)

    def step(self, t: float, dt: float) -> StepInfo:
        coupled = self.coupled
        coupled.begin_step(t, dt)
        self._largest, self._krylov, self._linear_iterations = np.zeros(2), None, 0
        self._noise = self._prepared = None
        self._direct.begin_step()
        unmoved = 0.0
        if not coupled.fluid.settings.steady:
            unmoved = self.residual()
            coupled.predict(t + dt)
        info = converge(self, self.tolerance, unmoved)
        coupled.structure.check_deformation(info.iterations, info.residuals)
        coupled.end_step()
        numbers = coupled.balance.numbers() | {"coupling.linear": float(self._linear_iterations)}
        if coupled.structure.constraint is not None:
            numbers.update(coupled.structure.constraint.numbers())
        return StepInfo(info.iterations, info.residuals, numbers, tuple(coupled.fluid.notes))

    # ---------------------------------------------------------------------------- the system that Newton solves

    def residual(self) -> float:
        """The larger of both fields' residuals, relative to its largest of the step, times the sum of those [N]."""
        fluid, structure, interface = self.coupled.fluid, self.coupled.structure, self.coupled.interface
        fluid.move(interface.move(interface.displacement()))
        of_fluid = fluid.residual()
        structure.load(interface.spread(self.coupled.force()))
        found = np.array([structure.residual(), of_fluid])
        self._largest = np.maximum(self._largest, found)
        self._found = found
        above = found > (np.zeros(2) if self._noise is None else self._noise)
        relative = np.divide(found, self._largest, out=np.zeros(2), where=above)
        self._farther = structure if relative[0] > relative[1] else fluid
        return float(relative.max() * self._largest.sum())

    def advance(self) -> float:
        """One Newton step; the larger of both fields' relative increments."""
        structure, fluid = self.coupled.structure, self.coupled.fluid
        blocks, self._prepared = self._prepared or self._blocks(), None
        b, x = blocks.create_vectors()
        own = structure.layout.size
        b.array[:own] = -structure.residual_force
        b.array[own:] = -fluid.residual_rows
        if structure.constrained:
            blocks.condense(structure, b, self._numbering)
        x.array[:own] = structure.missing_displacement()
        blocks.hold(structure, b, x)
        try:
            with fluid.timer("solve"):
                self._solve(blocks, b, x)
        except linear.LinearSolveFailed as failure:
            raise StepFailed(self.name, str(failure), where=self.worst()) from failure
        everything = self._numbering.gather(self.comm, x.array) if structure.constrained else None
        return max(structure.update(x.array[:own], everything), fluid.update(x.array[own:]))

    def _solve(self, blocks: Blocks, b: PETSc.Vec, x: PETSc.Vec) -> None:
        ladder = self.coupled.fluid.ladder
        while ladder.here != "direct":
            try:
                self._iterate(blocks, b, x)
                return
            except linear.LinearSolveFailed as failure:
                ladder.climb(failure)
        self._direct.solve(blocks.assembled(), b, x)

    def _iterate(self, blocks: Blocks, b: PETSc.Vec, x: PETSc.Vec) -> None:
        """Preconditioned by the first matrix of the step as long as that serves."""
        fluid, matrix = self.coupled.fluid, blocks.nested()
        if self._krylov is not None:
            try:
                linear.solve(self._krylov, matrix, b, x, self._preconditioned_by)
            except linear.LinearSolveFailed:
                self._krylov = None
            else:
                iterations = self._krylov.getIterationNumber()
                self._linear_iterations += iterations
                if iterations > 2 * self._fresh_iterations:
                    self._krylov = None
                return
        rung, tolerance = fluid.ladder.here, fluid.solver.linear_tolerance
        parts = self._numbering.first, self._numbering.second
        krylov = linear.coupled_solver(self.comm, *parts, tolerance=tolerance, fill=rung == "fill")
        if rung == "multigrid":
            krylov.setOperators(matrix)
            krylov.getPC().setUp()
            fluid.set_up_multigrid(krylov.getPC().getFieldSplitSubKSP()[1].getPC(), blocks.fluid)
        linear.solve(krylov, matrix, b, x)
        linear.keep_factors(krylov)
        self._krylov, self._preconditioned_by = krylov, matrix
        self._fresh_iterations = krylov.getIterationNumber()
        self._linear_iterations += self._fresh_iterations

    def _blocks(self) -> Blocks:
        structure, fluid = self.coupled.structure, self.coupled.fluid
        K, A = structure.linearise(), fluid.linearise()
        with fluid.timer("coupling"):
            into_fluid, into_structure, mass = self._coupling_blocks()
            PETSc.garbage_cleanup(K.comm)  # the K of earlier iterates, on a communicator that no solver has
            K = K.copy()
            K.axpy(1.0, mass, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
            # what the fields exchange is rounded too: positions and velocities of the surface, and the force
            fluid.add_rounding(fluid.rounding_of(into_fluid, structure.rounded()))
            structure.add_rounding(rounding_error(into_structure, fluid.flow[: fluid.unknowns.owned]))
            structure.add_rounding(rounding_error(mass, structure.rounded()))
            self._noise = np.array([structure.round_off(), fluid.round_off()])
            return Blocks(K, into_structure, into_fluid, A)

    def _coupling_blocks(self) -> tuple[PETSc.Mat, PETSc.Mat, PETSc.Mat]:
        """alpha C, -w C^T S and w alpha M as distributed matrices; rows of held fluid dofs are empty."""
        fluid, structure, surface = self.coupled.fluid, self.coupled.structure, self.coupled.interface
        alpha, weight = fluid.difference.alpha, structure.time.force_weight
        operator = fluid.system.interface
        by_shape, load_by_shape = shape_derivatives(operator, fluid.flow)
        C = operator.coupling_blocks
        back = np.concatenate([-C[0].ravel(), C[1].ravel()])
        into = np.concatenate([(alpha * c + s).ravel() for c, s in zip(C, by_shape, strict=True)])
        load = (alpha * operator.mass_blocks - load_by_shape).ravel()

        #: the structure's dof of each dof of the vertices, -1 for those of rigid bodies
        moved = np.full((len(fluid.cut.motion.x), fluid.dim), -1)
        moved[fluid.vertices_of([s.name for s in surface.surfaces])] = surface.dofs
        flow, moved = fluid.unknowns.global_dofs, moved.ravel()
        rows, columns = operator.pattern
        held, elastic = fluid.held_everywhere()[rows], moved[columns] >= 0
        own, own_flow = structure.layout.size, fluid.unknowns.owned
        of_flow, of_structure = flow[rows], moved[columns]
        kept = elastic & ~held
        into_fluid = from_entries(self.comm, (own_flow, own), of_flow[kept], of_structure[kept], into[kept])
        into_structure = from_entries(
            self.comm, (own, own_flow), of_structure[elastic], of_flow[elastic], -weight * back[elastic]
        )
        rows, columns = (moved[dofs] for dofs in operator.surface_pattern)
        elastic = (rows >= 0) & (columns >= 0)
        mass = from_entries(self.comm, (own, own), rows[elastic], columns[elastic], weight * load[elastic])
        return into_fluid, into_structure, mass

    def retreat(self, fraction: float) -> None:
        """Take back a fraction of the last increment."""
        self.coupled.structure.retreat(fraction)
        self.coupled.fluid.retreat(fraction)

    def settled(self) -> bool:
        """Supports and active sets are fulfilled."""
        return self.coupled.structure.settled()

    def round_off(self) -> float:
        """No residual is too large if those of both fields are rounding errors; other ones are left out already."""
        if self._noise is None:
            self._prepared = self._blocks()
        assert self._noise is not None
        return math.inf if (self._found <= self._noise).all() else 0.0

    def worst(self) -> tuple[float, ...] | None:
        """Where the field that is farther off has its largest residual [m] (collective)."""
        return self._farther.worst()

    # ---------------------------------------------------------------------------------------- save and restore

    def save(self) -> State:
        return self.coupled.save()

    def restore(self, state: State) -> None:
        self.coupled.restore(state)
