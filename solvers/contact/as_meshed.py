"""Gaps and overlaps of a press fit that straight facets leave between surfaces that coincide.

The interference of a fit is what the meshes do not show. Two circles of chords that do not match show gaps and overlaps
of the height of their arcs, which may exceed it. They are no part of the fit: contact counts gaps from them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from solvers.api import Array
from solvers.contact.pair import Pair
from solvers.contact.terms import Terms


def gaps_as_meshed(pairs: Sequence[Pair], terms: Terms) -> Array:
    """Mean gaps [m] of the multipliers that only face fits, as far as facets explain them, else 0, shape (C,).

    terms: at the places of the meshes.
    """
    off = np.array([pair.off_curve for pair in pairs])
    alone = (terms.D > 0.0) & ~terms.D_of_pair[off == 0.0].any(axis=0)
    gap, most = (
        np.divide(of, terms.D, out=np.zeros_like(terms.D), where=alone) for of in (terms.gap, off @ terms.D_of_pair)
    )
    return np.where(np.abs(gap) <= most, gap, 0.0)
