"""Ties between the bodies of a structure, as the flow around them sees these: two sides that no fluid separates.

A tie holds in the mean over facets, so that slits and overlaps of the size of the bodies' errors are between its sides.
A cut that follows them would have fluid that comes and goes with each iterate of Newton's method. Therefore both sides
get the same vertices.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from solvers.algebra.sparse import Sparse, diagonal, stack
from solvers.api import Array
from solvers.mesh.cell_types import CELL_TYPES
from solvers.mesh.skin import Skin
from solvers.structure.field import Structure

if TYPE_CHECKING:
    from solvers.contact.surface import Surface

#: Distance of two vertices that are one, relative to that to the next vertex of the same side. From 0.03 to 0.3 nothing
#: depends on it.
CLOSE = 0.3


@dataclass(frozen=True)
class Tie:
    """One side of a tie, and the corners of the facets of the other side [m], shape (k, dim, dim)."""

    side: Surface
    other: Array


def tied_sides(structure: Structure) -> list[Tie]:
    """The sides on elastic bodies of all tied pairs, two for each pair between such bodies."""
    if structure.constraint is None:
        return []
    from solvers.contact.contact import Contact
    from solvers.contact.law.tied import Tied

    contact = structure.constraint
    pairs = contact.pairs if isinstance(contact, Contact) else ()
    tied = [pair for pair in pairs if pair.law == Tied()]
    sides = [(side, other) for p in tied for side, other in ((p.slave, p.master), (p.master, p.slave))]
    return [Tie(side, _simplices(other)) for side, other in sides if side.dofs is not None]


def candidate_facets(body: str, skin: Skin, ties: Sequence[Tie]) -> list[tuple[NDArray[np.bool_], Array]]:
    """For each tie of a body the mask of the facets of its skin that belong to it, and the facets of the other side."""
    found = []
    for tie in ties:
        if tie.side.body == body and tie.side.mesh_nodes is not None:
            mask = np.isin(skin.nodes, tie.side.mesh_nodes)[skin.facets].all(axis=1)
            found.append((mask, tie.other))
    return found


def _simplices(surface: Surface) -> Array:
    """Corners of the segments or triangles of a surface [m], shape (k, dim, dim)."""
    split = np.array(CELL_TYPES[surface.facet_type].simplices)
    return surface.points[surface.facets[:, split].reshape(-1, split.shape[1])]


def join_vertices(
    mixtures: Sequence[tuple[Sparse | None, int]], points: Sequence[Array], tied: Sequence[NDArray[np.int64]]
) -> list[Sparse]:
    """Mixtures of all surfaces from the nodes of all, with vertices of one for those of another in the same place.

    mixtures: of each surface from its own nodes (None: these are its vertices) and their count. points: vertices of
    each [m]. tied: numbers of its vertices on ties.
    """
    nodes = np.concatenate([[0], np.cumsum([count for _, count in mixtures])])
    rows = stack(
        [
            (diagonal(np.ones(count)) if mixture is None else mixture).with_columns(start + np.arange(count), nodes[-1])
            for (mixture, count), start in zip(mixtures, nodes, strict=False)
        ]
    )
    first = np.concatenate([[0], np.cumsum([len(x) for x in points])])
    source = np.arange(first[-1])
    for surface in range(1, len(points)):
        for earlier in range(surface):
            mine, other = _same_places(points[surface][tied[surface]], points[earlier][tied[earlier]])
            mine, other = first[surface] + tied[surface][mine], first[earlier] + tied[earlier][other]
            alone = source[mine] == mine
            source[mine[alone]] = source[other[alone]]
    return [rows[source[a:b]] for a, b in pairwise(first)]


def _same_places(x: Array, y: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Numbers of points of two sides that are each other's nearest ones, and close to each other."""
    if not len(x) or not len(y):
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    in_x, in_y = cKDTree(x), cKDTree(y)
    distance, to_y = in_y.query(x)
    _, to_x = in_x.query(y)
    free = np.minimum(in_x.query(x, k=[2])[0][:, 0], in_y.query(y, k=[2])[0][:, 0][to_y])
    mine = np.flatnonzero((to_x[to_y] == np.arange(len(x))) & (distance < CLOSE * free))
    return mine, to_y[mine]
