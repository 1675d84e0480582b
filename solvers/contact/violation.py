"""How far multipliers in contact are from their laws, and how much of that is rounding error, node by node.

The rounding errors are those of positions, which grow with the distance from the origin: a gap or a slip that is zero
is the difference of two of them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array
from solvers.contact.directions import admissible
from solvers.contact.interface import ContactInterface
from solvers.contact.law.law import Slopes
from solvers.contact.linearise import ActiveMultipliers, law_rows
from solvers.contact.surface import longest_edge
from solvers.rounding import rounding_error_of_rows
from solvers.sparse import Sparse


def violation(
    interface: ContactInterface, spans: NDArray[np.str_], parts: Sequence[ActiveMultipliers], weight: float
) -> Array:
    """Norm [N] of the residuals of the laws at each node, shape (N,).

    spans: directions of all multipliers, (C,); weight: that of the contact force in the balance.
    """
    multipliers, held_at = interface.multipliers, interface.nodes.held
    squares = np.zeros(len(interface.nodes.points))
    for part in parts:
        node, normals = multipliers.node[part.which], part.point.normals
        missed = part.law.residual(part.point, part.status, weight)
        if part.law.span != "normal":
            held, own = held_at[node], spans[part.which]
            less = held.any(axis=(1, 2)) | (own == "normal")  # not all directions of its law
            missed[less] = admissible(missed[less], normals[less], held[less], own[less])
        np.add.at(squares, node, np.sum(missed**2, axis=1))
    return np.sqrt(squares)


def rounding_of_laws(
    interface: ContactInterface, parts: Sequence[ActiveMultipliers], slopes: Slopes, weight: float, x: Array
) -> Array:
    """Rounding errors [N] of `violation`, shape (N,), for nodes at x [m], shape (N, dim); slopes: of all multipliers."""
    by_z, by_u, _ = law_rows(parts, slopes, weight, x.size)
    z = np.concatenate([part.point.z.ravel() for part in parts] or [np.zeros(0)])
    errors = np.hypot(rounding_error_of_rows(by_z, z), rounding_error_of_rows(by_u, _rounded(interface, x)))
    squares, first = np.zeros(len(x)), 0
    for part in parts:
        own = errors[first : first + part.point.z.size].reshape(part.point.z.shape)
        np.add.at(squares, interface.multipliers.node[part.which], np.sum(own**2, axis=1))
        first += own.size
    return np.sqrt(squares)


def rounding_of_force(interface: ContactInterface, dforce: Sparse, weight: float, x: Array) -> Array:
    """Rounding errors [N] of the contact force in the balance, shape (N, dim); dforce: its derivative at fixed z."""
    return weight * rounding_error_of_rows(dforce, _rounded(interface, x)).reshape(x.shape)


def _rounded(interface: ContactInterface, x: Array) -> Array:
    """Magnitudes [m] whose rounding enters the integrals, shape (N * dim,): distances from the origin, and of nodes."""
    size = np.linalg.norm(x, axis=1)
    edge = np.zeros(len(x))
    for surface, numbers in zip(interface.surfaces, interface.nodes.of_surface, strict=True):
        edge[numbers] = np.maximum(edge[numbers], longest_edge(surface.corners))
    return (size + edge).repeat(x.shape[1])

