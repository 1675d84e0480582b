"""Redistribution: multipliers without a constraint are means of those of their neighbours."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from solvers.algebra.sparse import Sparse, sparse
from solvers.contact.blocks import expand


def redistributed(rows, shares: Sparse | None):
    """Rows of multipliers plus the rows of multipliers without a constraint that are redistributed to them.

    rows: one per multiplier, or one per component of each; shares: see `Redistribution.shares`.
    """
    if shares is None:
        return rows
    components = rows.shape[0] // shares.shape[0]
    return rows + (shares if components == 1 else expand(shares, components)).T @ rows


class Redistribution:
    """Computes the shares of multipliers without a constraint in those of their neighbours.

    A multiplier has no constraint if it would contradict a support or another multiplier, or if too little of its area
    is covered. Its value is the mean of its neighbours. Hence the multipliers still contain constants, and patch tests
    are passed. The function of a neighbour's constraint is the sum of its own and the redistributed functions.
    Source: Popp, Seitz, Gee & Wall, Comput. Methods Appl. Mech. Engng 264 (2013), section 3.
    """

    def __init__(self, facets: Sequence[NDArray[np.int64]], count: int):
        """facets: multipliers of the facets of each patch; count: of all multipliers, C."""
        rows = [np.repeat(of_patch, of_patch.shape[1], axis=1).ravel() for of_patch in facets]
        columns = [np.tile(of_patch, (1, of_patch.shape[1])).ravel() for of_patch in facets]
        row, column = np.concatenate(rows), np.concatenate(columns)
        self._beside = sp.csr_matrix((np.ones(len(row)), (row, column)), shape=(count, count))
        self._beside.data[:] = 1.0
        self._latest: tuple[bytes, Sparse | None] = (b"", None)

    def shares(self, receive: NDArray[np.bool_], give: NDArray[np.bool_], into: NDArray[np.int64]) -> Sparse | None:
        """Shares: rows of multipliers that receive, columns of those that give, shape (C, C); None if all are zero.

        into: the multiplier into which each is merged, itself if it is not.
        """
        merged = into != np.arange(len(into))
        if not receive.any() and not merged.any():
            return None
        key = np.packbits([receive, give]).tobytes() + into[merged].tobytes()
        if self._latest[0] != key:
            self._latest = key, self._spread(receive, give, into, merged)
        return self._latest[1]

    def _spread(
        self,
        receive: NDArray[np.bool_],
        give: NDArray[np.bool_],
        into: NDArray[np.int64],
        merged: NDArray[np.bool_],
    ) -> Sparse | None:
        own = sp.diags(give.astype(float)).tocsr()
        whole = sp.csr_matrix((merged[merged].astype(float), (np.flatnonzero(merged), into[merged])), shape=own.shape)
        served, shares = give | merged, own + whole
        while True:  # a corner may have only neighbours that receive: it is served after them
            count = np.where(receive & ~served, self._beside @ served.astype(float), 0.0)
            if not count.any():
                return (
                    sparse((shares - own).tocsr(), shares.shape) if (served & receive).any() or merged.any() else None
                )
            mean = sp.diags(np.divide(1.0, count, out=np.zeros_like(count), where=count > 0.0)) @ self._beside
            shares = (shares + mean @ sp.diags(served.astype(float)) @ shares).tocsr()
            served = served | (count > 0.0)
