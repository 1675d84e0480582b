"""Massless contact surfaces: their mass is given to the rest of the body, scaled uniformly.

A node with mass that hits an obstacle loses its kinetic energy, and the contact force oscillates from step to step
(docs/theory_contact.md, Massless contact surfaces). `rigid_inertia.py` adds what the inertia of rigid motions lacks.
Source: Khenous, Laborde & Renard, Eur. J. Mech. A/Solids 27 (2008).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from solvers.api import Array
from solvers.structure.instant import MovingStructure

#: Extent of nodes over that of their piece below which it is a rounding error (1e-30): they are one point or, in 3D, on
#: a line. That of the nodes inside of a piece is above 1e-4 with a hundred cells across.
NO_EXTENT = 1e-12


def massless_dofs(structure: MovingStructure) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Masks of owned dofs: massless ones, and those of pieces that touch with nodes that have mass (collective).

    Nodes of all contact surfaces are massless. The other nodes of a piece must determine its rotation: in 2D there are
    two of them, in 3D they are not on a line. If they do not, only nodes of its slave surfaces are massless. If this is
    not enough either, as for one cell with contact on all sides, no node of the piece is.
    """
    constraint, layout, dim = structure.constraint, structure.layout, structure.bodies[0].dim
    assert constraint is not None
    points = np.concatenate([body.points[:dim, : body.owned].T for body in structure.bodies])
    piece, count = structure.pieces.of_nodes, structure.pieces.count
    size = _extent(structure.comm, points, piece, count, np.ones(len(points), dtype=bool))
    found = np.zeros(layout.size // dim, dtype=bool)
    undecided = np.ones(count, dtype=bool)
    for dofs in (constraint.touching_dofs(), constraint.multiplier_dofs()):
        chosen = np.zeros(layout.size, dtype=bool)
        chosen[layout.among_owned(dofs)[1]] = True
        nodes = chosen.reshape(-1, dim).any(axis=1)
        turns = _extent(structure.comm, points, piece, count, ~nodes) > NO_EXTENT * size
        found |= nodes & (undecided & turns)[piece]
        undecided &= ~turns
    return found.repeat(dim), undecided[piece].repeat(dim)


def _extent(comm: MPI.Comm, points: Array, piece: NDArray[np.int64], count: int, chosen: NDArray[np.bool_]) -> Array:
    """Sum of squares [m^2] of chosen nodes from their mean by piece; in 3D from the line through them."""
    dim = points.shape[1]
    x, at = points[chosen], piece[chosen]

    def sums(columns: Sequence[Array]) -> Array:
        return comm.allreduce(np.stack([np.bincount(at, column, count) for column in columns], axis=1))

    total = sums([np.ones(len(x)), *x.T])
    x = x - (total[:, 1:] / np.maximum(total[:, :1], 1.0))[at]
    squares = sums([a * b for a in x.T for b in x.T]).reshape(count, dim, dim)
    return np.linalg.eigvalsh(squares)[:, :2].sum(axis=1)
