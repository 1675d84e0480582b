"""Slave nodes that a support holds entirely: their share of the multipliers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray


def lent_shares(facets: Sequence[NDArray[np.int64]], held: NDArray[np.bool_]) -> sp.csr_matrix | None:
    """What held slave nodes get of the multipliers of their neighbours, shape (N, N); None if no node is held.

    facets: nodes of the facets of each slave surface. A node held entirely has no multiplier of its own: its constraint
    would contradict the support. With the mean of its neighbours' the multipliers still contain all constants, so that
    a patch test is passed; the constraint of the neighbours is then that of their own and the lent functions together.
    Source: Popp, Seitz, Gee & Wall, Comput. Methods Appl. Mech. Engng 264 (2013), section 3.
    """
    if not held.any():
        return None
    beside = sp.lil_matrix((len(held), len(held)))
    for facet in (nodes for surface in facets for nodes in surface):
        beside[np.ix_(facet[held[facet]], facet[~held[facet]])] = 1.0
    count = np.asarray(beside.sum(axis=1)).ravel()
    return (sp.diags(1.0 / np.maximum(count, 1.0)) @ beside).tocsr()
