"""The protocols `Solid` and `Flow`: all that coupling schemes know of the two parts of a coupled system.

The parts exchange motion and force at the vertices of the surfaces: the solid gives displacements [m], the flow the
force [N]. Each part has its own unknowns, distributed over the processes; the vertices are the same on all processes.
All calls are collective.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers.algebra.linear import LinearSolveFailed
from solvers.algebra.rows import RowTransformation, TakenRows
from solvers.algebra.sparse import Sparse
from solvers.algebra.vertices import VertexJacobian
from solvers.api import Array, Indices, Stateful, StepInfo
from solvers.exchange import Difference, InterfaceEntries, Motion
from solvers.newton import System
from solvers.timing import Timer


class Part(System, Stateful, Protocol):
    """One block of the coupled system. It can be solved alone, or give its rows to the matrix of all blocks.

    Arrays have the shape (size,): the unknowns that this process owns.
    """

    @property
    def size(self) -> int:
        """Unknowns that this process owns."""
        ...

    def initialise(self, t: float, dt: float) -> None:
        """Set the state at the first time t [s]; dt [s]: length of the first step."""
        ...

    def begin_step(self, t: float, dt: float) -> None:
        """Begin a step from t to t + dt [s]."""
        ...

    def solve(self) -> StepInfo:
        """Solve this part alone, with the data of the other one fixed. Raises StepFailed."""
        ...

    def end_step(self) -> None:
        """Accept the step."""
        ...

    def linearise(self) -> PETSc.Mat:
        """The derivative of its residual by its own unknowns."""
        ...

    def right_side(self) -> Array:
        """Right-hand side for the increment: minus the residual."""
        ...

    def update(self, increment: Array) -> Array:
        """Add an increment; returns its norm relative to that of the solution, by part."""
        ...

    def rounded(self) -> Array:
        """The values whose rounding enters the residual, for `rounding_error`."""
        ...

    def add_rounding(self, error: Array) -> None:
        """Add rounding errors that the other part causes in the residual; call it after `linearise`."""
        ...


class Solid(Part, Protocol):
    """The part with the bodies: it moves its surfaces and takes a load on them.

    Contact multipliers are condensed by a transformation of its rows.

    Arrays of the shape (m,) are generalised forces or displacements, the same on all processes: the components at all
    vertices for elastic bodies, forces and moments for rigid ones.
    """

    @property
    def comm(self) -> MPI.Comm: ...

    @property
    def surfaces(self) -> Mapping[str, Array]:
        """Names of the surfaces in the flow -> reference positions [m] of their vertices, shape (n, dim)."""
        ...

    def mean_load(self, before: Array, after: Array) -> Array:
        """w after + (1 - w) before: the generalised load in the balance by those at both ends of the step, (m,)."""
        ...

    def weighted(self, rows: Sparse) -> Sparse:
        """Rows of all unknowns of the solid, multiplied by the weight w that a load at the end of the step has."""
        ...

    def predict(self, t: float) -> None:
        """Set the predictor for the time t [s]; `retreat` takes it back."""
        ...

    def parts_of(self, names: Collection[str]) -> NDArray[np.bool_]:
        """Mask of the parts of Newton's method that belong to these bodies (collective)."""
        ...

    def in_contact(self) -> bool:
        """Whether any contact is closed, the same on every process."""
        ...

    def displacement(self) -> Array:
        """Displacement [m] of all vertices, surface by surface, shape (n, dim)."""
        ...

    def contact_pressure(self) -> float:
        """Largest traction [Pa] of closed contact at the latest iterate, zero without contact."""
        ...

    def jacobian(self) -> VertexJacobian:
        """Derivative of the displacement of the vertices by the unknowns."""
        ...

    def load(self, force: Array) -> None:
        """Set the force [N] on all vertices at the end of the step, shape (n, dim)."""
        ...

    def reduced(self, force: Array) -> Array:
        """Generalised forces of forces [N] on the vertices, (n, dim), at the present positions, shape (m,)."""
        ...

    def taken(self) -> Array:
        """The load by the balance of the last step, computed without that of `load`, shape (m,)."""
        ...

    def taken_at_start(self) -> Array:
        """The load by the balance of the initial state, shape (m,)."""
        ...

    def moved(self) -> Array:
        """Displacement of the last step, on which `taken` does work, shape (m,)."""
        ...

    def exchanged(self) -> float:
        """Energy [J] that has changed its form or its body so far: half of the sum of all |changes| and works."""
        ...

    def rigid_unknowns(self) -> Indices:
        """Numbers of free unknowns that move whole surfaces, for preconditioners; the same on all processes."""
        ...

    def row_transformations(self) -> Sequence[RowTransformation]:
        """Transformations of its rows, one after the other, that eliminate contact multipliers."""
        ...

    def recover(self, taken: Sequence[TakenRows], du: Array) -> None:
        """Recover the multipliers from the rows before each transformation and the increment of all unknowns."""
        ...

    def added_product(self) -> Callable[[Array], Array] | None:
        """The part of its derivative that `linearise` lacks, as a product with its unknowns; None: nothing."""
        ...

    def missing(self) -> Array:
        """Prescribed minus present values of its unknowns, zero at free ones."""
        ...

    def impose_rows(self, blocks: Sequence[PETSc.Mat], x: Array, b: Array) -> list[PETSc.Mat]:
        """Replace the rows of supports by du = x. blocks: one row of blocks, its own first; b changes in place."""
        ...

    def check(self, info: StepInfo) -> None:
        """Raise StepFailed for an inadmissible solution."""
        ...

    def touching(self) -> NDArray[np.bool_] | None:
        """Mask of the multipliers in contact; None without contact."""
        ...

    def numbers(self) -> dict[str, float]:
        """Columns of the history."""
        ...


class Flow(Part, Protocol):
    """The part with the fluid: its domain follows the surfaces, and it exerts a force on them."""

    @property
    def dim(self) -> int: ...

    @property
    def steady(self) -> bool: ...

    @property
    def renewals(self) -> int:
        """Count that grows where its unknowns change, because bodies went to other cells."""
        ...

    timer: Timer
    notes: list[str]  #: notes to the user on this step

    @property
    def times(self) -> int:
        """Largest count of earlier displacements in the difference formulas of its time scheme."""
        ...

    @property
    def difference(self) -> Difference:
        """The formula of the present step, by which surfaces get their velocities."""
        ...

    @property
    def longest_step(self) -> float:
        """[s]; longer ones are divided into parts."""
        ...

    @property
    def far(self) -> bool:
        """Whether a steady flow is too far from the solution for Newton's method."""
        ...

    @property
    def iterative(self) -> IterativeFlow | None:
        """What Krylov methods need to know of it; None: systems with it are solved by their factors."""
        ...

    def predict(self, *, with_pressure: bool = False) -> None:
        """Set the predictor for the end of the step; `retreat` takes it back.

        with_pressure: extrapolate the pressure, too. Not for a flow alone: its tolerance is a share of its first
        residual, which this predictor makes smaller.
        """
        ...

    def outside(self, surfaces: Mapping[str, Motion]) -> set[str]:
        """Names of the surfaces that lie outside of its domain."""
        ...

    def has_films(self) -> bool:
        """Whether the present cut has films thinner than a cell, or bodies touch that may leave one (collective)."""
        ...

    def release(self) -> bool:
        """Let go, at a solution, what it holds to end a cycle of iterates; whether its equations are others now.

        It does so once in a step. What it holds again, by a cycle near the solution, belongs to the solution.
        """
        ...

    def added_product(self) -> Callable[[Array], Array] | None:
        """The part of its derivative that `linearise` lacks, as a product with its unknowns; None: nothing."""
        ...

    def keeps_tangent(self) -> bool:
        """Whether the last tangent may serve for this iterate: it holds the same unknowns (collective)."""
        ...

    def move(self, surfaces: Mapping[str, Motion], *, with_solid: bool = False) -> None:
        """Set the motion of surfaces by name; with_solid: the rows of the solid are solved in the same system."""
        ...

    def squeezed(self) -> Array:
        """Mean distance [m] by which bodies squeeze each closed pocket of fluid in this step, after `solve`."""
        ...

    def add_levels(self, distance: Array) -> None:
        """Raise the pressure of each such pocket, by an amount proportional to a distance [m]."""
        ...

    def force(self) -> dict[str, Array]:
        """Force [N] on the vertices by surface, shape (n, dim)."""
        ...

    def interface_entries(self, surfaces: Sequence[str]) -> InterfaceEntries:
        """Derivatives of its rows and of its force by the motion of these surfaces."""
        ...

    def balances(self) -> tuple[Array, float, float]:
        """(force [N] on all bodies by the balance of momentum, (dim,); power [W] lost by the method; of patches).

        Of the step that has ended.
        """
        ...

    def unsolved(self) -> tuple[float, float]:
        """Sums of |residual|: of the momentum [N] and of the continuity equations [m^3/s]."""
        ...

    def suction(self) -> float:
        """Largest pressure below zero [Pa] around bodies whose closed contact is dry (collective)."""
        ...


class LinearSolvers(Protocol):
    """The linear solvers of a flow, from fast to robust; one that fails is replaced by the next one."""

    @property
    def current(self) -> str:
        """Name of the method: direct for factors, fill for incomplete factors with more fill."""
        ...

    @property
    def multigrid(self) -> bool:
        """Whether the current solver is multigrid."""
        ...

    def limit(self, ksp: PETSc.KSP) -> None:
        """Let a solver give up early if a better one comes next."""
        ...

    def advance(self, failure: LinearSolveFailed) -> None:
        """Change to the next solver for the rest of the run. Raises `failure` if there is none (collective)."""
        ...


class IterativeFlow(Protocol):
    """A flow whose tangent Krylov methods can solve with."""

    @property
    def sequence(self) -> LinearSolvers: ...

    @property
    def linear_tolerance(self) -> float: ...

    def multigrid(self, matrix: PETSc.Mat, product: PETSc.Mat) -> PETSc.PC:
        """A cycle of multigrid for the tangent, which it multiplies by `product`."""
        ...

    def product(self, matrix: PETSc.Mat, reduction: float) -> PETSc.Mat:
        """The tangent as it multiplies vectors in a Krylov method that reduces the residual so far."""
        ...

    def free_levels(self) -> Array | None:
        """Pressure levels that solids alone determine, 1 at their owned unknowns, shape (owned, levels); None: none."""
        ...


class StartOfSolid(Protocol):
    """Start steps of a solid, with the acceleration a = (u - u_n) / dt^2."""

    @property
    def steps(self) -> int:
        """Count of steps after which the acceleration is smooth."""
        ...

    def leave_out(self, names: Collection[str]) -> None:
        """Let bodies outside of the flow start as they would without it."""
        ...

    def velocity(self) -> Array:
        """Velocity [m/s] of all vertices, shape (n, dim)."""
        ...

    def gained(self, t: float, dt: float) -> float:
        """Velocity [m/s] that it gains in the first step, as far as that is known before (collective)."""
        ...

    def acceleration(self) -> float:
        """Largest acceleration without fluid [m/s^2] of the bodies in the flow (collective)."""
        ...

    def step(self, t: float, dt: float) -> AbstractContextManager[None]:
        """Begin a start step of length dt; the caller solves it within the context."""
        ...

    def repeat(self) -> None:
        """Prepare a further start step."""
        ...

    def end(self) -> None:
        """Set the state from the acceleration, the load and the deformation of the start steps."""
        ...

    @property
    def took_impulse(self) -> bool:
        """Whether the last step took the impulse of an impulsive start, by backward Euler."""
        ...

    def strike(self, dt: float) -> None:
        """Prepare a step of length dt [s] in which contact closes."""
        ...

    def begin(self) -> None:
        """Begin a start after such a step."""
        ...

    def take_impulse(self, step: Callable[[], float], *, always: bool) -> bool:
        """Take the impulse of a start; False: in the first steps of the run, True: at once.

        step: solves a start step of the length dt [s] that it returns. The solid then restores its displacement, and
        adds the velocity a dt. always: in the middle of a run.
        """
        ...


class StartOfFlow(Protocol):
    """Start steps of a flow: short steps of backward Euler, each from the initial velocity."""

    share: float  #: length of a start step of the flow over that of the first step of the run

    @property
    def smallest_cell(self) -> float:
        """Shortest edge of a cell [m]."""
        ...

    @property
    def accelerates(self) -> bool:
        """Whether its time scheme uses the acceleration at the start."""
        ...

    def jump(self, surfaces: Mapping[str, Motion], gained: float) -> float:
        """Largest difference [m/s] of boundary and surfaces from the flow at an impulsive start, else 0.0 (collective).

        gained: velocity [m/s] that the solid gains in the first step.
        """
        ...

    def step(self, t: float, short: float, of_solid: float) -> AbstractContextManager[None]:
        """Begin a start step of length `short`, of the solid `of_solid`; the caller solves it within the context."""
        ...

    def end(self, dt: float, before: Sequence[Mapping[str, Motion]]) -> None:
        """Restore the initial velocity, and extrapolate those before it by the rate of the last start step.

        before: motions of coupled surfaces at the times before the start, newest first.
        """
        ...

    def end_impulse(self, dt: float) -> None:
        """Take the velocity of the last start step for the initial one; dt [s]: length of the first step."""
        ...

    @property
    def counts_earlier(self) -> bool:
        """Whether the formulas of the next steps count velocities from before the last."""
        ...

    def forget_earlier(self) -> None:
        """Let the next steps count no velocity from before the last, as those after the initial one."""
        ...

    def forget_step(self) -> None:
        """Let the first step start from the present history."""
        ...


@dataclass(frozen=True)
class Start:
    """The two parts of a start, from which the schemes compute consistent accelerations."""

    flow: StartOfFlow
    solid: StartOfSolid
