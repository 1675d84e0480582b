"""The slip of multipliers in a step, from the mortar integrals at its beginning (superscript n) and at the iterate.

    D_j^n s_j = -[(W - W^n) x_slave - (M - M^n) x_master]_j

with positions x of the iterate (docs/theory_contact.md, Friction). Nodes that will touch in the step have the
integrals W^n and M^n of where they do. W_jk = int Phi_j N_k equals D where the area is fully covered. Laws use the
tangential part of the slip only.
Source: Gitterle, Popp, Gee & Wall, Int. J. Numer. Meth. Engng 84 (2010), section 3.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
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
    normals: Array  #: shape (C, dim)

    def gaps(self, x: Array) -> Array:
        """Mean gaps [m] at the positions x [m] that it belongs to, NaN where nothing is covered, shape (C,)."""
        weighted = -np.einsum("nd,nd->n", self.difference @ x + self.offset, self.normals)
        return np.divide(weighted, self.D, out=np.full_like(self.D, np.nan), where=self.D > 0.0)

    def ways(self, way: Array) -> Array:
        """By how much the gaps change at most if the nodes move by these ways [m], whatever turns, shape (C,)."""
        sizes = replace(self.difference, data=np.abs(self.difference.data)) @ np.linalg.norm(way, axis=1)
        return np.divide(sizes, self.D, out=np.zeros_like(self.D), where=self.D > 0.0)

    def towards(self, later: Beginning, share: Array) -> Beginning:
        """Linear interpolation of the integrals over D; share: of the later ones by multiplier, shape (C,)."""
        own, other = 1.0 - share, np.divide(share * self.D, later.D, out=np.zeros_like(share), where=share > 0.0)
        difference = self.difference.scaled_rows(own) + later.difference.scaled_rows(other)
        offset = own[:, None] * self.offset + other[:, None] * later.offset
        return replace(self, difference=difference, slopes=expand(difference, offset.shape[1]), offset=offset)


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

    def begin_step(self, x: Array, before: Array, active: NDArray[np.bool_], travel: float) -> None:
        """Integrals at the beginning of a step, of open nodes that twice the last way could close where they touch.

        They touch where they come if all nodes move on as in the step before: from the beginning of the step, the part
        of the slip before the contact would be of first order.

        x, before: positions at the beginning of this step and of the last one [m], (N, dim); active: mask of the
        multipliers in contact, (C,); travel: see `Mortar.near`.
        """
        here = self._beginning = self._integrals(x, travel)
        gap, way = here.gaps(x), x - before
        near = ~active & (gap > 0.0) & (gap <= 2.0 * here.ways(way))
        if not near.any():
            return
        clear = [mortar.clear_until for mortar in self.mortars]
        there = self._integrals(x + way, travel + float(np.abs(way).max()))
        for mortar, until in zip(self.mortars, clear, strict=True):
            mortar.clear_until = until  # no node has gone there
        after = there.gaps(x + way)
        approach = near & (after < gap)
        share = np.divide(gap, gap - after, out=np.zeros_like(gap), where=approach)
        self._beginning = here.towards(there, np.minimum(share, 1.0))

    def begin_farther(self, x: Array, travel: float) -> None:
        """The same with a larger reach of some mortars; x: positions at the beginning of this step [m], (N, dim)."""
        self._beginning = self._integrals(x, travel)

    def _integrals(self, x: Array, travel: float) -> Beginning:
        """Those at the positions x [m], (N, dim)."""
        (N, dim, pairs), C = self._shape, self._count
        if all(travel < mortar.clear_until for mortar in self.mortars):
            # all integrals are zero; other pairs, or these by a long step, may still meet
            none = nothing((C, N)), nothing((dim * C, dim * N))
            return Beginning(*none, np.zeros((C, dim)), np.zeros(C), np.zeros((C, pairs)), np.zeros((C, dim)))
        D, covered, offset, parts = np.zeros(C), np.zeros((C, pairs)), np.zeros((C, dim)), []
        normals = find_normals(self._multipliers, x)
        for index, mortar in enumerate(self.mortars):
            facet_pairs, _ = mortar.near(x, x, travel, beyond=mortar.edge)
            facet_pairs = self._shares.mine(index, facet_pairs, len(mortar.facets))
            if len(facet_pairs) == 0:
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
        return Beginning(difference, expand(difference, dim), offset, D, covered, normals.values)

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
