"""Condensation of dual multipliers: the linearised balance becomes one without multipliers.

With J the tangent and R the balance without multipliers, both at the interface, a Newton step solves

    J du + R - w F z = 0                     z = P zeta + Z du: multipliers and the directions they may have
    G zeta + H du + r = 0                    the law, one row for each zeta

where w is the weight of the new contact force in the balance and F zeta the force of multipliers on all nodes. The
columns of Q are the directions, orthonormal at each node, in which multipliers act on their nodes. Then
B = Q^T F P is invertible, block by block,

    zeta = B^-1 Q^T ((J - w F Z) du + R) / w,

and what is left is one linear transformation of the rows:

    [L (J - w F Z) + Q H] du = -L R - Q r,   L = I - (F P - Q G / w) B^-1 Q^T.

As Q^T L = G B^-1 Q^T / w, the directions Q carry the law and all others the balance. J contains the derivative of the
contact force at fixed multipliers. Without friction P = Q = n at an
ordinary node, B = -D, and the law is the closing gap.
Source: Popp, Gitterle, Gee & Wall, Int. J. Numer. Meth. Engng 83 (2010), section 4.4, written for several multipliers
at a node and for supports that hold some of its components.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.api import Array
from solvers.contact.blocks import inverse
from solvers.sparse import Sparse, diagonal

#: Entries of L below this are rounding of 1 - 1.
ROUNDING = 1e-13


@dataclass(frozen=True)
class Linearised:
    """What m multipliers with K degrees of freedom add to a Newton step; n = dim * N interface dofs."""

    weight: float  #: w
    force: Sparse  #: F, shape (n, dim * m)
    dforce: Sparse  #: derivative of the contact force at fixed z, shape (n, n)
    basis: Sparse  #: P, shape (dim * m, K)
    turning: Sparse  #: Z, shape (dim * m, n)
    felt: Sparse  #: Q, shape (n, K)
    by_multiplier: Sparse  #: G, shape (K, K)
    by_displacement: Sparse  #: H, shape (K, n)
    residual: Array  #: r, shape (K,)
    transformation: Sparse | None = None  #: of the rows to the basis that multipliers are dual to, shape (n, n)


@dataclass(frozen=True)
class Condensed:
    """The transformation of the rows and what it takes to get the multipliers back."""

    rows: Sparse  #: L, shape (n, n)
    stiffness: Sparse  #: of contact, to be added to J first, shape (n, n)
    added: Sparse  #: Q H, shape (n, n)
    right: Array  #: - Q r, shape (n,)
    inverse: Sparse  #: B^-1 Q^T / w, shape (K, n)


def condense(terms: Linearised) -> Condensed:
    """Eliminate the multipliers."""
    Q, back, FP, to_basis = terms.felt, terms.felt.T, terms.force @ terms.basis, terms.transformation
    if to_basis is not None:
        FP = to_basis.T @ FP
    inverted = inverse(back @ FP) @ back
    law = Q @ (terms.by_multiplier * (1.0 / terms.weight))
    rows = (diagonal(np.ones(Q.shape[0])) - (FP - law) @ inverted).without_small(ROUNDING)
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
