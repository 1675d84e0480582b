"""The slip of multipliers in a step, from the mortar integrals at its beginning (superscript n) and at the iterate.

    D_j^n s_j = -[(W - W^n) x_slave - (M - M^n) x_master]_j

with positions x of the iterate (docs/theory_contact.md, Friction). W_jk = int Phi_j N_k equals D where the area is
fully covered. Laws use the tangential part of the slip only.
Source: Gitterle, Popp, Gee & Wall, Int. J. Numer. Meth. Engng 84 (2010), section 3.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solvers.algebra.sparse import Sparse, nothing
from solvers.api import Array
from solvers.contact.blocks import add_up, components, expand
from solvers.contact.mortar import Mortar
from solvers.contact.patch import Multipliers
from solvers.contact.share import Shares
from solvers.contact.terms import Normals, find_normals


@dataclass(frozen=True)
class Beginning:
    """The integrals at the beginning of a step."""

    difference: Sparse  #: (W^n, -M^n) over all nodes, shape (C, N)
    slopes: Sparse  #: `difference` for all components, shape (dim * C, dim * N)
    offset: Array  #: -M^n times the ways of images of masters, shape (C, dim)
    D: Array  #: shape (C,)
    covered: Array  #: int N_j where the masters of each pair cover the slave, for laws by pair, shape (C, pairs)


@dataclass(frozen=True)
class Slip:
    """The slip of the step up to an iterate."""

    values: Array  #: [m], shape (C, dim), zero where it is not defined
    slopes: Sparse  #: derivatives, shape (dim * C, dim * N)
    defined: NDArray[np.bool_]  #: mask of the multipliers that a master covered at the beginning, shape (C,)
    shares: Array  #: of each pair in the area covered at the beginning, for laws by pair, shape (C, pairs)

    def plus(self, other: Slip) -> Slip:
        """The slip of these and of other multipliers."""
        defined = self.defined | other.defined
        return Slip(self.values + other.values, self.slopes + other.slopes, defined, self.shares + other.shares)


class Sliding:
    """Slip of the present step for the multipliers of some mortars; collective calls."""

    def __init__(
        self,
        mortars: Sequence[Mortar],
        by_pair: Sequence[Mortar],
        multipliers: Multipliers,
        shares: Shares,
        shape: tuple[int, int, int],
    ):
        """by_pair: those of laws that depend on the share of each pair; shape: (N, dim, pairs)."""
        self._by_pair = list(by_pair)
        self.mortars, self._multipliers, self._shares = list(mortars), multipliers, shares
        self._count, self._shape = len(multipliers.node), shape
        self._beginning: Beginning | None = None

    def begin_step(self, x: Array, travel: float) -> None:
        """Integrals at the positions x [m] at the beginning of a step, (N, dim); travel: see `Mortar.near`."""
        (N, dim, pairs), C = self._shape, self._count
        if all(travel < mortar.clear_until for mortar in self.mortars):
            # all integrals are zero; other pairs, or these by a long step, may still meet
            none = nothing((C, N)), nothing((dim * C, dim * N))
            self._beginning = Beginning(*none, np.zeros((C, dim)), np.zeros(C), np.zeros((C, pairs)))
            return
        D, covered, offset, parts = np.zeros(C), np.zeros((C, pairs)), np.zeros((C, dim)), []
        normals = find_normals(self._multipliers, x) if self.mortars else None
        for index, mortar in enumerate(self.mortars):
            facet_pairs, _ = mortar.near(x, x, travel, beyond=mortar.edge)
            facet_pairs = self._shares.mine(index, facet_pairs, len(mortar.facets))
            if normals is None or len(facet_pairs) == 0:
                continue
            at_nodes = normals.at(self._multipliers, mortar.patch)[0]
            found, W, M = mortar.begin(x, at_nodes, facet_pairs)
            rows = mortar.patch.multipliers
            D[rows] += found
            offset[rows] -= M @ mortar.way
            if any(mortar is one for one in self._by_pair):
                pair_of = mortar.masters.pair_of_facet[facet_pairs[:, 1]]
                for pair in np.unique(pair_of):
                    covered[rows, pair] += mortar.covered(x, at_nodes, facet_pairs[pair_of == pair])
            parts += [(W, rows, mortar.patch.nodes), (-M, rows, mortar.masters.nodes)]
        D, covered, offset, difference = self._shares.total_of(D, covered, offset, add_up(parts, (C, N)))
        self._beginning = Beginning(difference, expand(difference, dim), offset, D, covered)

    def evaluate(
        self,
        x: Array,
        normals: Normals,
        used: Sequence[tuple[Mortar, NDArray[np.int32]]],
        redistributed: Callable[[Any], Any],
    ) -> Slip:
        """Slip at the positions x [m]; used: the facet pairs of each mortar that contributed to the integrals there."""
        assert self._beginning is not None
        (N, dim, _), C = self._shape, self._count
        gap, parts = np.zeros((C, dim)), []
        for mortar, facet_pairs in used:
            if not any(mortar is mine for mine in self.mortars):
                continue
            values, slopes = mortar.gap_vectors(x, *normals.at(self._multipliers, mortar.patch), facet_pairs)
            rows, nodes = mortar.patch.multipliers, np.concatenate([mortar.patch.nodes, mortar.masters.nodes])
            gap[rows] += values
            columns = components(nodes, dim)
            parts += [(part, dim * rows + axis, columns) for axis, part in enumerate(slopes)]
        gap, dgap = self._shares.total_of(gap, add_up(parts, (dim * C, dim * N)))
        D = redistributed(self._beginning.D)
        defined = D > 0.0
        share = np.divide(1.0, D, out=np.zeros_like(D), where=defined)
        values = share[:, None] * redistributed(self._beginning.difference @ x + self._beginning.offset + gap)
        slopes = redistributed(self._beginning.slopes + dgap).scaled_rows(share.repeat(dim))
        covered = redistributed(self._beginning.covered)
        total = covered.sum(axis=1, keepdims=True)
        shares = np.divide(covered, total, out=np.zeros_like(covered), where=total > 0.0)
        return Slip(values, slopes, defined, shares)
