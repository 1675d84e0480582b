"""Dataclasses and protocols that fields, schemes and the run loop share."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: A state to continue from: nested names, with arrays in an order that does not depend on the partition, numbers, text.
State = dict[str, Any]


@dataclass(frozen=True)
class StepInfo:
    """Iterations, residuals and notes of one accepted time step."""

    iterations: int  #: iterations of Newton's method or of the coupling
    residuals: tuple[float, ...]  #: residual norm of each iteration, first to last
    numbers: Mapping[str, float] = field(default_factory=dict)  #: further columns for history.csv
    notes: tuple[str, ...] = ()  #: notes to the user


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
    norms so far.
    """

    def __init__(
        self,
        field: str,
        reason: str,
        *,
        iteration: int = 0,
        where: tuple[float, ...] | None = None,
        history: tuple[float, ...] = (),
    ):
        place = "" if where is None else " near (" + ", ".join(f"{c:.6g}" for c in where) + ")"
        super().__init__(f"{field}: {reason} at iteration {iteration}{place}")
        self.field, self.reason, self.iteration, self.where, self.history = (
            field,
            reason,
            iteration,
            where,
            history,
        )


class Stateful(Protocol):
    """An object with state for checkpoints; restore(save()) changes nothing, bit for bit. Calls are collective."""

    def save(self) -> State: ...
    def restore(self, state: State) -> None: ...


class Scheme(Stateful, Protocol):
    """Takes one time step from t to t + dt for all fields of a case; raises StepFailed. A single field is a scheme."""

    def step(self, t: float, dt: float) -> StepInfo: ...
