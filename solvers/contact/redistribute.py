"""Slave nodes that cannot have a multiplier of their own: their share of those of their neighbours."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray


def redistributed_shares(facets: Sequence[NDArray[np.int64]], blocked: NDArray[np.bool_]) -> sp.csr_matrix | None:
    """What blocked multipliers get of those of their neighbours, shape (C, C); None if no one is blocked.

    facets: multipliers of the facets of each patch. A blocked one would contradict a support or another multiplier.
    With the mean of its neighbours' the multipliers still contain all constants, so that a patch test is passed; the
    constraint of the neighbours is then that of their own and the redistributed functions together.
    Source: Popp, Seitz, Gee & Wall, Comput. Methods Appl. Mech. Engng 264 (2013), section 3.
    """
    if not blocked.any():
        return None
    C, rows, columns = len(blocked), [], []
    for of_patch in facets:
        n = of_patch.shape[1]
        rows.append(np.repeat(of_patch, n, axis=1).ravel())
        columns.append(np.tile(of_patch, (1, n)).ravel())
    row, column = np.concatenate(rows), np.concatenate(columns)
    beside = sp.csr_matrix((np.ones(len(row)), (row, column)), shape=(C, C))
    beside.data[:] = 1.0
    served, shares = ~blocked, sp.diags((~blocked).astype(float)).tocsr()
    while True:  # a corner has blocked neighbours only: it comes after them
        count = np.where(served, 0.0, beside @ served.astype(float))
        if not count.any():
            return (shares - sp.diags((~blocked).astype(float))).tocsr()
        mean = sp.diags(np.divide(1.0, count, out=np.zeros(C), where=count > 0.0)) @ beside
        shares = (shares + mean @ sp.diags(served.astype(float)) @ shares).tocsr()
        served = served | (count > 0.0)
