"""Directions of pressure near the rims of slave surfaces: along the normals of what is opposite.

A slave surface ends at its rim, while a master may go on and rise against its normals n_j. Pressure along n_j would do
no work where the slave slides up such a rise. Near rims its direction is that of

    w_j (a_j - D_j n_j) + max(A_j, D_j) n_j,   a_j = int Phi_j n_m / (n_m . n)

with the normals n_m of the masters and the area A_j of the node, of which D_j is covered. a_j is the derivative of the
weighted gap with respect to a translation of the masters. The weight w_j is the mean of D / A, within 0 and 1, over the
nodes of the rim: no master goes on beyond a rim that none covers. A node that is pressed in a step gets its direction
once the active set stays, since earlier iterates may pass far through the master. Rims are those of smooth pieces,
sharp edges among them. Cuts by planes of symmetry are none: there the surface goes on.

A stiff rim that is dragged over the facets of something soft meets their slopes one by one: the force along the way
rises and falls, and an equilibrium may end between two facets. A step that failed because its active set cycled is
taken again with the surface's own normals. If that happens twice, the surface has them until it has left contact: to
and fro they would be jumps, which no shorter step makes smaller.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from solvers.algebra.sparse import Sparse, diagonal, sparse_from_entries
from solvers.api import Array
from solvers.contact.blocks import add_up, block_diagonal, components
from solvers.contact.law.law import along
from solvers.contact.mortar import Mortar
from solvers.contact.patch import Multipliers, SlavePatch
from solvers.contact.share import Shares
from solvers.contact.sharp_edges import rims
from solvers.contact.surface import facet_areas
from solvers.contact.terms import Normals, Terms
from solvers.mesh.cell_types import CELL_TYPES

#: Facets between a rim and the last nodes with such a direction. What rises next to a rim tilts the weighted gaps of
#: the nodes of the first facet, and those of the second by its dual functions: a sliding block makes 0.28 % of the work
#: with 1, and 0.002 % with 2 as with any more.
FACETS_FROM_RIM = 2

#: Steps with these directions that cycle before a surface keeps its own. The first may be that of a first touch, whose
#: iterates pass far through the master: with 1 such a touch gets other forces. Where a stiff block is dragged over
#: finer cells, 4 gives the same forces with two repeated steps more, and with 16 or any more it stops.
ENOUGH_FAILURES = 2

#: Integral of the functions of a facet's nodes over its area, by the number of corners between which a node is.
SHARES = {
    "line": {1: 1 / 2},
    "line3": {1: 1 / 6, 2: 2 / 3},
    "triangle": {1: 1 / 3},
    "triangle6": {1: 2 / 15, 2: 1 / 5},  # of the basis that multipliers are dual to
    "quad": {1: 1 / 4},
    "quad9": {1: 1 / 36, 2: 1 / 9, 4: 4 / 9},
}


class Rims:
    """The multipliers near rims, and their directions."""

    def __init__(self, multipliers: Multipliers, points: Array, patches: Sequence[SlavePatch]):
        """points: reference positions [m] of all nodes, shape (N, dim); patches: those with a direction of pressure."""
        self._multipliers = multipliers
        C = len(multipliers.node)
        self._areas, parts = np.zeros(C), []
        for patch in patches:
            parts.append((rims_near(patch), patch.multipliers, patch.multipliers))
            self._areas[patch.multipliers] = integrals_of_nodes(points[patch.nodes], patch.facets, patch.facet_type)
        self._rims = add_up(parts, (C, C))  # mean over the nodes of rims near each multiplier
        self._near = np.diff(self._rims.indptr) > 0
        self._patches = tuple(patches)
        self.failures = np.zeros(C, dtype=np.int64)  #: steps of this contact that cycled with these directions
        self._turns = np.ones(C, dtype=bool)  # those that may have such a direction in this step
        self._pressed = np.zeros(C, dtype=bool)  # near a rim, and in contact with a set that has settled

    def begin_step(self, active: NDArray[np.bool_], cycled: NDArray[np.bool_]) -> None:
        """Begin a step; masks, shape (C,).

        active: of the multipliers in contact; cycled: of those by which the step failed that is taken again.
        """
        self._turns = np.ones_like(active)
        for patch in self._patches:
            mine, again = patch.multipliers, bool(cycled[patch.multipliers].any())
            failures = int(self.failures[mine].max(initial=0)) if active[mine].any() else 0
            self.failures[mine] = failures + (again and bool(self._pressed[mine].any()))
            self._turns[mine] = not again and failures < ENOUGH_FAILURES
        self._pressed = self._near & active & self._turns

    def press(self, active: NDArray[np.bool_]) -> bool:
        """Add multipliers that have come into contact in this step; returns whether there are any."""
        new = self._near & active & ~self._pressed & self._turns
        self._pressed = self._pressed | new
        return bool(new.any())

    def turned(
        self,
        terms: Terms,
        normals: Normals,
        used: Sequence[tuple[Mortar, NDArray[np.int32]]],
        x: Array,
        shares: Shares,
    ) -> Terms:
        """The terms with these directions in place of normals (collective).

        used: the facet pairs of each mortar that contributed on this process; x: positions [m], shape (N, dim).
        """
        if not self._pressed.any():
            return terms
        rises, drises, dD = self._rises(terms, normals, used, x, shares)
        (C, dim), D, n, dn = terms.normals.shape, terms.D, terms.normals, terms.dnormals
        turned = self._pressed & rises.any(axis=1)
        covered = np.divide(D, self._areas, out=np.zeros(C), where=self._areas > 0.0)
        partly = (covered > 0.0) & (covered < 1.0)
        weight = self._rims @ np.clip(covered, 0.0, 1.0)
        dweight = self._rims @ dD.scaled_rows(np.divide(partly, self._areas, out=np.zeros(C), where=partly))
        whole = np.maximum(self._areas, D)
        excess = rises - D[:, None] * n
        values = np.where(turned[:, None], weight[:, None] * excess + whole[:, None] * n, n)
        slopes = (
            drises.scaled_rows(weight.repeat(dim))
            + dn.scaled_rows((whole - weight * D).repeat(dim))
            + _each(dweight, excess)
            + _each(dD, ((D > self._areas) - weight)[:, None] * n)
        )
        size = np.linalg.norm(values, axis=1)
        turned &= size > 0.0  # iterates that fold facets leave no direction
        unit = np.where(turned[:, None], values / np.where(turned, size, 1.0)[:, None], n)
        turn = along(unit) * np.divide(1.0, size, out=np.zeros(C), where=turned)[:, None, None]
        others = dn.scaled_rows((~turned).repeat(dim).astype(float))
        return replace(terms, normals=unit, dnormals=others + block_diagonal(turn) @ slopes)

    def _rises(
        self,
        terms: Terms,
        normals: Normals,
        used: Sequence[tuple[Mortar, NDArray[np.int32]]],
        x: Array,
        shares: Shares,
    ) -> tuple[Array, Sparse, Sparse]:
        """(a near rims, shape (C, dim); its derivatives (dim * C, dim * N); those of D, (C, dim * N))."""
        dim = x.shape[1]
        rises, parts, of_D = np.zeros(terms.normals.shape), [], []
        for mortar, facet_pairs in used:
            patch, rows = mortar.patch, mortar.patch.multipliers
            near = self._near[rows]
            mine = facet_pairs[near[mortar.facets].any(axis=1)[facet_pairs[:, 0]]]
            if len(mine) == 0:
                continue
            found, slopes, dD = mortar.rises(x, *normals.at(self._multipliers, patch), mine)
            keep = near[:, None] * (np.ones((1, dim)) if patch.mask is None else patch.mask)
            rises[rows] += keep * found
            columns = components(np.concatenate([patch.nodes, mortar.masters.nodes]), dim)
            parts += [(part.scaled_rows(keep[:, c]), dim * rows + c, columns) for c, part in enumerate(slopes)]
            of_D.append((dD.scaled_rows(near.astype(float)), rows, columns))
        return shares.total_of(rises, add_up(parts, terms.dnormals.shape), add_up(of_D, terms.dgap.shape))


def _each(rows: Sparse, vectors: Array) -> Sparse:
    """The outer products of the rows of a matrix (C, n) with vectors (C, dim), shape (dim * C, n)."""
    C, dim = vectors.shape
    return rows[np.arange(C).repeat(dim)].scaled_rows(vectors.ravel())


def integrals_of_nodes(points: Array, facets: NDArray[np.int64], facet_type: str) -> Array:
    """Integral of the function of each node over the facets, shape (n,); points: [m], (n, dim)."""
    found = np.zeros(len(points))
    shares = [SHARES[facet_type][len(group)] for group in CELL_TYPES[facet_type].nodes]
    np.add.at(found, facets, facet_areas(points, facets, facet_type)[:, None] * shares)
    return found


def rims_near(patch: SlavePatch) -> Sparse:
    """For each node of a patch the mean over the nodes of rims that are near; no entries elsewhere. Shape (n, n)."""
    n, per = len(patch.nodes), patch.facets.shape[1]
    rim = np.zeros(n, dtype=bool)
    for nodes in rims(patch.facets, patch.facet_type):
        cut = patch.mask is not None and (patch.mask[nodes] == 0.0).all(axis=0).any()
        rim[nodes] |= not cut
    across = patch.facets.repeat(per, axis=1).ravel(), np.tile(patch.facets, per).ravel()
    neighbours = sparse_from_entries(*across, np.ones(patch.facets.size * per), (n, n))
    near = diagonal(rim.astype(float)).without_small(0.0)
    for _ in range(FACETS_FROM_RIM):
        near = neighbours @ near
    near = Sparse(np.ones_like(near.data), near.indices, near.indptr, near.shape)
    count = np.diff(near.indptr)
    return near.scaled_rows(1.0 / np.maximum(count, 1))
