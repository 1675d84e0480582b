"""Tied surfaces: sum_k W_jk u_k - sum_l M_jl u_l = 0, with mortar integrals in the reference configuration.

On curved surfaces the slave nodes are moved before the run so that rotations fulfil it (`relocated`). The integrals are
those before this (docs/theory_contact.md, Tied surfaces).
Source: Puso & Laursen, Comput. Methods Appl. Mech. Engng 193 (2004); Puso, Int. J. Numer. Meth. Engng 59 (2004).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from solvers.algebra.sparse import Sparse, nothing
from solvers.api import Array
from solvers.contact.blocks import expand
from solvers.contact.coverage import Coverage
from solvers.contact.interface import describe_interface
from solvers.contact.mortar import Mortar, MortarTerms
from solvers.contact.pair import Pair
from solvers.contact.patch import Multipliers
from solvers.contact.redistribute import redistributed
from solvers.contact.slip import Slip
from solvers.contact.terms import find_normals, renumber


class Ties:
    """The ties of some mortars."""

    def __init__(self, mortars: Sequence[Mortar], multipliers: Multipliers, reference: Array, x: Array, pairs: int):
        """reference: positions [m] of all nodes; x: the same before nodes were relocated; both (N, dim).

        pairs: count of those whose shares a law depends on.
        """
        self.pieces: list[tuple[Mortar, MortarTerms]] = []
        N, C = len(x), len(multipliers.node)
        self._reference = reference
        self._no_shares = np.zeros((C, pairs))  # no bound depends on ties
        self.D = np.zeros(C)  #: covered area [m^(dim-1)]
        self.difference = nothing((C, N))  #: (W, -M) over all nodes
        self._shares: Sparse | None = None  # redistribution that the slopes were computed with
        self._slopes: tuple[Sparse, Sparse, NDArray[np.bool_]] | None = None
        normals = find_normals(multipliers, x) if mortars else None
        for mortar in mortars:
            assert normals is not None
            facet_pairs, _ = mortar.near(x, x)
            found, W, M = mortar.tie(x, normals.at(multipliers, mortar.patch)[0], facet_pairs)
            rows, slave, master = mortar.patch.multipliers, mortar.patch.nodes, mortar.masters.nodes
            self.pieces.append((mortar, found))
            self.D[rows] += found.D
            self.difference = self.difference + renumber(W, rows, slave, (C, N)) - renumber(M, rows, master, (C, N))

    def slip(self, x: Array, shares: Sparse | None) -> Slip:
        """Slip since the reference configuration at the positions x [m] of all nodes; shares: of redistribution."""
        if self._slopes is None or self._shares is not shares:
            D = redistributed(self.D, shares)
            share = np.divide(1.0, D, out=np.zeros_like(D), where=D > 0.0)
            mean = redistributed(self.difference, shares).scaled_rows(share)
            self._shares, self._slopes = shares, (mean, expand(mean, x.shape[1]), D > 0.0)
        mean, slopes, defined = self._slopes
        return Slip(mean @ (x - self._reference), slopes, defined, self._no_shares)


def relocated(pair: Pair) -> Array | None:
    """Positions [m] of the slave's nodes with sum W X = sum M X, shape (n, dim); None if the surfaces do not meet."""
    interface = describe_interface([pair])
    patch, x = interface.multipliers.patches[0], interface.nodes.points.copy()
    ties = Ties(interface.mortars, interface.multipliers, x, x, len(interface.pairs))
    tied = Coverage(interface.multipliers.areas).enough(ties.D)
    if not tied.any():
        return None
    away = np.zeros_like(x)
    away[tied] = (ties.difference @ x)[tied] / ties.D[tied, None]
    x[patch.nodes] -= patch.basis()[0] @ away[patch.multipliers]
    return x[interface.nodes_of(pair.slave)]
