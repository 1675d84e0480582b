"""The connected pieces of bodies, each of which has to be in equilibrium on its own.

Newton's method compares the residual of each piece with the forces on this piece. With one norm over all bodies, forces
on a soft body would be lost in the tolerance, or in the rounding errors, of a stiff one.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from solvers.algebra.connected import connected_parts
from solvers.api import Array, Indices
from solvers.mesh.mesh import Mesh
from solvers.structure.body import Body


class BodyPieces:
    """The pieces of all bodies, numbered body by body."""

    def __init__(self, comm: MPI.Comm, bodies: Sequence[Body]):
        self._comm, self._dim = comm, bodies[0].dim
        found = [_pieces_of_nodes(body) for body in bodies]
        first = np.cumsum([0, *(count for count, _ in found)])
        self.count = int(first[-1])
        #: number of the piece of each owned node and of each owned dof
        self.of_nodes = np.concatenate([start + own for start, (_, own) in zip(first, found, strict=False)])
        self.of_dofs = np.repeat(self.of_nodes, self._dim)

    def norms(self, arrays: Sequence[Array], other: Array | None = None) -> Array:
        """Norm of each array of owned dofs over each piece, shape (arrays, pieces) (collective).

        other: the square of a norm to be added to all of them, by piece, the same on every process.
        """
        if self.count == 1:
            squares = np.array([[array @ array] for array in arrays])
        else:
            with np.errstate(over="ignore"):  # an iterate that has blown up has an infinite norm
                squares = np.stack([np.bincount(self.of_dofs, array * array, self.count) for array in arrays])
        total = self._sum(squares)
        return np.sqrt(total if other is None else total + other)

    def _sum(self, values: NDArray) -> NDArray:
        """The sum over all processes."""
        return values if self._comm.size == 1 else self._comm.allreduce(values)

    def linked(self, pairs: Sequence[tuple[Indices, Indices]]) -> Indices:
        """For each piece, the smallest number of those that pairs of numbers lead to from it."""
        none = np.empty(0, dtype=np.int64)
        first, second = (np.concatenate([none, *(pair[side] for pair in pairs)]) for side in (0, 1))
        return connected_parts(first, second, self.count)

    def below(self, array: Array, bound: Array) -> NDArray[np.bool_]:
        """Whether the vector at each owned node of a piece is at most as long as another one, by piece (collective).

        array, bound: at owned dofs. Vectors of nodes, because components along the axes mean nothing to oblique rows.
        """
        with np.errstate(over="ignore"):
            size, most = (np.add.reduce((a * a).reshape(-1, self._dim), axis=1) for a in (array, bound))
        failed = ~(size <= most)
        return self._sum(np.bincount(self.of_nodes, failed, self.count)) == 0.0


def _pieces_of_nodes(body: Body) -> tuple[int, NDArray[np.int64]]:
    """(count of pieces of a body, number of the piece of each owned node) (collective)."""
    domain = body.domain
    pieces = domain.comm.bcast(None if domain.source is None else _pieces_of_mesh(domain.source), root=0)
    if pieces is None:
        return 1, np.zeros(body.owned, dtype=np.int64)
    return int(pieces.max()) + 1, pieces[body.nodes[: body.owned]]


def _pieces_of_mesh(mesh: Mesh) -> NDArray[np.int64] | None:
    """Number of the piece of each node of a mesh, shape (nodes,); None if it has one piece."""
    cells, n = mesh.cells, len(mesh.points)
    label = connected_parts(np.repeat(cells[:, 0], cells.shape[1] - 1), cells[:, 1:].ravel(), n)
    used = np.unique(cells)
    number, of_used = np.unique(label[used], return_inverse=True)
    if len(number) == 1:
        return None
    found = np.zeros(n, dtype=np.int64)
    found[used] = of_used.ravel()
    return found
