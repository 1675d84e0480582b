"""Dataclasses and protocols that fields, schemes and the run loop share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: A state to continue from: nested names, with arrays in an order that does not depend on the partition, numbers, text.
State = dict[str, Any]


#: What helps against a result that means nothing: a smaller step may, or cannot; empty: the result has a meaning.
Helps = Literal["", "repeat", "end"]


@dataclass(frozen=True)
class Finding:
    """Something that cannot be right in the state at the end of a step."""

    kind: str  #: one word: overlap, passage, pocket, mass, ...
    body: str  #: name of the body, pocket or field
    value: float  #: how large it is, in the unit that the message has
    message: str  #: what is wrong, where, and what helps
    #: not empty: the state means nothing, so the step fails
    worthless: Helps = ""
    where: tuple[float, ...] | None = None  #: a point [m]


@dataclass(frozen=True)
class StepInfo:
    """Iterations, residuals and notes of one accepted time step."""

    iterations: int  #: iterations of Newton's method or of the coupling
    residuals: tuple[float, ...]  #: residual norm of each iteration, first to last
    numbers: Mapping[str, float] = field(default_factory=dict)  #: further columns for history.csv
    notes: tuple[str, ...] = ()  #: notes to the user
    findings: tuple[Finding, ...] = ()  #: of sentinels


@dataclass(frozen=True)
class Snapshot:
    """The fields of one body at one time, gathered on rank 0 (other ranks get None instead)."""

    name: str  #: body name
    points: Array  #: current (displaced) node positions, shape (n, 3)
    cells: NDArray[np.int64]  #: node indices in VTK order, shape (cells, nodes per cell)
    cell_type: (
        str  #: meshio name: triangle, triangle6, quad, quad9, tetra, tetra10, hexahedron, hexahedron27, line, ...
    )
    point_data: Mapping[str, Array]  #: name -> (n,) or (n, 3)
    cell_data: Mapping[str, Array] = field(default_factory=dict)  #: name -> (cells,) or (cells, 3)


class StepFailed(Exception):
    """A time step without a solution: field, reason, iteration, position and residuals.

    where: a point [m], such as that of the largest residual or of an inverted element, or None; history: the residual
    norms so far; finding: that of the sentinel which rejected the solution.
    """

    def __init__(
        self,
        field: str,
        reason: str,
        *,
        iteration: int = 0,
        where: tuple[float, ...] | None = None,
        history: tuple[float, ...] = (),
        finding: Finding | None = None,
    ):
        place = "" if where is None else " near (" + ", ".join(f"{c:.6g}" for c in where) + ")"
        super().__init__(f"{field}: {reason}" if finding else f"{field}: {reason} at iteration {iteration}{place}")
        self.field, self.reason, self.iteration, self.where, self.history = (
            field,
            reason,
            iteration,
            where,
            history,
        )
        self.finding = finding

    def with_reason(self, reason: str) -> StepFailed:
        """The same failure with another reason."""
        return type(self)(
            self.field, reason, iteration=self.iteration, where=self.where, history=self.history, finding=self.finding
        )

    @property
    def hopeless(self) -> bool:
        """Whether a smaller step cannot help."""
        return self.finding is not None and self.finding.worthless == "end"


class NoResidual(StepFailed):
    """An iterate has none: elements are inverted, or surfaces are farther away than the flow can follow in a step."""


class Stateful(Protocol):
    """An object with state for checkpoints; restore(save()) changes nothing, bit for bit. Calls are collective."""

    def save(self) -> State: ...
    def restore(self, state: State) -> None: ...


class Scheme(Stateful, Protocol):
    """Takes one time step from t to t + dt for all fields of a case; raises StepFailed. A single field is a scheme."""

    def step(self, t: float, dt: float) -> StepInfo: ...


class Sentinel(Stateful, Protocol):
    """Looks at the state at the end of each step for what no residual tells."""

    def start(self, t: float) -> None:
        """Keep what it needs of the initial state at t [s]."""
        ...

    def look(self, t: float, dt: float) -> Sequence[Finding]:
        """What is wrong at the end t [s] of a step of length dt [s]: the same on every process."""
        ...
