"""Dataclasses and protocols that fields, schemes and the run loop share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Indices32 = NDArray[np.int32]
Mask = NDArray[np.bool_]

#: Rounding error of a number in double precision, relative to it.
EPS = float(np.finfo(float).eps)

#: A state to continue from: nested names, with arrays in an order that does not depend on the partition, numbers, text.
State = dict[str, Any]


class FailureKind(Enum):
    """The cause of a step without a solution: what a user can do about it depends on this alone."""

    NOT_FINITE = "not finite"  #: a residual, a force, a motion or a position is not a number
    NEWTON = "newton"  #: Newton's method does not converge, for none of the causes below
    COUPLING = "coupling"  #: the iteration between fields does not converge
    ACTIVE_SET = "active set"  #: contact opens and closes from iterate to iterate
    SUCTION = "suction"  #: contact under suction has no state, open or closed
    LIMIT_POINT = "limit point"  #: statics beyond the last equilibrium
    UNSUPPORTED = "unsupported"  #: bodies without supports: a singular system, or displacements without bound
    INVERTED = "inverted"  #: an element is inside out
    LINEAR_SOLVER = "linear solver"  #: an iterative linear solver stalls
    MOTION = "motion"  #: a body moves or turns too far in one step
    DIVERGED = "diverged"  #: an iterate has a body where its motion does not bring it
    COARSE_CELLS = "coarse cells"  #: a body is close to cells that are not of the finest level
    PERIODIC_FACES = "periodic faces"  #: a body reaches the end of the period
    NO_ROOM = "no room"  #: no motion of rigid bodies opens all of their overlaps
    JAMMED = "jammed"  #: friction of rigid bodies that no contact forces fulfil
    PASSAGE = "passage"  #: a sentinel: a body has leapt or passed through another one, in too long a step
    NOT_HELD = "not held"  #: a sentinel: nothing holds a body where it has passed


@dataclass(frozen=True)
class Finding:
    """Something that cannot be right in the state at the end of a step."""

    kind: str  #: one word: overlap, passage, pocket, mass, ...
    body: str  #: name of the body, pocket or field
    value: float  #: how large it is, in the unit that the message has
    message: str  #: what is wrong, where, and what helps
    worthless: FailureKind | None = None  #: the state means nothing, so the step fails for this
    where: tuple[float, ...] | None = None  #: a point [m]
    ends_run: bool = False  #: the run is to end after this step


@dataclass(frozen=True)
class Step:
    """The time step from t - dt to t."""

    t: float  #: its end [s]
    dt: float  #: its length [s]


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
    """A time step without a solution: field, kind of failure, reason, iteration, position and residuals.

    reason: for the user; nothing depends on its words. where: a point [m], such as that of the largest residual or of
    an inverted element, or None; history: the residual norms so far; finding: that of the sentinel which rejected the
    solution.
    """

    def __init__(
        self,
        field: str,
        kind: FailureKind,
        reason: str,
        *,
        iteration: int = 0,
        where: tuple[float, ...] | None = None,
        history: tuple[float, ...] = (),
        finding: Finding | None = None,
    ):
        place = "" if where is None else " near (" + ", ".join(f"{c:.6g}" for c in where) + ")"
        super().__init__(f"{field}: {reason}" if finding else f"{field}: {reason} at iteration {iteration}{place}")
        self.field, self.kind, self.reason = field, kind, reason
        self.iteration, self.where, self.history, self.finding = iteration, where, history, finding

    def with_reason(self, reason: str, kind: FailureKind | None = None) -> StepFailed:
        """The same failure with another reason, and another kind if one is given."""
        same = {name: getattr(self, name) for name in ("iteration", "where", "history", "finding")}
        return type(self)(self.field, kind or self.kind, reason, **same)

    @property
    def hopeless(self) -> bool:
        """Whether a smaller step cannot help."""
        return self.kind is FailureKind.NOT_HELD


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
