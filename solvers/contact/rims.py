"""Directions of pressure near the rims of slave surfaces: along the normals of what is opposite.

A slave surface ends at its rim, while a master may go on and rise against its normals n_j. Pressure along n_j would do
no work where the slave slides up such a rise. Near rims its direction is that of

    a_j + max(A_j - D_j, 0) n_j,   a_j = int Phi_j n_m / (n_m . n)

with the normals n_m of the masters and the area A_j of the node, of which D_j is covered. a_j is the derivative of the
weighted gap with respect to a translation of the masters. A node that slides onto a master begins with its own normal.
Rims are those of smooth pieces, sharp edges among them. Cuts by planes of symmetry are none: there the surface goes on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

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

    def __init__(self, multipliers: Multipliers, points: Array):
        """points: reference positions [m] of all nodes, shape (N, dim)."""
        self._multipliers = multipliers
        self._near = np.zeros(len(multipliers.node), dtype=bool)
        self._areas = np.zeros(len(multipliers.node))
        for patch in multipliers.patches:
            self._near[patch.multipliers[near_rim(patch)]] = True
            self._areas[patch.multipliers] = integrals_of_nodes(points[patch.nodes], patch.facets, patch.facet_type)
        self._any = bool(self._near.any())

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
        if not self._any:
            return terms
        C, dim = terms.normals.shape
        values, parts, of_D = np.zeros((C, dim)), [], []
        for mortar, facet_pairs in used:
            patch, rows = mortar.patch, mortar.patch.multipliers
            near = self._near[rows]
            mine = facet_pairs[near[mortar.facets].any(axis=1)[facet_pairs[:, 0]]]
            if len(mine) == 0:
                continue
            found, slopes, dD = mortar.rises(x, *normals.at(self._multipliers, patch), mine)
            keep = near[:, None] * (np.ones((1, dim)) if patch.mask is None else patch.mask)
            values[rows] += keep * found
            columns = components(np.concatenate([patch.nodes, mortar.masters.nodes]), dim)
            parts += [(part.scaled_rows(keep[:, c]), dim * rows + c, columns) for c, part in enumerate(slopes)]
            of_D.append((dD, rows, columns))
        values, slopes, dD = shares.total_of(
            values, add_up(parts, terms.dnormals.shape), add_up(of_D, terms.dgap.shape)
        )
        turned = values.any(axis=1)
        bare = np.where(turned, np.maximum(self._areas - terms.D, 0.0), 0.0)
        values += bare[:, None] * terms.normals
        slopes += terms.dnormals.scaled_rows(bare.repeat(dim))
        slopes += dD[np.arange(C).repeat(dim)].scaled_rows(-((bare > 0.0)[:, None] * terms.normals).ravel())
        size = np.linalg.norm(values, axis=1)
        unit = np.where(turned[:, None], values, terms.normals) / np.where(turned, size, 1.0)[:, None]
        turn = along(unit) * np.divide(1.0, size, out=np.zeros_like(size), where=turned)[:, None, None]
        others = terms.dnormals.scaled_rows((~turned).repeat(dim).astype(float))
        return replace(terms, normals=unit, dnormals=others + block_diagonal(turn) @ slopes)


def integrals_of_nodes(points: Array, facets: NDArray[np.int64], facet_type: str) -> Array:
    """Integral of the function of each node over the facets, shape (n,); points: [m], (n, dim)."""
    found = np.zeros(len(points))
    shares = [SHARES[facet_type][len(group)] for group in CELL_TYPES[facet_type].nodes]
    np.add.at(found, facets, facet_areas(points, facets, facet_type)[:, None] * shares)
    return found


def near_rim(patch: SlavePatch) -> NDArray[np.bool_]:
    """Mask of the nodes of a patch near its rims, shape (n,)."""
    near = np.zeros(len(patch.nodes), dtype=bool)
    for nodes in rims(patch.facets, patch.facet_type):
        cut = patch.mask is not None and (patch.mask[nodes] == 0.0).all(axis=0).any()
        near[nodes] |= not cut
    for _ in range(FACETS_FROM_RIM):
        near[patch.facets[near[patch.facets].any(axis=1)]] = True
    return near
