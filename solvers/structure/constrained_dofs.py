"""The nodes of a constraint among the dofs of a structure."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from solvers.algebra.blocks import Layout
from solvers.algebra.rows import TakenRows, gather_at
from solvers.api import Array, Indices
from solvers.constraint import Constraint
from solvers.structure.body_pieces import BodyPieces


class ConstrainedDofs:
    """Moves values between the owned dofs of a structure and the nodes of its constraint, (N, dim) on all processes."""

    def __init__(self, layout: Layout, constraint: Constraint, pieces: BodyPieces):
        self._layout, self._constraint, self._count = layout, constraint, pieces.count
        #: piece of each node, 0 for rigid ones, shape (N,)
        self._pieces = self.at_nodes(pieces.of_dofs.astype(float))[:, 0].astype(np.int64)
        self._moves = constraint.dofs()[:, 0] >= 0  # mask of the nodes that are not rigid
        constraint.take_pieces(np.where(self._moves, self._pieces, -1))

    @property
    def near(self) -> bool:
        """Whether some condition may be active."""
        return self._constraint.near

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

    def _with(self, nodes: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Mask of the pieces that have some of the nodes in a mask, (N,)."""
        return np.bincount(self._pieces[nodes & self._moves], minlength=self._count) > 0

    def missed(self, weight: float) -> Array | None:
        """Square of the residual of the conditions by piece [N^2]; None if none are near."""
        if not self.near:
            return None
        return np.bincount(self._pieces, self._constraint.violation(weight) ** 2, self._count).astype(float)

    def rounding(self, weight: float, *, times: float) -> tuple[Array, NDArray[np.bool_]]:
        """Rounding errors [N] of the force at owned dofs, and whether a piece misses conditions by no more than them.

        times: factor of the errors.
        """
        of_force, of_conditions = self._constraint.rounding(weight)
        missed = self._constraint.violation(weight) > times * of_conditions
        return times * self.at_owned(of_force), ~self._with(missed)

    def linked(self) -> tuple[Indices, Indices]:
        """Pairs of pieces that conditions are between, each several times."""
        first, second = self._constraint.linked()
        both = self._moves[first] & self._moves[second]
        return self._pieces[first[both]], self._pieces[second[both]]

    def astray(self, risen: Sequence[NDArray[np.bool_]]) -> NDArray[np.bool_]:
        """Mask of the pieces of nodes that cycle, and of those under its force that are in two of the masks `risen`."""
        if not self.near:
            return np.zeros(self._count, dtype=bool)
        pressed = self._with(self._constraint.force().any(axis=1))
        return self._with(self._constraint.cycling()) | (pressed & (np.sum(risen, axis=0) > 1))

    def cycle(self) -> str:
        """What cycles, for messages; empty if nothing does."""
        return self._constraint.cycle() if self.near else ""

    def retreat(self, fraction: Array) -> None:
        """Take back fractions of the last increment of the multipliers, by piece."""
        self._constraint.retreat(fraction[self._pieces])

    def recover(self, taken: TakenRows, du: Array) -> None:
        """Compute the multipliers from the rows before the transformation and the increment of all unknowns."""
        dofs = self._constraint.dofs().ravel()
        at_nodes = np.where(dofs >= 0, du[np.maximum(dofs, 0)], 0.0)
        self._constraint.recover(taken.balance(du, len(dofs)), at_nodes)
