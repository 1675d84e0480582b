"""Constraints on a field's unknowns whose multipliers are eliminated: contact."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array, Stateful
from solvers.rows import RowTransformation


class Constraint(Stateful, Protocol):
    """Something that couples nodes of a field through multipliers, which it eliminates: contact.

    Arrays over its nodes have the shape (N, dim) and are the same on every process. Calls are collective.
    """

    @property
    def near(self) -> bool:
        """Some constraint may be active at the latest `evaluate`."""
        ...

    @property
    def settled(self) -> bool:
        """The latest `evaluate` changed no active set."""
        ...

    def dofs(self) -> NDArray[np.int64]:
        """Global dofs of its nodes, -1 where there are none, shape (N, dim)."""
        ...

    def touching_dofs(self) -> NDArray[np.int64]:
        """Global dofs of the nodes of surfaces that come and go, each once."""
        ...

    def multiplier_dofs(self) -> NDArray[np.int64]:
        """Those of them that carry multipliers."""
        ...

    def start(self, u: Array, stiffness: Array, t: float) -> None:
        """Take the displacements [m] at the start and the diagonal of the stiffness [N/m]."""
        ...

    def begin_step(self) -> None: ...

    def end_step(self, weight: float) -> None:
        """Accept the step; weight: of the new force in the balance."""
        ...

    @property
    def friction_work(self) -> float:
        """What friction has dissipated so far [J]."""
        ...

    def evaluate(self, u: Array, t: float) -> None:
        """Everything at the displacements of the present iterate."""
        ...

    def force(self) -> Array:
        """Force [N] on its nodes for the present multipliers."""
        ...

    def violation(self, weight: float) -> float:
        """Norm [N] of the residual of the constraints."""
        ...

    def condense(self, weight: float) -> RowTransformation:
        """Elimination of the multipliers from the linearised balance without `force`, which has a weight in it."""
        ...

    def recover(self, balance: Array, du: Array) -> None:
        """Multipliers from that balance (of replaced rows) and the increment [m] at the dofs, shapes (N * dim,)."""
        ...

    def active(self) -> NDArray[np.bool_]:
        """Which multipliers are in contact."""
        ...

    def numbers(self) -> dict[str, float]:
        """Columns for the history."""
        ...
