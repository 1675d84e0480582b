"""The nodes of a constraint among the dofs of a structure."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from solvers.algebra.blocks import Layout
from solvers.algebra.rows import TakenRows, gather_at
from solvers.api import Array
from solvers.constraint import Constraint
from solvers.structure.body_pieces import BodyPieces


class ConstrainedDofs:
    """Moves values between the owned dofs of a structure and the nodes of its constraint, (N, dim) on all processes."""

    def __init__(self, layout: Layout, constraint: Constraint, pieces: BodyPieces):
        self._layout, self._constraint = layout, constraint
        #: piece of each node, 0 for rigid ones, shape (N,)
        self.pieces = self.at_nodes(pieces.of_dofs.astype(float))[:, 0].astype(np.int64)

    def at_nodes(self, owned: Array) -> Array:
        """Values at the nodes, shape (N, dim), from those at owned dofs (collective)."""
        return gather_at(self._layout.comm, owned, self._layout.start, self._constraint.dofs())

    def force(self) -> Array:
        """Force [N] of the constraint at owned dofs; zero if it is not near."""
        return self.at_owned(self._constraint.force()) if self._constraint.near else np.zeros(self._layout.size)

    def at_owned(self, at_nodes: Array) -> Array:
        """Values at owned dofs from those at the nodes, shape (N, dim); zero elsewhere."""
        found = np.zeros(self._layout.size)
        mine, numbers = self._layout.among_owned(self._constraint.dofs())
        found[numbers] = at_nodes[mine]
        return found

    def touched(self, pieces: Sequence[NDArray[np.bool_]]) -> int:
        """In how many of the masks of pieces, (count,), there is one that the constraint exerts a force on."""
        if not pieces:
            return 0
        on = self.pieces[self._constraint.force().any(axis=1)]
        return sum(bool(mask[on].any()) for mask in pieces)

    def recover(self, taken: TakenRows, du: Array) -> None:
        """Compute the multipliers from the rows before the transformation and the increment of all unknowns."""
        dofs = self._constraint.dofs().ravel()
        at_nodes = np.where(dofs >= 0, du[np.maximum(dofs, 0)], 0.0)
        self._constraint.recover(taken.balance(du, len(dofs)), at_nodes)
