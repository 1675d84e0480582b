"""Contact of elastic bodies, the slaves, with free rigid ones, the masters, whose nodes move with six unknowns.

The contact interface has the vertices of a free body as nodes without dofs. Its transformation of rows,
[L (J + S) + A] du = L b + c, acts on the displacements of all nodes. With du = T du' for the elastic nodes and the
rigid unknowns du', and with the forces on rigid nodes as resultants, that of the unknowns is

    L' = 1 + T^T (L - 1) T,    S' = T^T S T,    A' = T^T A T,    c' = T^T c,

because L differs from 1 in columns of slave nodes only, which T leaves as they are.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from solvers.algebra.rows import RowTransformation, TakenRows
from solvers.algebra.sparse import Sparse, diagonal, sparse_from_entries
from solvers.api import Array
from solvers.contact.contact import Contact
from solvers.rigid import surface
from solvers.rigid.field import RigidBodies
from solvers.structure.field import Structure


@dataclass(frozen=True)
class _Master:
    """The nodes of one body."""

    body: int  #: its index
    nodes: NDArray[np.int64]  #: numbers among those of contact
    points: Array  #: at the start [m], shape (n, dim)


class FreeMasters:
    """The free bodies in a contact interface."""

    def __init__(self, contact: Contact, bodies: RigidBodies):
        self.contact, self.bodies = contact, bodies
        numbers = {body.name: index for index, body in enumerate(bodies.bodies)}
        surfaces = zip(contact.interface.surfaces, contact.nodes.of_surface, strict=True)
        self._masters = [
            _Master(numbers[one.name], nodes, one.points)
            for one, nodes in surfaces
            if one.dofs is None and one.name in numbers
        ]
        dim, kept = contact.dim, np.ones(contact.size)
        for master in self._masters:
            kept[master.nodes] = 0.0
        self._kept = kept.repeat(dim)

    @property
    def any(self) -> bool:
        """Whether there are any."""
        return bool(self._masters)

    def press(self, weight: float) -> None:
        """Give the bodies the present contact forces; weight: that of the forces in the balance of the elastic ones."""
        if not self.contact.near:
            self.bodies.press([], weight)
            return
        force = self.contact.force()
        self.bodies.press([(master.body, master.points, force[master.nodes]) for master in self._masters], weight)

    def linked(self, structure: Structure) -> list[tuple[int, int]]:
        """(elastic piece, body) of those that are opposite each other, each several times (collective)."""
        slave, master = self.contact.linked()
        piece = structure.at_constraint(structure.pieces.of_dofs.astype(float))[slave, 0].astype(np.int64)
        pieces = [(one.body, piece[np.isin(master, one.nodes)]) for one in self._masters]
        return [(number, body) for body, numbers in pieces for number in np.unique(numbers).tolist()]

    def jacobian(self) -> Sparse:
        """T, shape (n, n + unknowns of all bodies): columns of the nodes of free bodies are empty."""
        n, dim, bodies = len(self._kept), self.contact.dim, self.bodies
        rows, columns, values = (
            [np.flatnonzero(self._kept)],
            [np.flatnonzero(self._kept)],
            [np.ones(int(self._kept.sum()))],
        )
        for master in self._masters:
            body, now = bodies.bodies[master.body], bodies.now[master.body]
            moved = replace(body, points=master.points, facets=body.facets[:0])
            own = surface.jacobian([moved], [now], bodies.components)
            count = own.columns.shape[1]
            dofs = (dim * master.nodes[:, None] + np.arange(dim)).ravel()
            rows.append(np.repeat(dofs, count))
            columns.append((n + master.body * len(bodies.components) + own.columns).ravel())
            values.append(own.values.ravel())
        shape = n, n + bodies.unknowns
        return sparse_from_entries(np.concatenate(rows), np.concatenate(columns), np.concatenate(values), shape)

    def transformation(self, change: RowTransformation) -> RowTransformation:
        """The transformation of the unknowns, from that of the nodes."""
        T, more = self.jacobian(), self.bodies.unknowns
        back = T.T
        ones = diagonal(np.ones(len(self._kept)))
        return RowTransformation(
            dofs=np.concatenate([change.dofs, self.bodies.first + np.arange(more)]),
            rows=diagonal(np.ones(len(self._kept) + more)) + back @ ((change.rows - ones) @ T),
            stiffness=back @ (change.stiffness @ T),
            added=back @ (change.added @ T),
            right=back @ change.right,
            replaced=np.concatenate([change.replaced, np.zeros(more, dtype=bool)]),
        )

    def recover(self, taken: TakenRows, du: Array) -> None:
        """Compute the multipliers from the rows before the transformation and the increment of all unknowns."""
        n, first = len(self._kept), self.bodies.first
        dofs = self.contact.dofs().ravel()
        own = np.where(dofs >= 0, du[np.maximum(dofs, 0)], 0.0)
        unknowns = np.concatenate([own, du[first : first + self.bodies.unknowns]])
        self.contact.recover(taken.balance(du, n), self.jacobian() @ unknowns)
