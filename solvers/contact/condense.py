"""Condensation of dual multipliers: the linearised balance becomes one without multipliers.

Let J be the tangent and R the balance without multipliers, both at the interface. A Newton iteration solves

    J du + R - w F z = 0                     z = P zeta + Z du: multipliers in their admissible directions
    G zeta + H du + r = 0                    the law, one row for each zeta

with the weight w of the contact force and the force F z of multipliers on all nodes. Q: the directions, orthonormal at
each node, in which multipliers act on their nodes. B = Q^T F P is invertible, block by block, and

    zeta = B^-1 Q^T ((J - w F Z) du + R) / w,
    [L (J - w F Z) + Q H] du = -L R - Q r,   L = I - (F P - Q G / w) B^-1 Q^T

(docs/theory_contact.md, General form). Source: Popp, Gitterle, Gee & Wall, Int. J. Numer. Meth. Engng 83 (2010),
section 4.4.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.algebra.sparse import Sparse, diagonal
from solvers.api import Array
from solvers.contact.blocks import inverse

#: Entries of L below this are rounding errors of 1 - 1.
ZERO_ENTRY = 1e-13


@dataclass(frozen=True)
class Linearised:
    """Linearised force and law of m multipliers with K degrees of freedom; n = dim * N interface dofs."""

    weight: float  #: w
    force: Sparse  #: F, shape (n, dim * m)
    dforce: Sparse  #: derivative of the contact force at fixed z, shape (n, n)
    basis: Sparse  #: P, shape (dim * m, K)
    turning: Sparse  #: Z, shape (dim * m, n)
    node_basis: Sparse  #: Q, shape (n, K)
    by_multiplier: Sparse  #: G, shape (K, K)
    by_displacement: Sparse  #: H, shape (K, n)
    residual: Array  #: r, shape (K,)
    transformation: Sparse | None = None  #: of rows to the basis that multipliers are dual to, (n, n); None: nodal


@dataclass(frozen=True)
class Condensed:
    """The transformation of the rows, and the operator that recovers the multipliers."""

    rows: Sparse  #: L, shape (n, n)
    stiffness: Sparse  #: of contact, added to J before the transformation, shape (n, n)
    added: Sparse  #: Q H, shape (n, n)
    right: Array  #: - Q r, shape (n,)
    inverse: Sparse  #: B^-1 Q^T / w, shape (K, n)


def condense(terms: Linearised) -> Condensed:
    """Eliminate the multipliers from the linearised balance."""
    Q, back, FP, to_basis = terms.node_basis, terms.node_basis.T, terms.force @ terms.basis, terms.transformation
    if to_basis is not None:
        FP = to_basis.T @ FP
    inverted = inverse(back @ FP) @ back
    law = Q @ (terms.by_multiplier * (1.0 / terms.weight))
    rows = (diagonal(np.ones(Q.shape[0])) - (FP - law) @ inverted).without_small(ZERO_ENTRY)
    return Condensed(
        rows=rows if to_basis is None else rows @ to_basis.T,
        stiffness=-terms.weight * (terms.dforce + terms.force @ terms.turning),
        added=Q @ terms.by_displacement,
        right=-(Q @ terms.residual),
        inverse=(inverted if to_basis is None else inverted @ to_basis.T) * (1.0 / terms.weight),
    )


def recover(terms: Linearised, condensed: Condensed, balance: Array, du: Array) -> Array:
    """Multipliers [Pa], shape (dim * m,), from J du + R and du at the interface, shapes (n,)."""
    zeta = condensed.inverse @ (balance + condensed.stiffness @ du)
    return terms.basis @ zeta + terms.turning @ du
