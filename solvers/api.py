"""What the parts exchange: the dataclasses and protocols at the boundaries between fields, schemes and the driver."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Everything needed to continue: nested names, arrays in global (partition-independent) order on rank 0, numbers, text.
State = dict[str, Any]


@dataclass(frozen=True)
class StepInfo:
    """What one accepted time step took."""

    iterations: int  #: Newton steps or coupling iterations
    residuals: tuple[float, ...]  #: residual norm seen by each iteration, first to last
    numbers: Mapping[str, float] = field(default_factory=dict)  #: more columns for history.csv
    notes: tuple[str, ...] = ()  #: what the user should know


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
    """A time step has no solution: names the field, the reason, the iteration and the place, and keeps the history.

    `where` is a point [m] (worst residual, inverted element, ...) or None; `history` the residual norms so far.
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
    """Has state that a checkpoint keeps; restore(save()) changes nothing, bit for bit. Collective calls."""

    def save(self) -> State: ...
    def restore(self, state: State) -> None: ...


class Scheme(Stateful, Protocol):
    """Takes one time step from t to t + dt for everything the case contains; raises StepFailed.

    A field alone is one.
    """

    def step(self, t: float, dt: float) -> StepInfo: ...
