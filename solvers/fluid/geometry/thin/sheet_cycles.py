"""Sheets that recur within a step: the parts of a cell that one of them joins stay joined until the step ends.

Where the end of a thin body is in a plane of the grid, one iterate may cross it and the next one not, for ever, as
between two active sets of contact. Joined parts share their nodes, so that both iterates have the same ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations

import numpy as np

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
    for one, other in permutations([_facets_of_parts(sheets) for sheets in cycle], 2):
        for cell, parts in one.items():
            for part in parts:
                if sum(bool(part & there) for there in other.get(cell, ())) > 1:
                    found[cell] = found.get(cell, frozenset()) | part
    return found


def _facets_of_parts(sheets: Sheets) -> dict[int, list[set[int]]]:
    """For each cell of the box, the facets of each cell of the mesh in its place."""
    of_cell: dict[int, set[int]] = {}
    for cell, facet in sheets.bounds.tolist():
        of_cell.setdefault(cell, set()).add(facet)
    found: dict[int, list[set[int]]] = {}
    for cell, facets in of_cell.items():
        found.setdefault(int(sheets.box_cells(np.array([cell]))[0]), []).append(facets)
    return found
