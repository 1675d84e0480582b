"""What a change of cells, within a run or by a restart, needs of a flow."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Protocol

from mpi4py import MPI

from solvers.api import Array
from solvers.fluid.background.box import Grid
from solvers.fluid.background.following import Following
from solvers.fluid.background.grid import DistributedGrid
from solvers.fluid.background.space import Unknowns
from solvers.fluid.bodies.immersed import ImmersedBody
from solvers.fluid.bodies.surface import Motion
from solvers.fluid.bodies.sweep import Sweep
from solvers.fluid.cutting.cut import Cutter
from solvers.fluid.flow_settings import FlowSettings
from solvers.fluid.history import History
from solvers.fluid.linear_systems.krylov import FlowSolver, SolverSequence
from solvers.fluid.system import FlowSystem
from solvers.fluid.thin.sheets import Sheets
from solvers.fluid.thin.thin_bodies import Began, ThinBodies
from solvers.fluid.time_scheme import FlowStep


class ExchangedFlow(Protocol):
    """A flow whose grid, unknowns and equations are replaced by others; `Fluid` is one."""

    comm: MPI.Comm
    dim: int
    settings: FlowSettings
    bodies: list[ImmersedBody]
    motions: list[Motion]
    box: Grid
    grid: DistributedGrid
    unknowns: Unknowns
    system: FlowSystem
    cutter: Cutter
    history: History
    sequence: SolverSequence
    linear_solver: FlowSolver
    thin: ThinBodies
    sweep: Sweep
    following: Following | None
    current: FlowStep
    began: Began | None
    prescribed_at: float
    smallest_cell: float
    residual_rows: Array
    before: Array
    increment: Array

    @property
    def flow(self) -> Array: ...

    def moved(self) -> Iterator[tuple[ImmersedBody, Motion]]: ...

    def discretise(self, sheets: Sheets | None) -> None: ...

    def begin_system(self, step: FlowStep) -> None: ...

    def prescribe(self, t: float) -> None: ...

    def move(self, coupled: Mapping[str, Motion]) -> None: ...

    def residual(self) -> Array: ...

    def advance(self) -> Array: ...

    def forget_step(self) -> None: ...
