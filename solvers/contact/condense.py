"""Condensation of dual multipliers: the linearised balance becomes one without multipliers.

With J the tangent and R the balance without multipliers, both at the interface, a Newton step solves

    J du + R - w F z = 0                     z = P zeta + Z du: multipliers and the directions they may have
    G zeta + H du + r = 0                    the law, one row for each zeta

where w is the weight of the new contact force in the balance and F zeta the force of multipliers on all nodes. The
columns of Q are the directions, orthonormal at each node, in which the nodes with multipliers feel them. Then
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
import scipy.sparse as sp

from solvers.api import Array
from solvers.contact.blocks import inverse

#: Entries of L below this are rounding of 1 - 1.
ROUNDING = 1e-13


@dataclass(frozen=True)
class Linearised:
    """What m multipliers with K degrees of freedom add to a Newton step; n = dim * N interface dofs."""

    weight: float  #: w
    force: sp.csr_matrix  #: F, shape (n, dim * m)
    dforce: sp.csr_matrix  #: derivative of the contact force at fixed z, shape (n, n)
    basis: sp.csr_matrix  #: P, shape (dim * m, K)
    turning: sp.csr_matrix  #: Z, shape (dim * m, n)
    felt: sp.csr_matrix  #: Q, shape (n, K)
    by_multiplier: sp.csr_matrix  #: G, shape (K, K)
    by_displacement: sp.csr_matrix  #: H, shape (K, n)
    residual: Array  #: r, shape (K,)
    transformation: sp.csr_matrix | None = None  #: of the rows to the basis that multipliers are dual to, shape (n, n)


@dataclass(frozen=True)
class Condensed:
    """The transformation of the rows and what it takes to get the multipliers back."""

    rows: sp.csr_matrix  #: L, shape (n, n)
    stiffness: sp.csr_matrix  #: of contact, to be added to J first, shape (n, n)
    added: sp.csr_matrix  #: Q H, shape (n, n)
    right: Array  #: - Q r, shape (n,)
    inverse: sp.csr_matrix  #: B^-1 Q^T / w, shape (K, n)


def condense(terms: Linearised) -> Condensed:
    """Eliminate the multipliers."""
    Q, FP, to_basis = terms.felt, terms.force @ terms.basis, terms.transformation
    if to_basis is not None:
        FP = to_basis.T @ FP
    inverted = inverse((Q.T @ FP).tocsr()) @ Q.T
    law = Q @ terms.by_multiplier / terms.weight
    rows = (sp.identity(Q.shape[0]) - (FP - law) @ inverted).tocsr()
    rows.data[np.abs(rows.data) < ROUNDING] = 0.0
    rows.eliminate_zeros()
    return Condensed(
        rows=rows if to_basis is None else (rows @ to_basis.T).tocsr(),
        stiffness=(-terms.weight * (terms.dforce + terms.force @ terms.turning)).tocsr(),
        added=(Q @ terms.by_displacement).tocsr(),
        right=-(Q @ terms.residual),
        inverse=((inverted if to_basis is None else inverted @ to_basis.T) / terms.weight).tocsr(),
    )


def recover(terms: Linearised, condensed: Condensed, balance: Array, du: Array) -> Array:
    """Multipliers [Pa], shape (dim * m,), from J du + R and du at the interface, shapes (n,)."""
    zeta = condensed.inverse @ (balance + condensed.stiffness @ du)
    return terms.basis @ zeta + terms.turning @ du
