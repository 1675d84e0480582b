"""Directions of multipliers, and directions in which they act on their nodes.

Along a direction that a support prescribes, a multiplier acts on the support and not on the node. A multiplier without
a direction of its own is excluded: its constraint would contradict the support or depend on another multiplier.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.algebra.sparse import Sparse, sparse_from_entries
from solvers.api import Array
from solvers.contact.blocks import block_diagonal

#: Smallest sine of the angle between a normal and the span of held directions and earlier normals. Below it, a node
#: would have to move a hundred times its gap to close it.
LEAST_FREE = 1e-2


@dataclass(frozen=True)
class Directions:
    """Directions of m multipliers with K degrees of freedom zeta: z = P zeta + Z du, acting on nodes along Q."""

    basis: Sparse  #: P, shape (dim * m, K)
    node_basis: Sparse  #: Q, orthonormal, shape (dim * N, K)
    turning: Sparse  #: Z = turning @ (derivatives of the normals), shape (dim * m, dim * m)


def free_normals(normals: Array, node: NDArray[np.int64], held: Array) -> Array:
    """Unit vectors along the free part of each normal, orthogonal to earlier ones of the node, shape (m, dim).

    Zero where the free part is below LEAST_FREE. held: projections on the held directions of nodes, (N, dim, dim).
    """
    left = normals - np.einsum("nij,nj->ni", held[node], normals)
    order = _order_at_node(node)
    for k in range(order.max(initial=0) + 1):
        later, mine = order > k, np.flatnonzero(order == k)
        size = np.linalg.norm(left[mine], axis=1)
        unit = left[mine] / np.maximum(size, LEAST_FREE)[:, None]
        unit[size < LEAST_FREE] = 0.0
        left[mine] = unit
        if later.any():
            first = np.zeros(held.shape[:2])
            first[node[mine]] = unit
            taken = first[node[later]]
            left[later] -= np.einsum("nd,nd->n", left[later], taken)[:, None] * taken
    return left


def dependent(normals: Array, node: NDArray[np.int64], held: Array, which: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Those of some multipliers whose normals depend linearly on those of earlier ones of their node.

    which: mask of the multipliers, (C,); others as of `free_normals`.
    """
    several = np.flatnonzero(which)
    if len(several) == 0:
        return several
    return several[~free_normals(normals[several], node[several], held).any(axis=1)]


def _order_at_node(node: NDArray[np.int64]) -> NDArray[np.int64]:
    """Index of each multiplier among those of its node, shape (m,)."""
    order = np.argsort(node, kind="stable")
    ordered = node[order]
    first = np.searchsorted(ordered, ordered)
    found = np.empty(len(node), dtype=np.int64)
    found[order] = np.arange(len(node)) - first
    return found


def find_directions(
    z: Array, normals: Array, node: NDArray[np.int64], held: Array, spans: NDArray[np.str_]
) -> Directions:
    """Directions of multipliers z [Pa] with given normals at nodes; held: see `free_normals`.

    spans: for each multiplier 'normal' (n alone), 'surface' (n and the free tangential directions) or 'space' (all free
    directions, whatever the normal).
    """
    m, dim = normals.shape
    holds = np.rint(np.einsum("nii->n", held[node])).astype(int)
    whole, partly = _wide(spans, holds, dim)
    alone = ~(whole | partly)
    wide = whole | partly

    pressure = np.einsum("nd,nd->n", z, normals)
    turn = pressure[:, None, None] * np.eye(dim) * ~whole[:, None, None]
    P, Q = np.zeros((m, dim, dim)), np.zeros((m, dim, dim))
    used = np.zeros((m, dim), dtype=bool)
    used[wide] = np.arange(dim) < (dim - holds[wide])[:, None]
    if wide.any():
        Q[wide] = _free_directions(held[node][wide]) * used[wide][:, None, :]
        P[whole] = Q[whole]
    P[alone, :, 0] = normals[alone]
    Q[alone, :, 0] = free_normals(normals[alone], node[alone], held)
    used[alone, 0] = True
    if partly.any():
        _span_partly(np.flatnonzero(partly), z, normals, held[node], P, Q, turn)

    def columns(blocks: Array, rows: NDArray[np.int64], count: int) -> Sparse:
        at = np.cumsum(used.ravel()).reshape(used.shape) - 1
        multiplier, column = np.nonzero(used)
        entries = blocks[multiplier, :, column]
        row = dim * rows[multiplier][:, None] + np.arange(dim)
        place = np.repeat(at[multiplier, column][:, None], dim, axis=1)
        return sparse_from_entries(row.ravel(), place.ravel(), entries.ravel(), (count, int(used.sum())))

    return Directions(
        basis=columns(P, np.arange(m), dim * m),
        node_basis=columns(Q, node, dim * len(held)),
        turning=block_diagonal(turn),
    )


def admissible(missed: Array, normals: Array, held: Array, spans: NDArray[np.str_]) -> Array:
    """Residuals of laws, projected on the admissible directions of the multipliers, shape (m, dim).

    In other directions there is no equation: a support takes the force, or the node has other multipliers.
    missed: residuals, (m, dim); held: projections of the node of each multiplier, (m, dim, dim); spans: as above.
    """
    found = missed - np.einsum("nij,nj->ni", held, missed)
    holds = np.rint(np.einsum("nii->n", held)).astype(int)
    whole, partly = _wide(spans, holds, normals.shape[1])
    across = ~whole
    found[across] = np.einsum("nd,nd->n", missed[across], normals[across])[:, None] * normals[across]
    if partly.any():
        t = _along_surface(normals[partly], held[partly])[1]
        found[partly] += np.einsum("nd,nd->n", missed[partly], t)[:, None] * t
    return found


def _wide(spans: NDArray[np.str_], holds: NDArray[np.int64], dim: int) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Masks of the multipliers with all free directions, and of those with two of three; the others have one, (m,)."""
    whole = (spans == "space") | ((spans == "surface") & (holds == 0))
    return whole, (spans == "surface") & (holds == 1) & (dim == 3)


def _along_surface(n: Array, held: Array) -> tuple[Array, Array, Array]:
    """(e, t, |e x n|) with the only held direction e and the unit vector t along e x n."""
    e = np.linalg.eigh(held)[1][:, :, -1]
    t = np.cross(e, n)
    size = np.linalg.norm(t, axis=1)
    return e, t / size[:, None], size


def _free_directions(held: Array) -> Array:
    """Orthonormal columns, free directions first, shape (m, dim, dim); the axes where nothing is held."""
    found = np.broadcast_to(np.eye(held.shape[1]), held.shape).copy()
    some = np.einsum("nii->n", held) > 0.5
    found[some] = np.linalg.eigh(held[some])[1]  # eigenvalues 0 come first, then 1
    return found


def _span_partly(
    which: NDArray[np.int64], z: Array, normals: Array, held: Array, P: Array, Q: Array, turn: Array
) -> None:
    """Set P, Q and turn where one direction e of three is held: multipliers act along n and t, a unit vector on e x n.

    Both turn with n. On the node n acts along t x e, and t along itself, so that rows of the laws have diagonals.
    """
    n = normals[which]
    e, t, size = _along_surface(n, held[which])
    P[which, :, 0], P[which, :, 1] = n, t
    Q[which, :, 0], Q[which, :, 1] = np.cross(t, e), t
    spin = np.cross(e[:, None, :], np.eye(3)).transpose(0, 2, 1) / size[:, None, None]  # e x, as a matrix
    along = np.einsum("nd,nd->n", z[which], t)[:, None, None]
    turn[which] += along * (np.eye(3) - t[:, :, None] * t[:, None, :]) @ spin
