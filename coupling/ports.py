"""The protocols that coupling needs: of a solid and of a flow.

Each has unknowns of its own, distributed over the processes, and its surfaces consist of vertices that all processes
know. The solid says where they are, the flow which force [N] it exerts on them. All calls are collective.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from solvers.api import Array, Stateful, StepInfo
from solvers.fluid.coupling_entries import InterfaceEntries
from solvers.fluid.krylov import SolverSequence
from solvers.fluid.surface import Motion
from solvers.fluid.time_scheme import FlowStep, FlowTimeScheme
from solvers.newton import System
from solvers.rows import RowTransformation, TakenRows
from solvers.timing import Timer
from solvers.vertices import VertexJacobian


class Part(System, Stateful, Protocol):
    """One block of the coupled system: it can be solved alone, or give its rows to a larger system.

    Arrays have the shape (size,): the unknowns that this process owns.
    """

    @property
    def size(self) -> int:
        """Unknowns that this process owns."""
        ...

    def initialise(self, t: float, dt: float) -> None:
        """The state at the first time; dt: length of the first step."""
        ...

    def begin_step(self, t: float, dt: float) -> None: ...
    def solve(self) -> StepInfo:
        """Solve it alone, with the data of the other part fixed. Raises StepFailed."""
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

    def update(self, increment: Array) -> float:
        """Add an increment; its size relative to the solution."""
        ...

    def rounded(self) -> Array:
        """Values whose last digit is lost where the residual is evaluated, for `rounding_error`."""
        ...

    def add_rounding(self, error: Array) -> None:
        """Rounding errors that the other part brings into the residual, after `linearise`."""
        ...


class Solid(Part, Protocol):
    """It moves its surfaces and takes a load on them. What is in contact is condensed by a transformation of its rows.

    Its forces by unknowns are equal on all processes where the shape is (m,): one for each way that a load can act.
    """

    @property
    def comm(self) -> MPI.Comm: ...

    @property
    def surfaces(self) -> Mapping[str, Array]:
        """Name of a surface in the flow -> reference positions [m] of its vertices, shape (n, dim)."""
        ...

    @property
    def force_weight(self) -> float:
        """Weight of the load at the end of the step in its balance; that at the start has the rest."""
        ...

    def predict(self, t: float) -> None:
        """The predictor for the time t."""
        ...

    def displacement(self) -> Array:
        """Displacement [m] of all vertices, those of one surface after those of the other, shape (n, dim)."""
        ...

    def jacobian(self) -> VertexJacobian:
        """The derivative of that by its unknowns."""
        ...

    def load(self, force: Array) -> None:
        """Take the force [N] on all vertices at the end of the step, shape (n, dim)."""
        ...

    def reduced(self, force: Array) -> Array:
        """What forces [N] on the vertices, shape (n, dim), do to it as it is now, shape (m,)."""
        ...

    def taken(self) -> Array:
        """The load that follows from its balance of the last step, computed without that of `load`, shape (m,)."""
        ...

    def taken_at_start(self) -> Array:
        """The same for the state that the first step starts from."""
        ...

    def moved(self) -> Array:
        """Its displacement in the last step, with which `taken` does work, shape (m,)."""
        ...

    def row_transformation(self) -> RowTransformation | None:
        """The transformation of its rows that eliminates contact multipliers; None if no surfaces are near."""
        ...

    def recover(self, taken: TakenRows, du: Array) -> None:
        """The multipliers from rows as they were before, and the increment of all unknowns of the system."""
        ...

    def missing(self) -> Array:
        """Prescribed less present values of its unknowns, zero at free ones."""
        ...

    def impose_rows(self, blocks: Sequence[PETSc.Mat], x: Array, b: Array) -> list[PETSc.Mat]:
        """Rows of its supports ask for x; of the blocks beside each other the first is its own. b changes."""
        ...

    def check(self, info: StepInfo) -> None:
        """Raise StepFailed for an inadmissible solution."""
        ...

    def touching(self) -> NDArray[np.bool_] | None:
        """Which multipliers are in contact; None without contact."""
        ...

    def numbers(self) -> dict[str, float]:
        """Columns of the history."""
        ...


class Flow(Part, Protocol):
    """It follows surfaces and exerts a force on them."""

    @property
    def dim(self) -> int: ...

    @property
    def steady(self) -> bool: ...

    timer: Timer
    notes: list[str]  #: what the user should know of this step

    @property
    def scheme(self) -> FlowTimeScheme:
        """How it takes derivatives in time."""
        ...

    current: FlowStep  #: the step that it computes, with the rule for derivatives in time

    def predict(self) -> None:
        """The predictor for the end of the step."""
        ...

    def move(self, surfaces: Mapping[str, Motion], *, with_solid: bool = False) -> None:
        """Surfaces by name are here and move so; with_solid: the solid's rows are solved with its own."""
        ...

    def force(self) -> dict[str, Array]:
        """Force [N] on the vertices by surface, shape (n, dim)."""
        ...

    def interface_entries(self, surfaces: Sequence[str]) -> InterfaceEntries:
        """How its rows and its force change with the motion of these surfaces."""
        ...

    def balances(self) -> tuple[Array, float]:
        """Force [N] on all bodies by its momentum, shape (dim,), and power [W] that the method takes."""
        ...

    sequence: SolverSequence  #: which linear solver is used, from fast to safe

    @property
    def linear_tolerance(self) -> float: ...

    def set_up_multigrid(self, preconditioner: PETSc.PC, matrix: PETSc.Mat) -> None: ...


class StartOfSolid(Protocol):
    """Steps of a solid to the first time, with a = (u - u_n) / dt^2."""

    @property
    def steps(self) -> int:
        """How many it takes until the acceleration is smooth."""
        ...

    def velocity(self) -> Array:
        """Velocity [m/s] of all vertices, shape (n, dim)."""
        ...

    def acceleration(self) -> float:
        """The largest [m/s^2] without fluid (collective)."""
        ...

    def step(self, t: float, dt: float) -> AbstractContextManager[None]:
        """One of length dt, begun here and solved by who asks for it."""
        ...

    def end(self) -> None:
        """Take acceleration and load of the last of these steps, and the deformation that they made."""
        ...


class StartOfFlow(Protocol):
    """The same of a flow: short steps of backward Euler, each from the initial velocity."""

    @property
    def smallest_cell(self) -> float:
        """Shortest edge [m]."""
        ...

    def at_once(self, surfaces: Mapping[str, Motion]) -> bool:
        """The initial velocity is not that of the boundary, or of surfaces by name (collective)."""
        ...

    def step(self, t: float, dt: float) -> AbstractContextManager[None]: ...

    def end(self, dt: float) -> None:
        """Back to the initial velocity; those before it follow from the rate of the last of these steps."""
        ...


@dataclass(frozen=True)
class Start:
    """How both find accelerations that belong together."""

    flow: StartOfFlow
    solid: StartOfSolid
