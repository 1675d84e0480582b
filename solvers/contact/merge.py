"""Merging: multipliers of one node whose masters are the same surface become one.

Where a sharp edge points at one surface, both of its sides have this master and their gaps are equivalent. Two
constraints would leave no tangential balance. The function of the merged one is the sum, its normal the mean of theirs.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from solvers.algebra.connected import connected_parts
from solvers.algebra.sparse import sparse_from_entries
from solvers.api import Array
from solvers.contact.blocks import block_diagonal, expand
from solvers.contact.law.law import along
from solvers.contact.mortar import KEEP_AFTER
from solvers.contact.patch import Multipliers
from solvers.contact.terms import Terms

#: Product of the directions of two gaps at a node above which they are equivalent: 45 degrees, half of the angle
#: between two perpendicular surfaces.
SAME_DIRECTION = np.sqrt(0.5)


class Merging:
    """Chooses the merged multipliers in every evaluation; after KEEP_AFTER of them, they stay merged in a step."""

    def __init__(self, multipliers: Multipliers):
        self._node = multipliers.node
        self._several = ~multipliers.only_one
        self._any = bool(self._several.any())
        self._kept = np.empty((0, 2), dtype=np.int64)  # merged pairs
        self._evaluations = 0  # of this step

    def begin_step(self) -> None:
        self._kept = np.empty((0, 2), dtype=np.int64)
        self._evaluations = 0

    def into(self, terms: Terms, constrained: NDArray[np.bool_]) -> NDArray[np.int64]:
        """The multiplier into which each is merged, itself if it is not, shape (C,).

        constrained: mask of the multipliers that may have constraints.
        """
        own = np.arange(len(self._node))
        if not self._any:
            return own
        self._evaluations += 1
        pairs = self._same(terms, np.flatnonzero(self._several & constrained))
        kept = self._kept[constrained[self._kept].all(axis=1)]
        pairs = np.concatenate([pairs, kept])
        if self._evaluations >= KEEP_AFTER:
            self._kept = np.unique(np.concatenate([pairs, self._kept]), axis=0)
        return connected_parts(pairs[:, 0], pairs[:, 1], len(own)) if len(pairs) else own

    def _same(self, terms: Terms, which: NDArray[np.int64]) -> NDArray[np.int64]:
        """Pairs of multipliers at one node whose gaps are equivalent, shape (p, 2)."""
        which = which[np.argsort(self._node[which], kind="stable")]
        directions = _gap_directions(terms, which, self._node[which])
        found = [np.empty((0, 2), dtype=np.int64)]
        for shift in range(1, len(which)):
            at_one = self._node[which[shift:]] == self._node[which[:-shift]]
            if not at_one.any():
                break
            same = at_one & (np.einsum("nd,nd->n", directions[shift:], directions[:-shift]) > SAME_DIRECTION)
            found.append(np.stack([which[:-shift][same], which[shift:][same]], axis=1))
        return np.concatenate(found)


def with_mean_normals(terms: Terms, into: NDArray[np.int64]) -> Terms:
    """Terms in which merged multipliers have the normalised mean of their normals."""
    C, dim = terms.normals.shape
    count = np.bincount(into, minlength=C)[into]
    first = sparse_from_entries(into, np.arange(C), np.ones(C), (C, C))  # sum over those merged, at the first
    total = first.T @ first
    mean = total @ terms.normals
    size = np.where(count > 1, np.linalg.norm(mean, axis=1), 1.0)
    unit = mean / size[:, None]
    turn = np.where((count > 1)[:, None, None], along(unit) / size[:, None, None], np.eye(dim))
    return replace(terms, normals=unit, dnormals=block_diagonal(turn) @ (expand(total, dim) @ terms.dnormals))


def _gap_directions(terms: Terms, which: NDArray[np.int64], node: NDArray[np.int64]) -> Array:
    """Unit vectors along the derivative of each gap by the position of its node, shape (m, dim)."""
    dim = terms.normals.shape[1]
    own = terms.dgap[which]
    row, component = own.row_numbers(), own.indices - dim * node[own.row_numbers()]
    mine = (component >= 0) & (component < dim)
    found = np.zeros((len(which), dim))
    np.add.at(found, (row[mine], component[mine]), own.data[mine])
    return found / np.maximum(np.linalg.norm(found, axis=1), np.finfo(float).tiny)[:, None]
