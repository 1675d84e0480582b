"""The choice of multipliers with a constraint: by coverage, supports and merging; redistribution to the others."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.algebra.sparse import Sparse
from solvers.api import Array
from solvers.contact.coverage import Coverage
from solvers.contact.directions import free_normals
from solvers.contact.interface import ContactInterface
from solvers.contact.merge import Merging, with_mean_normals
from solvers.contact.redistribute import Redistribution
from solvers.contact.terms import Terms, find_normals


@dataclass(frozen=True)
class Constrained:
    """The choice for one iterate."""

    terms: Terms  #: with mean normals where multipliers are merged
    covers: NDArray[np.bool_]  #: mask of the multipliers with a constraint, shape (C,)
    merged: NDArray[np.bool_]  #: mask of those that are merged into another one of their node, shape (C,)
    spans: NDArray[np.str_]  #: admissible directions of each, shape (C,)
    shared: Sparse | None  #: redistribution from those with a constraint to those without, shape (C, C)


class Constraints:
    """Combines coverage, merging and redistribution; for how decisions are kept in a step see these."""

    def __init__(self, interface: ContactInterface):
        self._interface = interface
        multipliers = interface.multipliers
        facets = [patch.multipliers[patch.facets] for patch in multipliers.patches]
        self.coverage = Coverage(multipliers.areas)
        self._merging = Merging(multipliers)
        self._redistribution = Redistribution(facets, len(multipliers.node))
        self._blocked = np.zeros(len(multipliers.node), dtype=bool)

    def start(self, x: Array) -> None:
        """Find the blocked multipliers for nodes at x [m], shape (N, dim)."""
        self._blocked = find_blocked(self._interface, x)

    def begin_step(self) -> None:
        self.coverage.begin_step()
        self._merging.begin_step()

    def choose(self, terms: Terms) -> Constrained:
        """The choice by the mortar integrals of an iterate."""
        able = self.coverage.choose(terms.D) & ~self._blocked
        into = self._merging.into(terms, able)
        merged = into != np.arange(len(into))
        if merged.any():
            terms = with_mean_normals(terms, into)
        covers = able & ~merged
        shared = self._redistribution.shares((terms.D != 0.0) & ~able, covers, into)
        return Constrained(terms, covers, merged, self._interface.spans_among(covers), shared)


def find_blocked(interface: ContactInterface, x: Array) -> NDArray[np.bool_]:
    """Mask of the blocked multipliers for nodes at x [m], shape (C,). It is found once, at the start of a run.

    Supports or other multipliers leave them no free direction, or their node is on both sides of a pair.
    """
    multipliers, held = interface.multipliers, interface.nodes.held
    node, slaves = multipliers.node, multipliers.areas > 0.0
    if not held[node[slaves]].any() and multipliers.only_one.all():
        return interface.shared
    normals = find_normals(multipliers, x).values
    own = np.arange(len(node))  # treat every multiplier as the only one of its node
    is_free = np.abs(free_normals(normals, own, held[node])).max(axis=1) > 0.0
    whole = slaves & (interface.spans == "space")
    first = np.zeros(len(node), dtype=bool)
    first[np.flatnonzero(whole)[np.unique(node[whole], return_index=True)[1]]] = True
    blocked = slaves & (interface.nodes.fixed[node] | interface.shared | (~whole & ~is_free))
    return blocked | (slaves & np.isin(node, node[whole]) & ~first)
