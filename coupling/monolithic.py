"""Monolithic coupling: one Newton iteration for solid and flow, with condensed contact and a new cut for each iterate.

    [ K + w alpha B^T M B    -w B^T C^T S ] [du]       [ r_s ]
    [ alpha C B                    A      ] [dw]  =  - [ r_f ]

du: unknowns of the solid, dw: velocity and pressure. K, A: tangents of solid and flow. B: derivative of the vertices of
the surfaces by du. w: weight of the load at the end of the step in the solid's balance. C, S, M: coupling block, change
of sign and mass of `fluid.terms.interface`; the velocity of the surface is g = alpha d - (earlier displacements).

The derivatives by the shape of the fluid (`fluid.terms.shape_derivatives`) are added to alpha C and M. In steady flows,
where alpha = 0, they are the whole dependence of the flow on du, and `coupling.secant` corrects what they lack. In
unsteady flows they halve the number of Newton iterations.
Source: Schott, Ager, Wall, Int. J. Numer. Meth. Engng 119 (2019) 757-796.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from coupling.blocks import Blocks
from coupling.coupled import Coupled, suction, with_cause
from coupling.divided import lengths, step_in_parts
from coupling.impact import Impact
from coupling.ports import IterativeFlow
from coupling.secant import Secant
from coupling.start import start_again, start_at_jump, start_together
from coupling.wall_passed import WallPassed
from solvers.algebra import linear
from solvers.algebra.connected import connected_parts
from solvers.algebra.lagged import Lagged, LaggedFactors
from solvers.algebra.petsc_python import free_deleted
from solvers.algebra.rounding import rounding_error
from solvers.algebra.rows import Numbering, distributed, from_entries, gather
from solvers.algebra.sparse import Sparse
from solvers.api import Array, FailureKind, Indices, NoResidual, State, StepFailed, StepInfo
from solvers.newton import ENOUGH, Tolerance, converge


@dataclass(frozen=True)
class _Solvers:
    """Numbers of the unknowns of both parts, and the solvers of systems with them."""

    numbering: Numbering
    renewals: int  #: of the flow that has these unknowns
    direct: LaggedFactors
    krylov: Lagged


class Monolithic:
    """Implements `Scheme`, and `System` for Newton's method: follow, residual, advance, retreat, settled."""

    name = "fluid-structure system"

    def __init__(self, coupled: Coupled, tolerance: Tolerance = Tolerance()):
        self.coupled, self.tolerance = coupled, tolerance
        self.comm = coupled.solid.comm
        self._solvers = self._number_unknowns()
        self._secant = Secant()
        self._linear_iterations = 0  #: of this step
        self._linearised = False  #: in this step
        self._pull = 0.0  #: largest `suction` [Pa] of this step at iterates between which contact opens and closes
        self._residual, self._on_surfaces = np.zeros(0), 0.0  #: residual by part, load of the flow on all surfaces [N]
        self._prepared: Blocks | None = None  #: the matrix at the present iterate, if it is assembled already
        #: tangent of the flow, into_flow, into_solid and the derivative of the force by the motion, of the last iterate
        self._of_flow: tuple[PETSc.Mat, PETSc.Mat, PETSc.Mat, PETSc.Mat] | None = None

    def _number_unknowns(self) -> _Solvers:
        """Number the unknowns of both parts; the linear solvers start anew."""
        solid, flow = self.coupled.solid, self.coupled.flow
        # unsteady: the factors of the first iterate do not precondition the later ones well enough
        direct = LaggedFactors(self.comm, fresh=math.inf if flow.steady else 2)
        # free bodies: forces are a small part of what the penalty of their surface has in the first residual, and a
        # thousandth of it in their motion costs another iterate with a new cut
        few = linear.FEW if len(solid.rigid_unknowns()) else 0
        krylov = Lagged(fresh=math.inf if flow.steady else 1, few=few)
        return _Solvers(Numbering(self.comm, solid.size, flow.size), flow.renewals, direct, krylov)

    # ------------------------------------------------------------------------------------------------- steps

    def initialise(self, t: float, dt: float) -> None:
        """Set both parts to the first time t [s]; dt [s]: length of the first step."""
        self.coupled.initialise(t, dt, with_solid=True)
        start_together(self.coupled, t, dt, self._solve_unpredicted, roughly=self._solve_linearised, with_solid=True)

    divides = True  #: steps where it starts

    @property
    def can_start(self) -> bool:
        """Whether it can start in the middle of a run."""
        return self.coupled.start is not None

    def start_anew(self, t: float, dt: float) -> None:
        """Prepare a step of length dt [s] from t, at which given velocities jump (collective)."""
        start_at_jump(self.coupled, t, dt, self._solve_unpredicted, with_solid=True)

    def _begin_system(self) -> None:
        """Discard derivatives and preconditioners of the last step."""
        self._linear_iterations, self._linearised, self._pull = 0, False, 0.0
        self._prepared = self._of_flow = None
        self._solvers.krylov.begin_step()
        self._solvers.direct.begin_step()
        self._secant.forget()

    def _solve_unpredicted(self) -> None:
        self._begin_system()
        self._converge()

    def _solve_linearised(self) -> None:
        """One iteration: with free bodies its system is solved to the square of `ENOUGH`, see `_number_unknowns`."""
        self._begin_system()
        self.follow()
        self.residual()
        self.advance(reduction=ENOUGH)

    def _converge(self) -> StepInfo:
        """To the tolerance; from there once more, if the flow lets go what it has held on the way."""
        info = converge(self, self.tolerance)
        if not self.coupled.flow.release():
            return info
        last = converge(self, self.tolerance)
        residuals = (*info.residuals, *last.residuals)
        return replace(last, iterations=info.iterations + last.iterations, residuals=residuals)

    def step(self, t: float, dt: float) -> StepInfo:
        """Take one, in parts if it is much longer than the last. Raises StepFailed."""
        return step_in_parts(self._take, t, lengths(dt, self.coupled.longest_step))

    def _take(self, t: float, dt: float) -> StepInfo:
        """A step from its predictor, or from the state before it where the predictor leads astray.

        Extrapolated displacements stretch a thin shell that turns. Newton's increment from there may be a hundred times
        too long.
        """
        if self.coupled.start is not None and self.coupled.start.solid.took_impulse:
            start_again(self.coupled, t, dt, self._solve_unpredicted, with_solid=True)
        before = self.save()
        try:
            return self._take_from(t, dt, predicted=not self.coupled.flow.steady)
        except WallPassed:
            self.restore(before)
            return self._take(t, dt)
        except Impact:
            self.restore(before)
            self.coupled.impacts.start_anew(dt)
            return self._take(t, dt)
        except NoResidual:
            if self.coupled.flow.steady:
                raise
        self.restore(before)
        return self._take_from(t, dt, predicted=False)

    def _take_from(self, t: float, dt: float, *, predicted: bool) -> StepInfo:
        coupled = self.coupled
        coupled.begin_step(t, dt)
        self._begin_system()
        if predicted:
            self._predict(t + dt)
        try:
            info = self._converge()
        except StepFailed as failure:
            if predicted and isinstance(failure, NoResidual):
                raise
            self._require_numbers(failure)
            raise with_cause(failure, self._pull) from None
        coupled.solid.check(info)
        coupled.end_step()
        numbers = coupled.balance.numbers() | {"coupling.linear": float(self._linear_iterations)}
        numbers.update(coupled.solid.numbers())
        return StepInfo(info.iterations, info.residuals, numbers, coupled.take_notes())

    def _require_numbers(self, failure: StepFailed) -> None:
        """Raise StepFailed with the cause of a residual that is not a number, or with the part that has it."""
        if np.isfinite(self._residual).all():
            return
        self.coupled.solid.check(StepInfo(failure.iteration, failure.history))
        part = "solid" if np.isfinite(self._residual[-1]) else "flow"
        raise failure.with_reason(f"the residual of the {part} is not a number", FailureKind.NOT_FINITE)

    def _predict(self, t: float) -> None:
        """Set the predictors for the time t [s]; in closed contact with films only if they reduce the residuals [N].

        An extrapolated surface may open parts of the contact. The film there has hardly any height, and the pressure
        for which its first increment takes it moves the surface out of reach.
        """
        self.follow()
        unmoved = self.residual()
        doubtful = self.coupled.solid.in_contact() and self.coupled.flow.has_films()
        self.coupled.predict(t, with_pressure=True)
        if doubtful:
            self.follow()
            now, before = (np.array([np.linalg.norm(r[:-1]), r[-1]]) for r in (self.residual(), unmoved))
            if not (now < before).all():
                self.retreat(np.ones(len(unmoved)))

    # ---------------------------------------------------------------------------- the system that Newton solves

    def follow(self) -> None:
        """Move the surfaces to the displacements of the iterate; number the unknowns anew if the flow has others."""
        flow, interface = self.coupled.flow, self.coupled.interface
        self.coupled.solid.follow()
        flow.move(interface.move(interface.displacement()), with_solid=True)
        if flow.renewals > self._solvers.renewals:
            self._solvers = self._number_unknowns()
            self._prepared = self._of_flow = None
            self._secant.forget()
        flow.follow()

    def residual(self) -> Array:
        """Norm of the residual [N] of each part: those of the solid, then the flow (collective).

        Where contact opens and closes, what the flow pulls at it is kept for the message of a step that fails.
        """
        flow, solid = self.coupled.flow, self.coupled.solid
        of_flow, force = flow.residual(), self.coupled.force()
        solid.load(force)
        self._on_surfaces = float(np.linalg.norm(force))
        self._residual = np.concatenate([solid.residual(), of_flow])
        if self.comm.allreduce(bool(solid.cycle()), op=MPI.LOR):
            self._pull = max(self._pull, suction(self.coupled))
        return self._residual

    def forces(self) -> Array:
        """Norm [N] of the largest force on each part; on the flow also by the surfaces."""
        solid, flow = self.coupled.solid, self.coupled.flow
        return np.concatenate([solid.forces(), np.maximum(flow.forces(), self._on_surfaces)])

    def advance(self, *, keep: bool = False, reduction: float = 0.0) -> Array:
        """One Newton iteration; returns the relative increments of all parts. Raises StepFailed.

        keep: keep the derivatives of the flow, if the same unknowns are held. Those of the solid are cheap, and contact
        needs new ones.
        """
        solid, flow = self.coupled.solid, self.coupled.flow
        blocks, self._prepared = self._prepared or self.blocks(keep=keep), None
        b, x = blocks.create_vectors()
        own = solid.size
        b.array[:own], b.array[own:] = solid.right_side(), flow.right_side()
        taken = [blocks.transform(change, b, self._solvers.numbering) for change in solid.row_transformations()]
        x.array[:own] = solid.missing()
        blocks.hold(solid, b, x)
        try:
            with flow.timer("solve"):
                self._solve(blocks, b, x, reduction)
        except linear.LinearSolveFailed as failure:
            raise StepFailed(self.name, failure.kind, str(failure), where=self.worst()) from failure
        increment = self._corrected(x.array)
        if taken:
            solid.recover(taken, self._solvers.numbering.gather(self.comm, increment))
        return np.concatenate([solid.update(increment[:own]), flow.update(increment[own:])])

    def _corrected(self, increment: Array) -> Array:
        """The increment of both parts, corrected by a secant once a steady flow is near and contact stays."""
        solid, flow = self.coupled.solid, self.coupled.flow
        if not flow.steady or flow.far:
            return increment
        if not solid.settled():
            self._secant.forget()
            return increment
        moved = solid.jacobian() @ gather(self.comm, increment[: solid.size])
        return self._secant.corrected(increment, moved)

    def _solve(self, blocks: Blocks, b: PETSc.Vec, x: PETSc.Vec, reduction: float) -> None:
        flow = self.coupled.flow.iterative
        while flow is not None and flow.sequence.current != "direct":
            try:
                of_flow = flow.product(blocks.flow, reduction)
                matrix = blocks.product(self._solvers.numbering, of_flow)
                whole = blocks.with_added(matrix)
                iterations = self._solvers.krylov.solve_again(whole, b, x, reduction=reduction)
                if iterations is None:
                    ksp = self._krylov_solver(flow, blocks, of_flow)
                    iterations = self._solvers.krylov.solve(ksp, whole, b, x, matrix, reduction=reduction)
                self._linear_iterations += iterations
                return
            except linear.LinearSolveFailed as failure:
                flow.sequence.advance(failure)
        matrix = blocks.assembled()
        self._solvers.direct.solve(blocks.with_added(matrix), b, x, matrix)

    def _krylov_solver(self, flow: IterativeFlow, blocks: Blocks, of_flow: PETSc.Mat) -> PETSc.KSP:
        sequence, of_flow_alone = flow.sequence, None
        if sequence.multigrid:
            of_flow_alone = flow.multigrid(blocks.flow, of_flow)
        krylov = linear.coupled_solver(
            self.comm,
            tolerance=flow.linear_tolerance,
            fill=sequence.current == "fill",
            flow=of_flow_alone,
            few=self.coupled.solid.rigid_unknowns(),
            levels=flow.free_levels(),
        )
        sequence.limit(krylov)
        return krylov

    def blocks(self, *, keep: bool = False) -> Blocks:
        """The matrix at the present iterate.

        keep: with the derivatives of the flow at the last iterate, if they still fit.
        """
        solid, flow = self.coupled.solid, self.coupled.flow
        K = solid.linearise()
        if self._of_flow is None or not (keep and flow.keeps_tangent()):
            self._of_flow = self._derivatives_of_flow()
        A, into_flow, into_solid, mass = self._of_flow
        with flow.timer("coupling"):
            free_deleted(K.comm)  # frees the K of earlier iterates; no solver has this communicator
            K = K.copy()
            K.axpy(1.0, mass, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
            solid.add_rounding(rounding_error(into_solid, flow.rounded()))
            solid.add_rounding(rounding_error(mass, solid.rounded()))
            self._linearised = True
            added = solid.added_product(), flow.added_product()
            return Blocks(K, into_solid, into_flow, A, added)

    def _derivatives_of_flow(self) -> tuple[PETSc.Mat, PETSc.Mat, PETSc.Mat, PETSc.Mat]:
        """The tangent of the flow and the coupling blocks at the present iterate."""
        solid, flow = self.coupled.solid, self.coupled.flow
        A = flow.linearise()
        with flow.timer("coupling"):
            into_flow, into_solid, mass = self.coupling_blocks()
            # the exchanged positions, velocities and forces are rounded too
            flow.add_rounding(2.0**flow.dim * rounding_error(into_flow, solid.rounded()))
        return A, into_flow, into_solid, mass

    def coupling_blocks(self) -> tuple[PETSc.Mat, PETSc.Mat, PETSc.Mat]:
        """alpha C B, -w B^T C^T S and w alpha B^T M B; rows of held dofs of the flow are empty."""
        flow, solid = self.coupled.flow, self.coupled.solid
        entries = flow.interface_entries(self.coupled.interface.surfaces)
        B = solid.jacobian().transposed(self._solvers.numbering.first.getSize())
        into_flow, force_by_motion = B @ entries.into_flow, B @ (B @ entries.force_by_motion).T
        return (
            self._matrix((flow.size, solid.size), into_flow.T),
            self._matrix((solid.size, flow.size), solid.weighted(-(B @ entries.force_by_flow)).ordered()),
            self._matrix((solid.size, solid.size), solid.weighted(-force_by_motion.T)),
        )

    def _matrix(self, owned: tuple[int, int], parts: Sparse) -> PETSc.Mat:
        if self.comm.size == 1:
            return distributed(parts, ((owned[0], None), (owned[1], None)), self.comm)
        rows, columns = parts.row_numbers().astype(np.int64), parts.indices.astype(np.int64)
        return from_entries(self.comm, owned, rows, columns, parts.data)

    def retreat(self, fraction: Array) -> None:
        """Take back fractions of the last increment, by part."""
        self.coupled.solid.retreat(fraction[:-1])
        self.coupled.flow.retreat(fraction[-1:])
        self._secant.retreat(float(fraction[-1]))

    def linked(self) -> Indices:
        """Components: the flow and the bodies in it are one."""
        solid, flow, interface = self.coupled.solid, self.coupled.flow, self.coupled.interface
        of_solid, outside = solid.linked(), flow.outside(interface.move(interface.displacement()))
        wet, n = np.flatnonzero(~solid.parts_of(outside)), len(of_solid)
        first, second = np.append(np.arange(n), wet), np.append(of_solid, np.full(len(wet), n))
        return connected_parts(first, second, n + 1)

    def cycle(self) -> str:
        """What cycles in contact."""
        return self.coupled.solid.cycle()

    def astray(self, risen: Sequence[NDArray[np.bool_]]) -> NDArray[np.bool_]:
        """The parts of an active set that cycles. Residuals of solid and flow may well rise."""
        return np.append(self.coupled.solid.astray([]), False)

    def settled(self) -> bool:
        """Whether supports and active sets are fulfilled."""
        return self.coupled.solid.settled()

    def only_rounding(self) -> NDArray[np.bool_]:
        """Whether the residual is rounding errors in all rows of a part."""
        if not self._linearised:
            self._prepared = self.blocks()
        return np.concatenate([self.coupled.solid.only_rounding(), self.coupled.flow.only_rounding()])

    def worst(self) -> tuple[float, ...] | None:
        """Position [m] of the largest residual, of the part with the larger relative residual (collective)."""
        forces = self.forces()
        relative = np.divide(self._residual, forces, out=self._residual.copy(), where=forces > 0.0)
        solid, flow = self.coupled.solid, self.coupled.flow
        return solid.worst() if relative[:-1].max() > relative[-1] else flow.worst()

    # ---------------------------------------------------------------------------------------- save and restore

    def save(self) -> State:
        return self.coupled.save()

    def restore(self, state: State) -> None:
        self.coupled.restore(state)
