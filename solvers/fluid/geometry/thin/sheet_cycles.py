"""Sheets that recur within a step: the parts of a cell that one of them joins stay joined until the step ends.

Where the end of a thin body is in a plane of the grid, one iterate may cross it and the next one not, for ever, as
between two active sets of contact. Joined parts share their nodes, so that both iterates have the same ones.
Where bodies touch, the load by the film between them jumps when it is closed. The closed film may open the contact, and
the open one close it, so that there is no solution: such parts are joined before they recur.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, permutations

import numpy as np

from solvers.algebra.connected import connected_parts
from solvers.fluid.geometry.thin.sheet_nodes import Joined
from solvers.fluid.geometry.thin.sheets import Sheets


def recurring(earlier: Sequence[Sheets], now: Sheets) -> list[Sheets]:
    """Sheets since the last time with the unknowns of the present ones; empty if there was none, or nothing since."""
    for number in range(len(earlier) - 2, -1, -1):
        if earlier[number].same_unknowns(now):
            return list(earlier[number:])
    return []


def joined_in(cycle: Sequence[Sheets]) -> dict[int, frozenset[int]]:
    """Facets of those parts of fluid that are several parts in other sheets of the cycle."""
    found: dict[int, frozenset[int]] = {}
    for one, other in permutations([sheets.facets_of_parts for sheets in cycle], 2):
        for cell, parts in one.items():
            for part in parts:
                if sum(bool(part & there) for there in other.get(cell, ())) > 1:
                    found[cell] = found.get(cell, frozenset()) | part
    return found


def divided_by_touching(before: Sheets, now: Sheets) -> dict[int, frozenset[int]]:
    """Facets of parts that are fewer parts in other sheets, in cells where bodies touch in one of both."""
    found: dict[int, frozenset[int]] = {}
    for cell in np.union1d(before.touching, now.touching).tolist():
        found[cell] = _divided(*(some.facets_of_parts.get(cell, []) for some in (before, now)))
    return {cell: facets for cell, facets in found.items() if facets}


def united(one: Joined, other: Joined) -> dict[int, frozenset[int]]:
    """The facets of both, by cell."""
    return {cell: one.get(cell, frozenset()) | other.get(cell, frozenset()) for cell in sorted({*one, *other})}


def _divided(one: list[set[int]], other: list[set[int]]) -> frozenset[int]:
    """Facets of parts that are connected by common facets, where these are more parts in one than in the other."""
    both = [*one, *other]
    pairs = [(i, j) for i, j in combinations(range(len(both)), 2) if both[i] & both[j]]
    first, second = np.array(pairs, dtype=np.int64).reshape(-1, 2).T
    group = connected_parts(first, second, len(both))
    count, of_other = (np.bincount(some, minlength=len(both)) for some in (group[: len(one)], group[len(one) :]))
    divided = np.minimum(count, of_other)[group] > 0
    divided &= count[group] != of_other[group]
    return frozenset().union(*(both[k] for k in np.flatnonzero(divided)))
