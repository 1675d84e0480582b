"""Facets that several slave surfaces have: each belongs to one part, which has the masters of all of these slaves.

Two surfaces may have the same facets: that of a pair of the case, and that of a pair with a face of the box behind the
obstacle. If they were integrated for each, the gap of their common multipliers would be the mean of both gaps, and the
body would pass the nearer master.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.contact.mortar import Masters
from solvers.contact.pair import Pair
from solvers.contact.patch import Multipliers
from solvers.contact.surface import Surface


@dataclass(frozen=True)
class SlavePart:
    """Facets that the same slaves have."""

    slaves: tuple[int, ...]  #: numbers of these, the first one first
    facets: NDArray[np.int64]  #: in numbers of the split nodes of their patch, shape (f, n)
    place: dict[int, NDArray[np.int64]]  #: by the id of a slave: the place of each of its facets in `facets`, or -1

    def deep_facets(self, joined: Masters, pairs: Sequence[Pair]) -> NDArray[np.int32]:
        """Facets that lie deep in each other at the start, in numbers of the part and of the joined masters, (p, 2)."""
        found = [np.empty((0, 2), dtype=np.int32)]
        for pair in np.unique(joined.pair_of_facet).tolist():
            deep = pairs[pair].deep
            if deep is not None:
                slave = self.place[id(pairs[pair].slave)][deep[:, 0]]
                master = deep[:, 1] + np.argmax(joined.pair_of_facet == pair)
                found.append(np.stack([slave, master], axis=1)[slave >= 0].astype(np.int32))
        return np.concatenate(found)


def parts_of_slave(
    slaves: Sequence[Surface], k: int, pairs: Sequence[Pair], multipliers: Multipliers
) -> list[SlavePart]:
    """The facets of slave k that no earlier slave of its patch has, by the slaves that have them.

    A surface in contact with itself is a part of its own.
    """
    selves = [any(pair.slave is slave and pair.master is slave for pair in pairs) for slave in slaves]
    patch = multipliers.patch_of_surface
    alike = [i for i in range(len(slaves)) if patch[i] == patch[k] and not selves[i]] if not selves[k] else [k]
    facets = [multipliers.facets_of_surface[i] for i in alike]
    every = np.sort(np.concatenate(facets), axis=1)
    ends = np.cumsum([len(own) for own in facets])[:-1]
    number = np.split(np.unique(every, axis=0, return_inverse=True)[1].ravel(), ends)  # one number for equal facets
    mine = number[alike.index(k)]
    has = np.stack([np.isin(mine, own) for own in number], axis=1)
    first = np.array(alike)[has.argmax(axis=1)] == k
    parts = []
    for pattern in np.unique(has[first], axis=0):
        at = np.flatnonzero(first & (has == pattern).all(axis=1))
        chosen = [i for i, present in zip(alike, pattern, strict=True) if present]
        place = {id(slaves[i]): _places(number[alike.index(i)], mine[at]) for i in chosen}
        parts.append(SlavePart(tuple(chosen), multipliers.facets_of_surface[k][at], place))
    return parts


def _places(facets: NDArray[np.int64], among: NDArray[np.int64]) -> NDArray[np.int64]:
    """The place of each facet among others, -1 where it is not one of them."""
    order = np.argsort(among)
    at = order[np.minimum(np.searchsorted(among[order], facets), len(among) - 1)]
    return np.where(among[at] == facets, at, -1)
