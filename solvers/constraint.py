"""The interface `Constraint`: conditions on a field whose multipliers are eliminated, such as contact."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from solvers.algebra.rows import RowTransformation
from solvers.api import Array, Stateful


class Constraint(Stateful, Protocol):
    """Conditions that couple nodes of a field by multipliers, which are eliminated.

    Arrays over its nodes have the shape (N, dim) and are the same on every process. All calls are collective.
    """

    @property
    def near(self) -> bool:
        """Whether some condition may be active at the latest `evaluate`."""
        ...

    @property
    def settled(self) -> bool:
        """Whether the latest `evaluate` left the active set unchanged, or returned to an earlier one."""
        ...

    @property
    def acts(self) -> bool:
        """Whether conditions are active at the latest iterate, or forces of those that were are not yet zero."""
        ...

    def cycle(self) -> str:
        """What cycles, for messages: an active set that has come back to an earlier one of this step; else empty."""
        ...

    def cycling(self) -> NDArray[np.bool_]:
        """Mask of the nodes whose conditions cycle, shape (N,)."""
        ...

    def linked(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Pairs of nodes that conditions are between at the latest `evaluate`: numbers of either side."""
        ...

    #: mask of the groups of conditions, as contact pairs, whose surfaces have no mass in dynamics
    present: NDArray[np.bool_]

    def find_present(self, u: Array, v: Array, t: float, dt: float) -> NDArray[np.bool_]:
        """The groups that may be active in the step from t to t + dt [s].

        u, v: displacements [m] and velocities [m/s] of the deformable nodes, shape (N, dim).
        """
        ...

    def approaching_dofs(self, u: Array, v: Array, t: float, dt: float) -> NDArray[np.int64]:
        """Global dofs of the nodes that their velocities could make active in this step; arguments as above."""
        ...

    def largest_traction(self) -> float:
        """Largest force per area [Pa] of the conditions that can open."""
        ...

    def dofs(self) -> NDArray[np.int64]:
        """Global dofs of its nodes, -1 where there are none, shape (N, dim)."""
        ...

    def touching_dofs(self) -> NDArray[np.int64]:
        """Global dofs of the nodes of surfaces that are not tied, each once."""
        ...

    def multiplier_dofs(self) -> NDArray[np.int64]:
        """Global dofs of those of these nodes that have multipliers."""
        ...

    def start(self, u: Array, stiffness: Array, t: float) -> None:
        """Set the displacements at the start [m] and what resists a contact [N/m], both of shape (N, dim)."""
        ...

    def take_pieces(self, pieces: NDArray[np.int64]) -> None:
        """Set the piece of a body that each node belongs to, -1 where rigid, shape (N,)."""
        ...

    def begin_step(self) -> None: ...
    def begin_solve(self) -> None: ...

    def end_step(self, weight: float) -> None:
        """Accept the step; weight: that of the force at its end in the balance."""
        ...

    @property
    def friction_work(self) -> float:
        """Energy that friction has dissipated since the start [J]."""
        ...

    @property
    def obstacle_work(self) -> Array:
        """(work of moved obstacles on the bodies since the start, by how much it may be wrong) [J]."""
        ...

    def evaluate(self, u: Array, t: float) -> None:
        """Compute gaps and active set at the displacements u [m] of an iterate, shape (N, dim), and the time t [s]."""
        ...

    def force(self) -> Array:
        """Force [N] on its nodes for the present multipliers."""
        ...

    def violation(self, weight: float) -> Array:
        """Norm [N] of the residual of the conditions at each node, shape (N,)."""
        ...

    def rounding(self, weight: float) -> tuple[Array, Array]:
        """Rounding errors [N] of its force in the balance, shape (N, dim), and of `violation`, shape (N,)."""
        ...

    def condense(self, weight: float) -> RowTransformation:
        """The transformation that eliminates the multipliers from the linearised balance without `force`."""
        ...

    def recover(self, balance: Array, du: Array) -> None:
        """Compute the multipliers from the linearised balance [N] and the increment [m] at the dofs, (N * dim,)."""
        ...

    def retreat(self, fraction: Array) -> None:
        """Take back fractions of the last increment of the multipliers, by node, shape (N,)."""
        ...

    def active(self) -> NDArray[np.bool_]:
        """Mask of the multipliers in contact."""
        ...

    def numbers(self) -> dict[str, float]:
        """Columns for the history."""
        ...
