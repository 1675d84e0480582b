"""How far multipliers in contact are from their laws, and how much of that is rounding error, node by node.

The rounding errors are those of positions, which grow with the distance from the origin: a gap or a slip that is zero
is the difference of two of them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from solvers.algebra.rounding import EPS, rounding_error_of_rows
from solvers.api import Array
from solvers.contact.condense import Condensed
from solvers.contact.directions import admissible
from solvers.contact.interface import ContactInterface
from solvers.contact.linearise import ActiveMultipliers
from solvers.contact.surface import longest_edge


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


def rounding(interface: ContactInterface, condensed: Condensed, force: Array, x: Array) -> tuple[Array, Array]:
    """Rounding errors [N] of the contact force in the balance, shape (N, dim), and of `violation`, shape (N,).

    condensed: where the multipliers were eliminated last; force: on the nodes [N], x: their positions [m], (N, dim).
    """
    positions = _rounded(interface, x)
    of_force = rounding_error_of_rows(condensed.stiffness, positions).reshape(x.shape)
    of_laws = np.hypot(rounding_error_of_rows(condensed.added, positions).reshape(x.shape), EPS * force)
    return of_force, np.linalg.norm(of_laws, axis=1)


def _rounded(interface: ContactInterface, x: Array) -> Array:
    """Magnitudes [m] whose rounding enters the integrals, shape (N * dim,): distances from the origin, and of nodes."""
    size = np.linalg.norm(x, axis=1)
    edge = np.zeros(len(x))
    for surface, numbers in zip(interface.surfaces, interface.nodes.of_surface, strict=True):
        edge[numbers] = np.maximum(edge[numbers], longest_edge(surface.corners))
    return (size + edge).repeat(x.shape[1])
